// The player: shows frames, and handles the controls, keys and the page's address.
const bodies = run.bodies.map((body, index) => new BodyView(body, index));
const volumes = run.bodies.map((body, index) => new VolumeView(body, index));
const segments = new Segments(), contacts = new Contacts();
const labelViews = [...arrowLabels.map((label) => ["arrows", label]),
  ...segmentLabels.map((label) => ["segments", label])].map(([kind, label], i) =>
  new LabelView(kind, label, labelColours[i % labelColours.length]));
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
  segments.show(now.nearest || []);
  contacts.show(now.contacts);
  labelViews.forEach((view) => view.show(frameShown));
  showVolumes();
  showNumbers(frameShown);
  charts.forEach((chart) => chart.show(frameShown));
  element("scrubber").value = frameShown;
  element("scrubber").setAttribute("aria-valuetext", `Frame ${frameShown + 1} of ${run.frames.length}`);
  element("note").hidden = !now.note;
  element("note").textContent = now.note || "";
  element("frame-number").textContent = `${frameShown + 1} / ${run.frames.length}`;
  wantRender();
}

function showVolumes() {
  if (settings.volumes) {
    volumes.forEach((view) => view.show(frameShown, settings.depth));
    if (volumes.some((view) => view.refitted || view.others)) flashFrom = performance.now();
  }
  volumes.forEach((view, b) => view.setVisible(settings.volumes && bodies[b].mesh.visible));
  element("caption").textContent = captionOf(frameShown, bodies, volumes);
  wantRender();
}

// Highlights refitted volumes when their frame is shown, and fades them.
beforeRender.push(() => {
  const share = Math.max(0, 1 - (performance.now() - flashFrom) / kFlashMs);
  volumes.forEach((view) => view.setFlash(share));
  if (share > 0) wantRender();
});

// Places the text of the distance beside the first segment.
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

let timer = 0, due = 0;  // time of the next frame
function play() {
  if (run.frames.length < 2) return;
  if (frameShown === run.frames.length - 1) show(0);
  playing = true;
  due = performance.now();
  sayPlaying();
  waitForNext();
}

// Shows the next frame when it is due. Delays of more than a frame are not caught up.
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
  saveInAddress("frame", frameShown + 1);
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
    const view = bodies[b], triangles = document.createElement("small");
    triangles.textContent = shown.count(body.triangles);
    triangles.title = plural(body.triangles, "triangle");
    const colour = input({type: "color", value: bodyColours[b % bodyColours.length],
      id: `colour-${b}`}, `Colour of ${body.name}`, (value) => {
      view.setColour(value);
      wantRender();
    });
    const opacity = input({type: "range", className: "opacity", min: 0.05, max: 1, step: 0.05,
      value: view.material.opacity, id: `opacity-${b}`}, `Opacity of ${body.name}`, (value) => {
      view.setOpacity(Number(value));
      wantRender();
    });
    addSetting(`body-${b}`, body.name, true, (on) => {
      view.setVisible(on);
      showVolumes();
    }, {parent: "bodies", more: [triangles, colour, opacity]});
  });
  labelViews.forEach((view, i) =>
    addSetting(`label-${i}`, view.label, true, (on) => {
      view.wanted = on;
      show(frameShown);
    }, {more: [swatch(view.colour)]}));
  if (hasPatches)
    addSetting("patches", "coloured patches", true, (on) => {
      settings.patches = on;
      show(frameShown);
    });
  if (hasPatches || labelViews.length)
    addSetting("through", "what is behind surfaces, faintly", true, (on) => {
      settings.through = on;
      show(frameShown);
    });
  addSetting("edges", "edges", false, (on) => {
    settings.edges = on;
    bodies.forEach((view) => view.setEdges(on));
    wantRender();
  });
  addSetting("grid", `ground grid, squares of ${shown.round(gridSquare)}`, true, (on) => {
    grid.visible = on;
    wantRender();
  });
  if (hasVertexDistances) makeDistanceSetting();
  if (hasVolumes) makeVolumeSettings();
}

function makeDistanceSetting() {
  const legend = addLegend("distance-legend", "Distance of vertices", distanceRamp, "", "");
  const sayRange = () => legend.querySelectorAll(".ends span").forEach((span, i) => {
    span.textContent = shown.short(vertexDistanceRange[i], vertexDistanceRange[1]);
  });
  sayRange();
  addSetting("vertexDistances", "distance of vertices", true, (on) => {
    settings.vertexDistances = on;
    legend.hidden = !on;
    show(frameShown);
  });
  // The range of the colours. An empty field stands for the end of what was recorded.
  const fields = ["from", "to"].map((word, i) => input({type: "number", step: "any",
    id: `range-${word}`, value: shown.number(vertexDistanceRange[i]), className: "range"},
  `Colours ${word} this distance${run.unit && ", " + run.unit}`, (text) => {
    vertexDistanceRange[i] = text === "" ? distanceEnds[i] : Number(text);
    sayRange();
    bodies.forEach((view) => view.paintAgain());
    wantRender();
  }));
  const row = document.createElement("div");
  row.className = "row";
  row.append("colours from", fields[0], "to", fields[1], run.unit);
  element("show").append(row);
}

