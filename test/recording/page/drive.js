// Put behind a page by run.sh: drives it as a user would, and compares what it shows with what the
// bodies held (`expected`, written by record_runs). Findings go into the document. With #play it
// lets the run play instead: that takes time, which run.sh then lets pass faster.
(async () => {
  const failures = [], page = window.adaptiveBvhPage, mode = location.hash;
  let checks = 0;
  const check = (holds, what) => {
    ++checks;
    if (!holds && failures.length < 20) failures.push(what);
  };
  const text = (id) => (document.getElementById(id) || {}).textContent;
  const press = (key) => document.body.dispatchEvent(
    new KeyboardEvent("keydown", {key, bubbles: true, cancelable: true}));
  const near = (a, b, tolerance) => Math.abs(a - b) <= tolerance;
  const hasVolumes = expected.frames.some(({bodies}) => bodies.some(({volumes}) => volumes > 0));
  // A length that is shown, in the unit of the run.
  const lengthIn = (shown) => {
    const [number, unit] = shown.split(" "), sizes = {km: 1e3, m: 1, mm: 1e-3, "µm": 1e-6, nm: 1e-9};
    return Number(number) * (sizes[unit] / sizes[page.run.unit] || 1);
  };
  const showsLength = (shown, value) =>
    Math.abs(lengthIn(shown) - value) <= 0.00501 * Math.abs(value) && /^-?[\d.]+(e[-+]\d+)?( .m| m)?$/.test(shown);
  const showsTime = (shown, value) =>
    / ms$/.test(shown) && Math.abs(parseFloat(shown) - value) <= 0.00501 * value;

  // How many of a picture's pixels show something; and a number that stands for all of them.
  function look() {
    const {pixels, width, height} = page.pixels();
    let drawn = 0, sum = 0;
    const colours = new Set();
    for (let i = 0; i < pixels.length; i += 4) {
      if (pixels[i + 3] > 0) {
        ++drawn;
        colours.add(pixels[i] << 16 | pixels[i + 1] << 8 | pixels[i + 2]);
      }
      sum = (31 * sum + pixels[i] + 3 * pixels[i + 1] + 7 * pixels[i + 2]) % 4294967291;
    }
    return {share: drawn / (width * height), colours: colours.size, sum};
  }

  function checkNumbers(frame, wanted) {
    const at = `frame ${frame + 1}`, now = page.run.frames[frame];
    check(text("frame-number") === `${frame + 1} / ${expected.frames.length}`, `${at}: number`);
    check(document.getElementById("scrubber").value === String(frame), `${at}: scrubber`);
    for (const [name, shows] of [["distance", showsLength], ["updateMs", showsTime],
      ["queryMs", showsTime], ["vertexDistance", showsLength],
      ["contacts", (shown, count) => shown === count.toLocaleString("en")]]) {
      if (wanted[name] === undefined) continue;
      check(shows(text(`value-${name}`), wanted[name]),
        `${at}: shows ${name} ${text(`value-${name}`)}, recorded was ${wanted[name]}`);
    }
    check(now.distance === wanted.distance, `${at}: the distance is not the same number`);
    check((now.nearest || []).length === wanted.nearest, `${at}: nearest points`);
    check(text("note") === (wanted.note || "") && document.getElementById("note").hidden === !wanted.note,
      `${at}: note`);
    if (wanted.note) check(!text("caption").includes(wanted.note), `${at}: the note is in the caption`);
    page.seriesLabels.forEach((label, i) => {
      const value = (wanted.series || {})[label];
      check(text(`value-series-${i}`) === (value === undefined ? "–" : page.shown.number(value)),
        `${at}: ${label} is shown as ${text(`value-series-${i}`)}, recorded was ${value}`);
    });
    check(Object.keys(wanted.series || {}).every((label) => page.seriesLabels.includes(label)),
      `${at}: a series is missing`);
    if (wanted.time !== undefined)
      check(text("value-time") === page.shown.moment(wanted.time), `${at}: time ${text("value-time")}`);
    check(text("caption").includes("Patches") === wanted.coloured > 0,
      `${at}: the caption says: ${text("caption")}`);
    if (wanted.visible !== undefined)
      check(page.bodies.filter(({mesh}) => mesh.visible).length === wanted.visible, `${at}: bodies`);
    Object.entries(wanted.drawn).forEach(([label, count]) => {
      const view = page.labelViews.find((one) => one.label === label);
      check(view && view.drawn === count, `${at}: ${view && view.drawn} of ${count} of ${label}`);
    });
  }

  function checkBody(frame, b, wanted) {
    const at = `frame ${frame + 1}, ${page.run.bodies[b].name}`;
    const block = page.run.frames[frame].bodies[b].positions, drawn = page.positions(b);
    for (const [vertex, ...place] of wanted.positions)
      place.forEach((coordinate, k) => {
        const tolerance = block.size[k] * (0.5 / 65535 + 2e-7);
        check(near(block.low[k] + drawn[3 * vertex + k], coordinate, tolerance),
          `${at}: vertex ${vertex} is drawn at ${block.low[k] + drawn[3 * vertex + k]}, not ${coordinate}`);
      });
    // A body that was recorded without volumes has none on the page.
    const {count = 0, refitted = 0, others = 0} = page.volumes(b) || {};
    check(count === wanted.volumes, `${at}: ${count} volumes of ${wanted.volumes}`);
    check(refitted === wanted.refitted, `${at}: ${refitted} refitted of ${wanted.refitted}`);
    check(refitted + others === wanted.allRefitted || (others >= 100 && refitted + others < wanted.allRefitted),
      `${at}: ${others} refitted elsewhere of ${wanted.allRefitted}`);
  }

  function checkPictures() {
    page.show(0);
    const all = look();
    check(all.share > 0.05, `only ${(100 * all.share).toFixed(1)} % of the picture is drawn on`);
    check(all.colours > (hasVolumes ? 200 : 50), `only ${all.colours} colours`);
    if (hasVolumes) press("v");
    const bare = look();
    check((bare.sum !== all.sum) === hasVolumes, "V does not hide the volumes");
    check(bare.share > 0.02, "nothing is left without volumes");
    press("e");
    check(look().sum !== bare.sum, "E shows no edges");
    press("e");
    page.orbit.rotate(200, 0);
    check(look().sum !== bare.sum, "turning changes nothing");
    press("r");
    check(look().sum === bare.sum, "R does not reset the view");
    if (hasVolumes) press("v");
    page.show(Math.floor(expected.frames.length / 2));
    check(look().sum !== all.sum, "another frame looks the same");
  }

  function checkKeys() {
    const last = expected.frames.length - 1;
    const steps = [["Home", 0], ["ArrowRight", 1], ["ArrowRight", 2], ["ArrowLeft", 1], ["End", last],
      ["ArrowRight", last], ["Home", 0], ["ArrowLeft", 0]];
    for (const [key, frame] of steps) {
      press(key);
      check(page.frame === frame, `${key} leads to frame ${page.frame + 1}`);
    }
    if (hasVolumes) {
      press("+");
      check(text("depth-number") === String(expected.depth + 1), "+ does not go deeper");
      press("-");
      check(text("depth-number") === String(expected.depth), "- does not go up");
    }
    document.getElementById("next").click();
    check(page.frame === 1, "the button does not step");
    const scrubber = document.getElementById("scrubber");
    scrubber.value = last;
    scrubber.dispatchEvent(new Event("input"));
    check(page.frame === last, "the scrubber does not lead to the last frame");
    const chart = document.querySelector(".chart canvas");
    if (!chart) return;
    const box = chart.getBoundingClientRect();
    chart.dispatchEvent(new PointerEvent("pointerdown", {clientX: box.left + box.width / 2}));
    check(near(page.frame, last / 2, 1), "the chart does not lead to its middle");
    chart.dispatchEvent(new PointerEvent("pointermove", {clientX: box.left + 1}));
    const {time} = expected.frames[0];
    const first = time === undefined ? "frame 1:" : `${page.shown.moment(time)}:`;
    check(document.querySelector(".chart h2 span").textContent.startsWith(first),
      "the chart does not say what is under the pointer");
    const titles = [...document.querySelectorAll(".chart h2 b")].map(({textContent}) => textContent);
    check(page.seriesLabels.every((label) => titles.includes(label)), `charts: ${titles}`);
  }

  async function checkPlaying() {
    page.show(0);
    press(" ");
    check(page.playing, "the space bar does not play");
    const deadline = performance.now() + 20000;
    while (page.frame < 3 && performance.now() < deadline)
      await new Promise((resolve) => setTimeout(resolve, 20));
    check(page.frame >= 3, "playing does not go on");
    press(" ");
    check(!page.playing, "the space bar does not pause");
  }

  // Chromium has no window of a phone's width, but the page can be laid out for one.
  function checkLayout() {
    const width = mode === "#phone" ? 390 : window.innerWidth;
    document.body.style.width = `${width}px`;
    window.dispatchEvent(new Event("resize"));
    const wide = document.body.scrollWidth;
    check(wide <= width, `the page is ${wide} wide in a window of ${width}`);
    for (const id of ["scene", "play", "scrubber", "caption", "bodies", "save-video"]) {
      const box = document.getElementById(id).getBoundingClientRect();
      check(box.width > 20 && box.left >= 0 && box.right <= width + 1, `${id} is cut off`);
    }
    // On a desk the end of the page is in the window, and the panel scrolls.
    if (width > 820) {
      const panel = document.getElementById("panel"), end = document.querySelector("footer");
      check(end.getBoundingClientRect().bottom <= window.innerHeight + 1, "the end is cut off");
      panel.scrollTop = panel.scrollHeight;
      const last = panel.lastElementChild.getBoundingClientRect();
      check(last.bottom <= panel.getBoundingClientRect().bottom + 1, "the panel's end is cut off");
      panel.scrollTop = 0;
    }
    for (const button of document.querySelectorAll("button"))
      check(button.getAttribute("aria-label") || button.textContent.trim(), "a button has no label");
    for (const input of document.querySelectorAll("input"))
      check(input.getAttribute("aria-label") || input.closest("label").textContent.trim(),
        `${input.id} has no label`);
    for (const image of document.querySelectorAll("[role=img]"))
      check(image.getAttribute("aria-label"), "an image has no label");
  }

  // Three digits and a prefix; a scale bar of the length that it says.
  function checkLengths() {
    if (page.run.unit === "mm")
      for (const [value, shown] of [[8.2345, "8.23 mm"], [0.0123456, "12.3 µm"], [1234, "1.23 m"],
        [999.6, "1.00 m"], [0, "0 mm"], [-25, "-25.0 mm"],
        [2.73e-8, "0.0273 nm"], [2.73e-13, "2.73e-13 mm"]])
        check(page.shown.length(value) === shown, `${value} is shown as ${page.shown.length(value)}`);
    for (const [value, shown] of [[123.456, "123"], [1234567, "1.23e+6"], [0.0009996, "0.00100"]])
      check(page.shown.number(value) === shown, `${value} is shown as ${page.shown.number(value)}`);
    page.orbit.reset();
    page.render();
    const wide = lengthIn(page.scaleBar.text) / page.scaleBar.pixels;
    page.orbit.zoom(0.1);
    page.render();
    const near10 = lengthIn(page.scaleBar.text) / page.scaleBar.pixels;
    check(near(wide / near10, 10, 0.1), `the scale bar changes by ${wide / near10} when 10 times nearer`);
    check(document.getElementById("scale").textContent === page.scaleBar.text, "text of the scale bar");
    page.orbit.reset();
  }

  // Each setting of what is drawn changes the picture, and back.
  function checkSettings() {
    page.orbit.reset();
    page.show(Math.floor(expected.frames.length / 2));
    const set = (id, value) => {
      const input = document.getElementById(id);
      if (input.type === "checkbox") input.click();
      else input.value = value;
      if (input.type !== "checkbox") input.dispatchEvent(new Event("input"));
    };
    const ids = [...document.querySelectorAll(
      "#bodies input[type=checkbox], #grid, #patches, #through, [id^=label-]")]
      .map(({id}) => id)
      .filter((id) => !id.startsWith("body-") || page.bodies[Number(id.slice(5))].mesh.visible);
    for (const id of ids) {
      const before = look().sum;
      set(id);
      check(look().sum !== before, `${id} changes nothing`);
      set(id);
      check(look().sum === before, `${id} does not bring back what it hid`);
    }
    const before = look().sum;
    set("opacity-0", 0.3);
    check(look().sum !== before, "opacity changes nothing");
    set("opacity-0", 1);
    check(look().sum === before, "a body that was faint does not become solid");
    if (document.getElementById("range-to")) {
      const range = page.run.vertexDistanceRange, legend = text("distance-legend");
      if (range) check(legend.includes(page.shown.short(range[1], range[1])), `legend: ${legend}`);
      set("range-to", 0.1);
      check(look().sum !== before, "another range of colours changes nothing");
      check(text("distance-legend").includes(page.shown.short(0.1, 0.1)), "the legend's range");
      set("range-to", range ? range[1] : "");
      check(look().sum === before, "the range of colours does not come back");
    }
    set("colour-0", "#ff0000");
    check(document.getElementById("vertexDistances") || look().sum !== before, "a colour changes nothing");
  }

  // The address keeps the view, and opens the page with it.
  async function checkAddress() {
    page.orbit.reset();
    page.orbit.rotate(100, 40);
    page.orbit.zoom(0.7);
    page.orbit.move(30, 20);
    const there = look().sum, {turn, zoom} = page.orbit.view;
    const until = performance.now() + 5000;
    while (!location.hash.includes("view=") && performance.now() < until)
      await new Promise((resolve) => setTimeout(resolve, 50));
    const saved = new URLSearchParams(location.hash.slice(1)).get("view");
    page.orbit.reset();
    check(look().sum !== there, "R does not reset the view");
    page.orbit.load(saved);
    check(near(page.orbit.view.turn, turn, 1e-3) && near(page.orbit.view.zoom, zoom, 1e-3),
      `the address keeps another view: ${saved}`);
    const kept = page.orbit.view.turn;
    page.orbit.load("1,2,3");
    page.orbit.load("1,2,x,0,0,0");
    check(page.orbit.view.turn === kept, "a damaged address is taken");
  }

  // Files that are saved: a PNG of the view, and a video of all frames. What the video shows is not
  // checked: in virtual time the encoder gets no pictures.
  async function checkExports() {
    const view = page.composeView(), pen = view.getContext("2d");
    const blob = await new Promise((resolve) => view.toBlob(resolve, "image/png"));
    check(blob.type === "image/png" && blob.size > 5000, `a PNG of ${blob.size} bytes`);
    const image = pen.getImageData(0, 0, view.width, view.height).data;
    const colours = new Set();
    for (let i = 0; i < image.length; i += 40) colours.add(image[i] << 16 | image[i + 1] << 8 | image[i + 2]);
    check(colours.size > 50, `the picture has ${colours.size} colours`);
    let shownFrames = 0;
    const film = await page.filmFrames(() => ++shownFrames <= 5);
    check(shownFrames === 6 && film.type.startsWith("video/") && film.size > 0,
      `a video of ${film.size} bytes of ${shownFrames} frames`);
  }

  function checkAll() {
    check(page.run.frames.length === expected.frames.length, "number of frames");
    check(text("facts").includes("16 bits") && / \d+\.\d MB/.test(text("facts")), "facts");
    check(!page.settings.volumes, "volumes are drawn without a request");
    check(hasVolumes || !/volume/i.test(text("panel") + text("words")), "volumes that were not recorded are named");
    if (mode !== "#large") checkLengths();
    if (mode !== "#large") checkSettings();
    if (hasVolumes) press("v");
    if (hasVolumes) page.setDepth(expected.depth);
    check(!!document.getElementById("volumes") === hasVolumes, "a setting for volumes, or none");
    expected.frames.forEach((wanted, frame) => {
      page.show(frame);
      checkNumbers(frame, wanted);
      wanted.bodies.forEach((body, b) => checkBody(frame, b, body));
    });
    checkPictures();
    checkKeys();
    checkLayout();
  }

  try {
    if (mode === "#play") {
      await checkPlaying();
      await checkAddress();
      await checkExports();
    }
    else checkAll();
  } catch (error) {
    failures.push(String(error && error.stack || error));
  }
  for (const error of window.pageErrors) failures.push(`console: ${error}`);
  const findings = document.createElement("pre");
  findings.id = "findings";
  findings.textContent = `FINDINGS ${checks} checks, ${failures.length} failures, first picture ` +
    `${Math.round(page.firstPictureMs)} ms, window ${window.innerWidth}\n${failures.join("\n")}\nEND`;
  document.body.append(findings);
})();
