// A line chart over frames or the run's time, with a mark at the frame shown. The pointer selects and reads frames.
const kAxisHeight = 15;  // of the labels below the lines, in pixels

class Chart {
  // series: [{name, colour (in the style sheet), values}]; format(value): text; pick(frame): shows
  constructor(title, series, format, pick) {
    Object.assign(this, {title, series, format, pick, frame: 0, hovered: null});
    const box = document.createElement("div");
    box.className = "chart";
    box.innerHTML = "<h2><b></b><span></span></h2><canvas role=\"img\"></canvas>";
    [this.readout, this.canvas] = [box.querySelector("span"), box.querySelector("canvas")];
    box.querySelector("b").textContent = box.querySelector("b").title = title;
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
    // The frame whose position on the axis is nearest to the pointer's.
    const frameAt = (event) => {
      const box = this.canvas.getBoundingClientRect(), share = (event.clientX - box.left) / box.width;
      const wanted = axis.low + share * (axis.high - axis.low);
      const next = axis.at.findIndex((at) => at >= wanted);
      if (next < 0) return axis.at.length - 1;
      return next > 0 && wanted - axis.at[next - 1] < axis.at[next] - wanted ? next - 1 : next;
    };
    this.canvas.addEventListener("pointermove", (event) => {
      this.hovered = frameAt(event);
      if (event.buttons & 1) this.pick(this.hovered);
      this.draw();
    });
    whenResized(this.canvas, () => this.draw());
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
    const x = (frame) => 3 + (axis.at[frame] - axis.low) / (axis.high - axis.low || 1) * (width - 6);
    const y = (value) => height - kAxisHeight - 5 -
      Math.min((value - this.low) / (this.high - this.low), 1.04) * (height - kAxisHeight - 20);
    this.drawGrid(pen, width, y);
    this.drawAxis(pen, width, height);
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

  // The ends of the axis and round positions between, in the run's time or in frames.
  drawAxis(pen, width, height) {
    const {low, high, isTime} = axis, span = high - low || 1, kLabel = 64;
    const text = (at) => (isTime ? shown.moment(Number(at.toPrecision(12))) : `${at}`)
      .replace(/(\.\d*?)0+(?= |$)/, "$1").replace(/\.(?= |$)/, "");
    const step = Math.max(2 * roundDown(span * kLabel / width), isTime ? 0 : 1);
    const last = isTime ? text(high) : `frame ${high}`;
    pen.textAlign = "right";
    pen.fillText(last, width - 1, height - 3);
    const end = width - 8 - pen.measureText(last).width;
    pen.textAlign = "left";
    for (let at = Math.ceil(low / step) * step; at < high; at += step) {
      const label = text(at), left = Math.max(3 + (at - low) / span * (width - 6) -
        pen.measureText(label).width / 2, 1);
      if (left + pen.measureText(label).width < end) pen.fillText(label, left, height - 3);
    }
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
      pen.lineTo(Math.round(x(frame)) + 0.5, height - kAxisHeight);
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
    const when = axis.isTime ? shown.moment(axis.at[frame]) : `frame ${frame + 1}`;
    this.readout.textContent = `${when}: ${values.join(" · ") || "–"}`;
    this.canvas.setAttribute("aria-label", `${this.title} over the ` +
      `${axis.isTime ? "time" : "frames"}. Now ` +
      `${this.readout.textContent}. Axis up to ${this.format(this.high)}.`);
  }
}