function makeVolumeSettings() {
  const legend = addLegend("inflation-legend", "Inflation, of the volume's size", inflationRamp,
    "0", "", refittedKey());
  legend.hidden = true;
  addSetting("volumes", "bounding volumes", false, (on) => {
    settings.volumes = on;
    legend.hidden = !on;
    showVolumes();
  });
  const row = document.createElement("label"), slider = document.createElement("input");
  row.className = "row";
  const number = Object.assign(document.createElement("small"), {id: "depth-number"});
  Object.assign(slider, {type: "range", id: "depth", min: 0, max: deepest(), step: 1});
  slider.addEventListener("input", () => setDepth(Number(slider.value)));
  row.append("depth", slider, number);
  element("show").append(row);
}

// [names of keys, their function, whether it applies to this run]
const keyList = [
  ["Space", "play, pause", true], ["← →", "step", true], ["Home End", "first, last frame", true],
  ["Shift+← → ↑ ↓", "turn the view", true], ["Z X", "zoom in, out", true],
  ["R", "reset the view", true], ["E", "edges", true], ["G", "ground grid", true],
  ["C", "distance of vertices", hasVertexDistances], ["V", "volumes", hasVolumes],
  ["+ −", "their depth", hasVolumes],
];
const keys = {
  " ": () => (playing ? pause() : play()), "ArrowRight": () => step(1), "ArrowLeft": () => step(-1),
  "Home": () => step(-run.frames.length), "End": () => step(run.frames.length),
  "v": () => toggle("volumes"), "e": () => toggle("edges"), "c": () => toggle("vertexDistances"),
  "g": () => toggle("grid"), "+": () => setDepth(settings.depth + 1),
  "=": () => setDepth(settings.depth + 1), "-": () => setDepth(settings.depth - 1),
  "r": () => orbit.reset(), "z": () => orbit.zoom(1 / 1.2), "x": () => orbit.zoom(1.2),
  "Shift+ArrowLeft": () => orbit.rotate(-20, 0), "Shift+ArrowRight": () => orbit.rotate(20, 0),
  "Shift+ArrowUp": () => orbit.rotate(0, 20), "Shift+ArrowDown": () => orbit.rotate(0, -20),
};

function sayKeys() {
  keyList.filter(([, , has]) => has).forEach(([names, work], i) => {
    if (i > 0) element("key-list").append(" · ");
    for (const name of names.split(" "))
      element("key-list").append(Object.assign(document.createElement("kbd"), {textContent: name}), " ");
    element("key-list").append(work);
  });
}

function listen() {
  element("scrubber").max = run.frames.length - 1;
  element("scrubber").addEventListener("input", () => step(Number(element("scrubber").value) - frameShown));
  for (const [id, work] of Object.entries({first: keys.Home, back: keys.ArrowLeft,
    play: keys[" "], next: keys.ArrowRight, last: keys.End}))
    element(id).addEventListener("click", work);
  document.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    const name = event.key.length === 1 ? event.key.toLowerCase() : event.key;
    const key = event.shiftKey && name.startsWith("Arrow") ? `Shift+${name}` : name;
    const within = (tags) => event.target.closest && event.target.closest(tags);
    if (!keys[key] || within("input[type=number], input[type=search]")) return;
    if (within("input, button, summary") &&
        (key === " " || (event.target.type === "range" && name.length > 1)))
      return;
    event.preventDefault();
    keys[key]();
  });
  window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", setColours);
  element("save-picture").addEventListener("click", savePicture);
  element("save-video").addEventListener("click", saveVideo);
  window.addEventListener("hashchange", readAddress);
}

function setColours() {
  segments.setColour(css("--nearest"));
  grid.material.color.set(css("--grid"));
  contacts.setColour(css("--contact"));
  charts.forEach((chart) => chart.draw());
  wantRender();
}

// Applies the values of the page's address, such as run.html#frame=20&depth=4&view=...
function readAddress() {
  const wanted = new URLSearchParams(location.hash.slice(1));
  if (wanted.has("depth")) setDepth(Number(wanted.get("depth")) || 0);
  orbit.load(wanted.get("view"));
  show((Number(wanted.get("frame")) || frameShown + 1) - 1);
}

sayFacts();
makeSettings();
sayKeys();
listen();
setColours();
setDepth(Math.min(3, deepest()));
readAddress();
sayPlaying();
render();

// For tests and for scripts that control the page.
window.adaptiveBvhPage = {
  run, settings, show, play, pause, setDepth, orbit, render, shown, composeView, filmFrames,
  labelViews, seriesLabels, scaleBar, bodies,
  get frame() { return frameShown; },
  get playing() { return playing; },
  get firstPictureMs() { return firstPictureMs; },
  // Positions of a body as drawn, relative to the lowest corner of its box.
  positions: (body) => bodies[body].positions,
  // Numbers of a body's volumes at the depth shown.
  volumes: (body) => ({count: volumes[body].count, refitted: volumes[body].refitted,
    others: volumes[body].others}),
  // The rendered image: rows from bottom to top, four bytes per pixel.
  pixels() {
    render();
    const gl = renderer.getContext(), {width, height} = canvas;
    const pixels = new Uint8Array(4 * width * height);
    gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
    return {width, height, pixels};
  },
};
