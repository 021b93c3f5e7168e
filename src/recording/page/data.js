// The run as it was recorded: JSON, and arrays of numbers in base64 beside it.
const run = JSON.parse(document.getElementById("run").textContent);
const pageBytes = [...document.scripts].reduce((all, {text}) => all + text.length, 0);
const kSteps = 65535;  // of a coordinate, along its side of the box
const kVolumeNumbers = 16;

function decodeBase64(text) {
  const characters = atob(text);
  const bytes = new Uint8Array(characters.length);
  for (let i = 0; i < bytes.length; ++i) bytes[i] = characters.charCodeAt(i);
  return bytes.buffer;
}

const data = decodeBase64(document.getElementById("data").textContent);
document.getElementById("data").remove();

// What a frame leaves out is as in the frame before.
run.frames.forEach((frame, f) => frame.bodies.forEach((body, b) => {
  const before = f > 0 ? run.frames[f - 1].bodies[b] : {};
  body.positions = body.positions || before.positions;
  body.pose = body.pose || before.pose;
}));

// The points of a block, seen from the corner `low` of their box.
function readPoints(block, out) {
  const steps = new Uint16Array(data, block.at, 3 * block.count);
  const [x, y, z] = block.size.map((side) => side / kSteps);
  for (let i = 0; i < steps.length; i += 3) {
    out[i] = steps[i] * x;
    out[i + 1] = steps[i + 1] * y;
    out[i + 2] = steps[i + 2] * z;
  }
  return out;
}

function readValues(block, count) {
  const steps = new Uint16Array(data, block.at, count);
  const unit = (block.high - block.low) / kSteps;
  return Float32Array.from(steps, (n) => block.low + n * unit);
}

function readTriangles(body) {
  const Numbers = body.indexBits === 16 ? Uint16Array : Uint32Array;
  return new Numbers(data, body.indices, 3 * body.triangles);
}

// The recorded volumes of a body in a frame, as they lie in memory (VolumeRecord in body.h).
function readVolumes(frame, body) {
  const [at, count] = run.frames[frame].bodies[body].volumes;
  return new Float32Array(data, at, kVolumeNumbers * count);
}
const volumeField = {corner: 0, axis: 3, side: 9, radius: 11, inflation: 12, depth: 13, leaf: 14,
  refitted: 15};

// Of a frame: sums over the bodies with volumes that were updated in it; undefined without any.
function updateOf(frame) {
  const updates = run.frames[frame].bodies.map((body) => body.update)
    .filter((update) => update && update.nodes > 0);
  if (updates.length === 0) return undefined;
  const sum = (name) => updates.reduce((all, update) => all + update[name], 0);
  return {nodes: sum("nodes"), refitted: sum("refitted"), inflated: sum("inflated"),
    displacement: Math.max(...updates.map((update) => update.displacement))};
}

// The smallest clearance of any body in a frame; undefined without any.
function leastClearance(frame) {
  const found = run.frames[frame].bodies.filter((body) => body.clearance);
  return found.length ? Math.min(...found.map((body) => body.clearance.low)) : undefined;
}

function extremes(list) {
  let low = Infinity, high = -Infinity;
  for (const value of list) {
    if (value < low) low = value;
    if (value > high) high = value;
  }
  return [low, high];
}

const shown = {
  length: (value) => value.toPrecision(6) + (run.unit ? " " + run.unit : ""),
  // Beside a larger length.
  short: (value, largest) => (Math.abs(value) < 1e-4 * largest ? "0" : value.toPrecision(3)) +
    (run.unit ? " " + run.unit : ""),
  time: (value) => value.toPrecision(3) + " ms",
  count: (value) => value.toLocaleString("en"),
  megabytes: (value) => (value / 1e6).toFixed(1) + " MB",
};
