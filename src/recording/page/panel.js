// The panel beside the scene: numbers, charts, settings and texts.
const element = (id) => document.getElementById(id);
const hasPatches = run.frames.some((frame) => frame.bodies.some((body) => body.patches));
const settings = {volumes: false, depth: 0, edges: false, vertexDistances: hasVertexDistances, patches: true,
  through: true};

const columns = {
  distance: run.frames.map((frame) => frame.distance),
  updateMs: run.frames.map((frame) => frame.updateMs),
  queryMs: run.frames.map((frame) => frame.queryMs),
  contacts: run.frames.map((frame) => frame.contactCount),
  vertexDistance: run.frames.map((_, frame) => leastVertexDistance(frame)),
  time: run.frames.map((frame) => frame.time),
  update: run.frames.map((_, frame) => updateOf(frame)),
};
const isRecorded = (name) => columns[name].some((value) => value !== undefined);

// The rows of the table of recorded numbers: [id, label, colour of the line, text(frame)].
const rows = [
  ["distance", "Distance", "--distance", (f) => shown.length(columns.distance[f])],
  ["vertexDistance", "Least distance of a vertex", null, (f) => shown.length(columns.vertexDistance[f])],
  ["contacts", "Contacts", null, (f) => shown.count(columns.contacts[f])],
  ["updateMs", "Update", "--update", (f) => shown.time(columns.updateMs[f])],
  ["queryMs", "Query", "--query", (f) => shown.time(columns.queryMs[f])],
  ["update", "Volumes refitted", null, (f) =>
    `${shown.count(columns.update[f].refitted)} of ${shown.count(columns.update[f].nodes)}`],
].filter(([id]) => isRecorded(id));
arrowLabels.forEach((label, i) => {
  columns[`arrows-${i}`] = arrowLengths[i].map(({count, longest}) => (count ? longest : undefined));
  rows.push([`arrows-${i}`, `Longest ${label}`, null, (f) => shown.number(columns[`arrows-${i}`][f])]);
});

// The run's own series: their labels, in the order of their first use.
const seriesLabels = [...new Set(run.frames.flatMap((frame) => Object.keys(frame.series || {})))];
seriesLabels.forEach((label, i) => {
  columns[`series-${i}`] = run.frames.map((frame) => (frame.series || {})[label]);
  rows.push([`series-${i}`, label, null, (f) => shown.number(columns[`series-${i}`][f])]);
});
if (run.frames.some((frame) => frame.time !== undefined))
  rows.unshift(["time", "Time", null, (f) => shown.moment(columns.time[f])]);

for (const [id, label, colour] of rows) {
  const term = document.createElement("dt"), value = document.createElement("dd");
  if (colour) {
    const key = document.createElement("span");
    key.className = "key";
    key.style.background = `var(${colour})`;
    term.append(key);
  }
  term.append(label);
  value.id = `value-${id}`;
  element("numbers").append(term, value);
}

function showNumbers(frame) {
  for (const [id, , , text] of rows)
    element(`value-${id}`).textContent = columns[id][frame] === undefined ? "–" : text(frame);
}

function makeCharts(pick) {
  const charts = [];
  const lines = (...list) => list.filter(({name}) => isRecorded(name))
    .map(({name, colour}) => ({name, colour, values: columns[name]}));
  const add = (title, series, format) => {
    if (series.length && run.frames.length > 1) charts.push(new Chart(title, series, format, pick));
  };
  add("Distance", lines({name: "distance", colour: "--distance"}),
    shown.length);
  if (!isRecorded("distance")) {
    add("Least distance of a vertex", lines({name: "vertexDistance", colour: "--distance"}),
      shown.length);
  }
  add("Contacts", lines({name: "contacts", colour: "--contact"}), shown.count);
  add("Duration", lines({name: "updateMs", colour: "--update"},
    {name: "queryMs", colour: "--query"}), shown.time);
  seriesLabels.forEach((label, i) =>
    add(label, lines({name: `series-${i}`, colour: "--distance"}), shown.number));
  return charts;
}

// Adds a row of the settings, with a checkbox, a label and more elements; returns the checkbox.
function addSetting(id, label, on, change, {parent = "show", more = []} = {}) {
  const row = document.createElement("div"), box = document.createElement("input");
  const name = document.createElement("span"), words = document.createElement("label");
  row.className = "row";
  box.type = "checkbox";
  box.id = id;
  box.checked = on;
  box.addEventListener("change", () => change(box.checked));
  name.className = "name";
  name.textContent = name.title = label;
  words.append(box, name);
  row.append(words, ...more);
  element(parent).append(row);
  return box;
}

