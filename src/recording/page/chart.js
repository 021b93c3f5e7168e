// A line chart over frames, with a mark at the frame shown. The pointer selects and reads frames.
class Chart {
  // series: [{name, colour (in the style sheet), values}]; format(value): text; pick(frame): shows
  constructor(title, series, format, pick) {
    Object.assign(this, {title, series, format, pick, frame: 0, hovered: null});
    const box = document.createElement("div");
    box.className = "chart";
    box.innerHTML = "<h2><b></b><span></span></h2><canvas role=\"img\"></canvas>";
    [this.readout, this.canvas] = [box.querySelector("span"), box.querySelector("canvas")];
    box.querySelector("b").textContent = title;
    document.getElementById("charts").append(box);
    const known = series.flatMap((line) => line.values).filter((value) => value !== undefined);
    const [low, high] = extremes(known), usual = known.sort((a, b) => a - b)[
      Math.floor(0.95 * (known.length - 1))];
    this.low = Math.min(0, low);
    this.high = Math.min(high, usual > 0 ? 2.5 * usual : high);  // cuts off outliers
    if (!(this.high > this.low)) this.high = this.low + 1;
    this.listen();
  }

  listen() {
    const frameAt = (event) => {
      const box = this.canvas.getBoundingClientRect(), share = (event.clientX - box.left) / box.width;
      return Math.min(Math.max(Math.round(share * (run.frames.length - 1)), 0),
        run.frames.length - 1);
    };
    this.canvas.addEventListener("pointermove", (event) => {
      this.hovered = frameAt(event);
      if (event.buttons & 1) this.pick(this.hovered);
      this.draw();
    });
    this.canvas.addEventListener("pointerdown", (event) => this.pick(frameAt(event)));
    this.canvas.addEventListener("pointerleave", () => {
      this.hovered = null;
      this.draw();
    });
  }

  show(frame) {
    this.frame = frame;
    this.draw();
  }

  draw() {
    const {canvas} = this, ratio = window.devicePixelRatio || 1;
    const width = canvas.clientWidth, height = canvas.clientHeight;
    if (canvas.width !== Math.round(width * ratio)) canvas.width = Math.round(width * ratio);
    if (canvas.height !== Math.round(height * ratio)) canvas.height = Math.round(height * ratio);
    // Draws on the CPU, which is faster for a few lines.
    const pen = canvas.getContext("2d", {willReadFrequently: true});
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    pen.clearRect(0, 0, width, height);
    const last = Math.max(run.frames.length - 1, 1);
    const x = (frame) => 3 + frame / last * (width - 6);
    const y = (value) => height - 5 -
      Math.min((value - this.low) / (this.high - this.low), 1.04) * (height - 20);
    this.drawGrid(pen, width, y);
    for (const line of this.series) this.drawLine(pen, line, x, y);
    this.drawMark(pen, x, y, height);
    this.sayValues();
  }

  drawGrid(pen, width, y) {
    pen.strokeStyle = css("--line");
    pen.fillStyle = css("--soft");
    pen.lineWidth = 1;
    pen.font = "11px system-ui, sans-serif";
    for (const value of [this.low, (this.low + this.high) / 2, this.high]) {
      pen.beginPath();
      pen.moveTo(0, Math.round(y(value)) + 0.5);
      pen.lineTo(width, Math.round(y(value)) + 0.5);
      pen.stroke();
    }
    pen.fillText(this.format(this.high), 2, y(this.high) - 4);
  }

  drawLine(pen, line, x, y) {
    pen.strokeStyle = css(line.colour);
    pen.lineWidth = 1.6;
    pen.lineJoin = "round";
    pen.beginPath();
    let open = false;
    line.values.forEach((value, frame) => {
      if (value === undefined) {
        open = false;
      } else if (open) {
        pen.lineTo(x(frame), y(value));
      } else {
        pen.moveTo(x(frame), y(value));
        open = true;
      }
    });
    pen.stroke();
  }

  drawMark(pen, x, y, height) {
    for (const [frame, colour] of [[this.hovered, "--soft"], [this.frame, "--ink"]]) {
      if (frame === null) continue;
      pen.strokeStyle = css(colour);
      pen.lineWidth = 1;
      pen.beginPath();
      pen.moveTo(Math.round(x(frame)) + 0.5, 6);
      pen.lineTo(Math.round(x(frame)) + 0.5, height);
      pen.stroke();
      for (const line of this.series) {
        if (line.values[frame] === undefined) continue;
        pen.fillStyle = css(line.colour);
        pen.beginPath();
        pen.arc(x(frame), y(line.values[frame]), 3.2, 0, 2 * Math.PI);
        pen.fill();
      }
    }
  }

  sayValues() {
    const frame = this.hovered === null ? this.frame : this.hovered;
    const values = this.series.map((line) => line.values[frame])
      .filter((value) => value !== undefined).map((value) => this.format(value));
    this.readout.textContent = `frame ${frame + 1}: ${values.join(" · ") || "–"}`;
    this.canvas.setAttribute("aria-label", `${this.title} over the frames. Now ` +
      `${this.readout.textContent}. Axis up to ${this.format(this.high)}.`);
  }
}
