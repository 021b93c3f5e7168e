// The recorded run: JSON, and arrays of numbers in base64.
const run = JSON.parse(document.getElementById("run").textContent);
const pageBytes = [...document.scripts].reduce((all, {text}) => all + text.length, 0);
const kSteps = 65535;  // quantization steps of a coordinate, over the side of the bounding box
const kVolumeNumbers = 16;

function decodeBase64(text) {
  const characters = atob(text);
  const bytes = new Uint8Array(characters.length);
  for (let i = 0; i < bytes.length; ++i) bytes[i] = characters.charCodeAt(i);
  return bytes.buffer;
}

const data = decodeBase64(document.getElementById("data").textContent);
document.getElementById("data").remove();

// Fills in what a frame omits: values of the previous frame. A missing body is marked as absent.
run.frames.forEach((frame, f) => {
  frame.bodies = run.bodies.map((_, b) => {
    const body = frame.bodies[b], before = f > 0 ? run.frames[f - 1].bodies[b] : {};
    if (!body) return {absent: true, volumes: [0, 0]};
    body.positions = body.positions || before.positions;
    body.pose = body.pose || before.pose;
    return body;
  });
});

// Reads the points of a block into `out`, relative to the lowest corner of their box (block.low).
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

// The points of a block in the world, in double precision.
function readWorldPoints(block) {
  const points = readPoints(block, new Float64Array(3 * block.count));
  return Array.from({length: block.count}, (_, i) => new THREE.Vector3(points[3 * i] + block.low[0],
    points[3 * i + 1] + block.low[1], points[3 * i + 2] + block.low[2]));
}

// The indices of the coloured triangles, followed by the patch of each.
function readPatches(block) {
  return new Uint32Array(data, block.at, 2 * block.count);
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

// The recorded volumes of a body in a frame, in the layout of VolumeRecord (body.h).
function readVolumes(frame, body) {
  const [at, count] = run.frames[frame].bodies[body].volumes;
  return new Float32Array(data, at, kVolumeNumbers * count);
}
const volumeField = {corner: 0, axis: 3, side: 9, radius: 11, inflation: 12, depth: 13, leaf: 14,
  refitted: 15};

// The totals of a frame's updates, over bodies with volumes; undefined if there are none.
function updateOf(frame) {
  const updates = run.frames[frame].bodies.map((body) => body.update)
    .filter((update) => update && update.nodes > 0);
  if (updates.length === 0) return undefined;
  const sum = (name) => updates.reduce((all, update) => all + update[name], 0);
  return {nodes: sum("nodes"), refitted: sum("refitted")};
}

// The smallest distance of a vertex of all bodies in a frame; undefined if none was recorded.
function leastVertexDistance(frame) {
  const found = run.frames[frame].bodies.filter((body) => body.vertexDistances);
  return found.length ? Math.min(...found.map((body) => body.vertexDistances.low)) : undefined;
}

function extremes(list) {
  let low = Infinity, high = -Infinity;
  for (const value of list) {
    if (value < low) low = value;
    if (value > high) high = value;
  }
  return [low, high];
}

// The position of each frame on the charts' axis: its time if times increase, else its number.
const axis = (() => {
  const times = run.frames.map(({time}) => time);
  const isTime = times.every((time, i) => time !== undefined && (i === 0 || time > times[i - 1]));
  const at = isTime ? times : times.map((_, i) => i + 1);
  return {at, isTime, low: at[0], high: at[at.length - 1]};
})();

// A number as text, with three significant digits.
function number(value) {
  const rounded = Number(value.toPrecision(3));
  if (rounded === 0) return "0";
  const exponent = Math.floor(Math.log10(Math.abs(rounded)));
  return exponent < -5 || exponent > 5 ? rounded.toExponential(2)
    : rounded.toFixed(Math.max(0, 2 - exponent));
}

// A length as text. A metric length has a unit in which it is at least 1; those below a thousandth of
// a nanometre, and others, keep their unit.
const metres = {km: 1e3, m: 1, dm: 0.1, cm: 1e-2, mm: 1e-3, "µm": 1e-6, um: 1e-6, nm: 1e-9}[run.unit];
function length(value) {
  const size = Number(Math.abs(value * metres).toPrecision(3));
  if (!(size >= 1e-12)) return number(value) + (run.unit ? " " + run.unit : "");
  const [unit, factor] = [["km", 1e3], ["m", 1], ["mm", 1e-3], ["µm", 1e-6]]
    .find(([, least]) => size >= least) || ["nm", 1e-9];
  return `${number(value * metres / factor)} ${unit}`;
}

// The largest number of the sequence 1, 2, 5, 10, ... (times a power of ten) that is not larger.
function roundDown(value) {
  const power = 10 ** Math.floor(Math.log10(value));
  return power * [5, 2, 1].find((factor) => factor * power <= value * (1 + 1e-9));
}

const shown = {
  number,
  length,
  // A length, without trailing zeros.
  round: (value) => length(value).replace(/(\.\d*?)0+(?= |$)/, "$1").replace(/\.(?= |$)/, ""),
  // A length of a range up to `largest`: 0 if it is negligible.
  short: (value, largest) => length(Math.abs(value) < 1e-4 * largest ? 0 : value),
  time: (value) => number(value) + " ms",
  count: (value) => value.toLocaleString("en"),
  // A time of the run.
  moment: (value) => number(value) + (run.timeUnit ? " " + run.timeUnit : ""),
  megabytes: (value) => (value / 1e6).toFixed(1) + " MB",
};
