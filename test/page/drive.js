// Put behind a page by run.sh: drives it as a user would, and compares what it shows with what the
// bodies held (`expected`, written by record_runs). Findings go into the document. With #play it
// lets the run play instead: that takes time, which run.sh then lets pass faster.
(async () => {
  const failures = [], page = window.adaptiveBvhPage;
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
  const unit = page.run.unit ? " " + page.run.unit : "";

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
    for (const [name, format] of [["distance", (v) => v.toPrecision(6) + unit],
      ["updateMs", (v) => v.toPrecision(3) + " ms"], ["queryMs", (v) => v.toPrecision(3) + " ms"],
      ["clearance", (v) => v.toPrecision(6) + unit],
      ["contacts", (v) => v.toLocaleString("en")]]) {
      if (wanted[name] === undefined) continue;
      check(text(`value-${name}`) === format(wanted[name]),
        `${at}: shows ${name} ${text(`value-${name}`)}, recorded was ${wanted[name]}`);
    }
    check(now.distance === wanted.distance, `${at}: the distance is not the same number`);
    check((now.nearest || []).length === wanted.nearest, `${at}: nearest points`);
    if (wanted.note) check(text("caption").includes(wanted.note), `${at}: note`);
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
    const chart = document.querySelector(".chart canvas"), box = chart.getBoundingClientRect();
    chart.dispatchEvent(new PointerEvent("pointerdown", {clientX: box.left + box.width / 2}));
    check(near(page.frame, last / 2, 1), "the chart does not lead to its middle");
    chart.dispatchEvent(new PointerEvent("pointermove", {clientX: box.left + 1}));
    check(document.querySelector(".chart h2 span").textContent.startsWith("frame 1:"),
      "the chart does not say what is under the pointer");
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
    const width = location.hash === "#phone" ? 390 : window.innerWidth;
    document.body.style.width = `${width}px`;
    window.dispatchEvent(new Event("resize"));
    const wide = document.body.scrollWidth;
    check(wide <= width, `the page is ${wide} wide in a window of ${width}`);
    for (const id of ["scene", "play", "scrubber", "caption", "numbers"]) {
      const box = document.getElementById(id).getBoundingClientRect();
      check(box.width > 20 && box.left >= 0 && box.right <= width + 1, `${id} is cut off`);
    }
    for (const button of document.querySelectorAll("button"))
      check(button.getAttribute("aria-label"), "a button has no label");
  }

  function checkAll() {
    check(page.run.frames.length === expected.frames.length, "number of frames");
    check(text("facts").includes("16 bits") && / \d+\.\d MB/.test(text("facts")), "facts");
    if (hasVolumes && !page.settings.volumes) press("v");
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
    if (location.hash === "#play") await checkPlaying();
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
