// The player: which frame is shown, and what the user does about it.
const bodies = run.bodies.map((body, index) => new BodyView(body, index));
const volumes = run.bodies.map((body, index) => new VolumeView(body, index));
const segments = new Segments(), contacts = new Contacts();
const hasVolumes = run.frames.some((frame) => frame.bodies.some((body) => body.volumes[1] > 0));
const kFlashMs = 550;
let frameShown = 0, playing = false, flashFrom = -Infinity;
const charts = makeCharts((frame) => { pause(); show(frame); });

function deepest() {
  return Math.max(run.volumeDepth, 0);
}

function show(frame) {
  frameShown = Math.min(Math.max(frame, 0), run.frames.length - 1);
  const now = run.frames[frameShown];
  bodies.forEach((view) => view.show(frameShown));
  showVolumes();
  segments.show(now.nearest || []);
  contacts.show(now.contacts);
  showNumbers(frameShown);
  charts.forEach((chart) => chart.show(frameShown));
  element("scrubber").value = frameShown;
  element("frame-number").textContent = `${frameShown + 1} / ${run.frames.length}`;
  wantRender();
}

function showVolumes() {
  volumes.forEach((view, b) => view.setVisible(settings.volumes && bodies[b].mesh.visible));
  if (settings.volumes) {
    volumes.forEach((view) => view.show(frameShown, settings.depth));
    if (volumes.some((view) => view.refitted || view.others)) flashFrom = performance.now();
  }
  element("caption").textContent = captionOf(frameShown, bodies, volumes);
  wantRender();
}

// Refitted volumes light up when their frame comes, and fade.
beforeRender.push(() => {
  const share = Math.max(0, 1 - (performance.now() - flashFrom) / kFlashMs);
  volumes.forEach((view) => view.setFlash(share));
  if (share > 0) wantRender();
});

// The distance, beside the first segment.
beforeRender.push(() => {
  const tag = element("tag"), pair = segments.shown[0];
  const text = columns.distance[frameShown];
  tag.hidden = !pair || text === undefined;
  if (tag.hidden) return;
  const at = pair[0].clone().lerp(pair[1], 0.5).project(camera);
  tag.textContent = shown.length(text);
  const {clientWidth: width, clientHeight: height} = canvas;
  const x = Math.min(Math.max((at.x + 1) / 2 * width + 14, 4), width - tag.offsetWidth - 4);
  const y = Math.min(Math.max((1 - at.y) / 2 * height - 11, 4), height - tag.offsetHeight - 4);
  tag.style.transform = `translate(${Math.round(x)}px, ${Math.round(y)}px)`;
});

let timer = 0, due = 0;  // when the next frame is
function play() {
  if (run.frames.length < 2) return;
  if (frameShown === run.frames.length - 1) show(0);
  playing = true;
  due = performance.now();
  sayPlaying();
  waitForNext();
}

// A frame that comes late does not make the next ones hurry.
function waitForNext() {
  due = Math.max(due + 1000 / run.framesPerSecond, performance.now());
  timer = setTimeout(() => {
    show(frameShown === run.frames.length - 1 ? 0 : frameShown + 1);
    waitForNext();
  }, due - performance.now());
}

function pause() {
  playing = false;
  clearTimeout(timer);
  sayPlaying();
}

function sayPlaying() {
  element("play").setAttribute("aria-pressed", playing);
  element("play").setAttribute("aria-label", playing ? "Pause" : "Play");
  element("caption").setAttribute("aria-live", playing ? "off" : "polite");
}

function step(frames) {
  pause();
  show(frameShown + frames);
}

function setDepth(depth) {
  settings.depth = Math.min(Math.max(depth, 0), deepest());
  if (element("depth")) element("depth").value = settings.depth;
  if (element("depth-number")) element("depth-number").textContent = settings.depth;
  if (element("inflation-legend"))
    element("inflation-legend").querySelector(".ends span:last-child").textContent =
      largestInflation(settings.depth).toPrecision(2);
  showVolumes();
}

function toggle(id) {
  if (element(id)) element(id).click();
}