// Makes an input element that calls change(value).
function input(properties, label, change) {
  const made = Object.assign(document.createElement("input"), properties);
  made.setAttribute("aria-label", label);
  made.title = label;
  made.addEventListener("input", () => change(made.value));
  return made;
}

function swatch(colour) {
  const square = document.createElement("span");
  square.className = "swatch";
  square.style.background = colour;
  return square;
}

function addLegend(id, title, scale, low, high, extra) {
  const legend = document.createElement("div");
  legend.className = "legend";
  legend.id = id;
  legend.innerHTML = "<div class=\"title\"></div><div class=\"ramp\"></div>" +
    "<div class=\"ends\"><span></span><span></span></div>";
  legend.querySelector(".title").textContent = title;
  legend.querySelector(".ramp").style.background = scale.css;
  const ends = legend.querySelectorAll(".ends span");
  [ends[0].textContent, ends[1].textContent] = [low, high];
  if (extra) legend.append(extra);
  element("legends").append(legend);
  return legend;
}

function refittedKey() {
  const key = document.createElement("div"), dot = document.createElement("span");
  dot.className = "dot";
  dot.style.background = kRefitted;
  key.append(dot, "refitted in this frame");
  return key;
}

// Joins names: "a", "a and b", "a, b and c".
function listed(names) {
  return names.length < 2 ? names.join("") : `${names.slice(0, -1).join(", ")} and ${names[names.length - 1]}`;
}

function plural(count, one, many) {
  return `${shown.count(count)} ${count === 1 ? one : many || one + "s"}`;
}

// A caption: what the view shows, in words.
function captionOf(frame, bodies, volumes) {
  const now = run.frames[frame], visible = run.bodies.filter((_, b) => bodies[b].mesh.visible);
  const said = [];
  const names = visible.length > 6 ? plural(visible.length, "body", "bodies")
    : listed(visible.map(({name}) => name));
  said.push(names ? `Frame ${frame + 1}: ${names}.` : `Frame ${frame + 1}.`);
  if (now.nearest) said.push(`The ${now.nearest.length > 1 ? "segments join" : "segment joins"} the nearest points.`);
  if (now.contacts) said.push(`Points mark ${plural(now.contacts.count, "contact")}.`);
  for (const {kind, label, wanted, drawn} of labelViews)
    if (wanted && drawn) said.push(`${kind === "arrows" ? "Arrows" : "Segments"}: ${drawn} of “${label}”.`);
  if (settings.patches && now.bodies.some((body) => body.patches?.count))
    said.push("Patches of the surface are in strong colours.");
  if (settings.vertexDistances && now.bodies.some((body) => body.vertexDistances))
    said.push("Colours on the surface: the distance of each vertex to the other body.");
  if (settings.volumes) {
    const count = volumes.reduce((all, view) => all + (view.count || 0), 0);
    const green = volumes.reduce((all, view) => all + (view.refitted || 0) + (view.others || 0), 0);
    const update = columns.update[frame], refitted = update ? update.refitted : 0;
    said.push(`${plural(count, "bounding volume")} at depth ${settings.depth}, coloured by inflation.`);
    if (refitted) said.push(`In green, from any depth, ${green < refitted
      ? `${shown.count(green)} of the ${shown.count(refitted)} volumes` :
      plural(refitted, "volume")} refitted in this frame.`);
  }
  return said.join(" ");
}

function sayFacts() {
  const triangles = run.bodies.reduce((all, body) => all + body.triangles, 0);
  element("summary").textContent = [plural(run.bodies.length, "body", "bodies"),
    plural(triangles, "triangle"), plural(run.frames.length, "frame")].join(" · ");
  element("facts").textContent = `Positions are kept in 16 bits of the box around each body: ` +
    `off by at most half of box / 65,535. Numbers are as they were computed. This page: ` +
    `${shown.megabytes(pageBytes)}, of which ${shown.megabytes(4 / 3 * run.dataBytes)} are the run. ` +
    `adaptive_bvh (BSD-3-Clause), three.js (MIT).`;
}