function makeSettings() {
  run.bodies.forEach((body, b) => {
    const box = addSetting(`body-${b}`, body.name, true, (on) => {
      bodies[b].setVisible(on);
      showVolumes();
    }, Object.assign(document.createElement("small"), {textContent: plural(body.triangles, "triangle")}));
    box.after(swatch(bodyColours[b % bodyColours.length]));
  });
  addSetting("edges", "edges", false, (on) => {
    settings.edges = on;
    bodies.forEach((view) => view.setEdges(on));
    wantRender();
  });
  if (hasClearance) makeClearanceSetting();
  if (hasVolumes) makeVolumeSettings();
}

function makeClearanceSetting() {
  const legend = addLegend("clearance-legend", "Clearance", clearanceRamp,
    ...clearanceEnds.map((value) => shown.short(value, clearanceEnds[1])));
  addSetting("clearance", "clearance", true, (on) => {
    settings.clearance = on;
    legend.hidden = !on;
    show(frameShown);
  });
}

function makeVolumeSettings() {
  const legend = addLegend("inflation-legend", "Inflation, of the volume's size", inflationRamp,
    "0", "", refittedKey());
  settings.volumes = !hasClearance;
  legend.hidden = !settings.volumes;
  addSetting("volumes", "bounding volumes", settings.volumes, (on) => {
    settings.volumes = on;
    legend.hidden = !on;
    showVolumes();
  });
  const row = document.createElement("label"), slider = document.createElement("input");
  const number = Object.assign(document.createElement("small"), {id: "depth-number"});
  Object.assign(slider, {type: "range", id: "depth", min: 0, max: deepest(), step: 1});
  slider.addEventListener("input", () => setDepth(Number(slider.value)));
  row.append("depth", slider, number);
  element("show").append(row);
}

const keys = {
  " ": () => (playing ? pause() : play()), "ArrowRight": () => step(1), "ArrowLeft": () => step(-1),
  "Home": () => step(-run.frames.length), "End": () => step(run.frames.length),
  "v": () => toggle("volumes"), "e": () => toggle("edges"), "c": () => toggle("clearance"),
  "+": () => setDepth(settings.depth + 1), "=": () => setDepth(settings.depth + 1),
  "-": () => setDepth(settings.depth - 1), "r": () => orbit.reset(),
};

function listen() {
  element("scrubber").max = run.frames.length - 1;
  element("scrubber").addEventListener("input", () => step(Number(element("scrubber").value) - frameShown));
  for (const [id, work] of Object.entries({first: keys.Home, back: keys.ArrowLeft,
    play: keys[" "], next: keys.ArrowRight, last: keys.End}))
    element(id).addEventListener("click", work);
  document.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    const key = event.key.length === 1 ? event.key.toLowerCase() : event.key;
    const onControl = event.target.closest && event.target.closest("input, button, summary");
    if (!keys[key] || (onControl && (key === " " || (event.target.type === "range" && key.length > 1))))
      return;
    event.preventDefault();
    keys[key]();
  });
  window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", setColours);
  window.addEventListener("resize", () => charts.forEach((chart) => chart.draw()));
}

function setColours() {
  segments.setColour(css("--nearest"));
  contacts.setColour(css("--contact"));
  charts.forEach((chart) => chart.draw());
  wantRender();
}

sayFacts();
makeSettings();
listen();
setColours();
fitCanvas();
// run.html#frame=20&depth=4 opens the page there.
const wanted = new URLSearchParams(location.hash.slice(1));
setDepth(wanted.has("depth") ? Number(wanted.get("depth")) || 0 : Math.min(3, deepest()));
show((Number(wanted.get("frame")) || 1) - 1);
sayPlaying();
render();

// For tests, and for those who want to steer the page by a script.
window.adaptiveBvhPage = {
  run, settings, show, play, pause, setDepth, orbit, render,
  get frame() { return frameShown; },
  get playing() { return playing; },
  get firstPictureMs() { return firstPictureMs; },
  // Positions of a body as they are drawn, less `low` of its box.
  positions: (body) => bodies[body].positions,
  // Of a body, at the depth shown.
  volumes: (body) => ({count: volumes[body].count, refitted: volumes[body].refitted,
    others: volumes[body].others}),
  // The picture: rows from the bottom, four bytes a pixel.
  pixels() {
    render();
    const gl = renderer.getContext(), {width, height} = canvas;
    const pixels = new Uint8Array(4 * width * height);
    gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
    return {width, height, pixels};
  },
};
