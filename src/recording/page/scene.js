// The scene: coordinates, camera, light, grid and scale bar. The world is moved to the origin and
// scaled to a radius of 1 in double precision, because the GPU computes in single precision.
const canvas = document.getElementById("scene");

// Converts a recorded pose (x, y, z, origin) to the numbers of a Matrix4.
function matrixOf(pose) {
  return [0, 1, 2, 3].flatMap((column) => [...pose.slice(3 * column, 3 * column + 3),
    column === 3 ? 1 : 0]);
}

// A sample of the run's points, in the world.
function samplePoints(unboundedToo) {
  const points = [], step = Math.max(1, Math.floor(run.frames.length / 16));
  for (let f = 0; f < run.frames.length; f += step)
    for (const [b, {absent, positions, pose}] of run.frames[f].bodies.entries()) {
      if (absent || (run.bodies[b].unbounded && !unboundedToo)) continue;
      const all = readPoints(positions, new Float32Array(3 * positions.count));
      const matrix = new THREE.Matrix4().fromArray(matrixOf(pose));
      const stride = 3 * Math.max(1, Math.floor(positions.count / 400));
      for (let i = 0; i < all.length; i += stride)
        points.push(new THREE.Vector3(...positions.low.map((at, k) => at + all[i + k]))
          .applyMatrix4(matrix));
    }
  return points;
}

// The transform from the world to the scene, and the sample points in the scene.
const world = (() => {
  const bounded = samplePoints(false), points = bounded.length ? bounded : samplePoints(true);
  const box = new THREE.Box3().setFromPoints(points);
  const radius = points.length && box.getSize(new THREE.Vector3()).length() / 2;
  const up = new THREE.Vector3(...run.up).normalize();
  const turn = new THREE.Quaternion().setFromUnitVectors(up, new THREE.Vector3(0, 1, 0));
  const middle = points.length ? box.getCenter(new THREE.Vector3()) : new THREE.Vector3();
  const scale = radius > 0 ? 1 / radius : 1;
  const matrix = new THREE.Matrix4().makeRotationFromQuaternion(turn)
    .multiply(new THREE.Matrix4().makeScale(scale, scale, scale))
    .multiply(new THREE.Matrix4().makeTranslation(-middle.x, -middle.y, -middle.z));
  return {matrix, scale, points: points.map((point) => point.applyMatrix4(matrix))};
})();

// Sets the transform of an object with coordinates in a body's frame, relative to `low`.
function placeInScene(object, pose, low) {
  object.matrixAutoUpdate = false;
  object.matrix.copy(world.matrix);
  if (pose) object.matrix.multiply(new THREE.Matrix4().fromArray(matrixOf(pose)));
  object.matrix.multiply(new THREE.Matrix4().makeTranslation(...low));
  object.matrixWorldNeedsUpdate = true;
}

function placeAs(object, other) {
  object.matrixAutoUpdate = false;
  object.matrix.copy(other.matrix);
  object.matrixWorldNeedsUpdate = true;
}

const scene = new THREE.Scene();
const camera = new THREE.PerspectiveCamera(32, 1, 0.01, 100);
scene.add(camera);
scene.add(new THREE.HemisphereLight(0xffffff, 0x8a8f99, 0.55));
const lamp = new THREE.DirectionalLight(0xffffff, 0.62);
lamp.position.set(-0.6, 0.9, 1);
camera.add(lamp, lamp.target);
lamp.target.position.set(0, 0, -1);

const renderer = (() => {
  try {
    return new THREE.WebGLRenderer({canvas, antialias: true, alpha: true});
  } catch (error) {
    sayFault("This browser shows no WebGL: the numbers and charts work, the scene does not.");
    return null;
  }
})();
canvas.addEventListener("webglcontextlost", () =>
  sayFault("The browser has taken back the memory of the scene. Close other pages, or load this one again."));
canvas.addEventListener("webglcontextrestored", () => {
  sayFault("");
  wantRender();
});

const beforeRender = [];  // functions called before each rendering, the first places the camera
let renderWanted = false;
let firstPictureMs = null;

function render() {
  renderWanted = false;
  fitCanvas();
  beforeRender.forEach((call) => call());
  if (!renderer) return;
  renderer.render(scene, camera);
  if (firstPictureMs === null) firstPictureMs = performance.now();
}

// Requests a rendering in the next animation frame.
function wantRender() {
  if (renderWanted) return;
  renderWanted = true;
  requestAnimationFrame(render);
}

// Gives the picture the pixels that the screen has where the page shows it.
function fitCanvas() {
  const {width, height} = canvas.getBoundingClientRect(), ratio = window.devicePixelRatio;
  const [wide, high] = [Math.round(width * ratio), Math.round(height * ratio)];
  if (wide === canvas.width && high === canvas.height) return;
  if (renderer) renderer.setSize(wide, high, false);
  camera.aspect = Math.max(wide, 1) / Math.max(high, 1);
  camera.updateProjectionMatrix();
}

// Calls a function when the page gives an element another size, or the screen other pixels. It draws
// at once: a canvas that waits for the next frame is stretched in this one.
function whenResized(element, call) {
  new ResizeObserver(call).observe(element);
  const watch = () => matchMedia(`(resolution: ${window.devicePixelRatio}dppx)`)
    .addEventListener("change", () => { watch(); call(); }, {once: true});
  watch();
}
whenResized(canvas, render);

// The size of a pixel at a point of the scene, in scene coordinates.
function pixelAt(point) {
  return camera.position.distanceTo(point) * 2 * Math.tan(camera.fov * Math.PI / 360) /
    Math.max(canvas.clientHeight, 1);
}

// Stores a value in the page's address, which is read when the page opens.
function saveInAddress(name, value) {
  const values = new URLSearchParams(location.hash.slice(1));
  values.set(name, value);
  try {
    history.replaceState(null, "", "#" + values.toString().replace(/%2C/g, ","));
  } catch (error) { /* an embedded page may have no address */ }
}

// The orbit control: turns, zooms and moves the view by mouse, pen or touch.
const orbit = (() => {
  const kStart = {turn: 0.62, tilt: 0.42, zoom: 1};
  const view = {};
  const target = new THREE.Vector3();
  const pointers = new Map();

  // The distance at which the sample points fill the image in the initial view direction.
  function fittingDistance() {
    const {turn, tilt} = kStart, high = Math.tan(camera.fov * Math.PI / 360);
    const out = new THREE.Vector3(Math.sin(turn) * Math.cos(tilt), Math.sin(tilt),
      Math.cos(turn) * Math.cos(tilt));
    const side = new THREE.Vector3(Math.cos(turn), 0, -Math.sin(turn)), up = out.clone().cross(side);
    const kMargin = 0.86;
    return world.points.reduce((most, point) => Math.max(most, point.dot(out) + Math.max(
      Math.abs(point.dot(up)) / high, Math.abs(point.dot(side)) / (high * camera.aspect)) / kMargin),
      0.1);
  }

  function placeCamera() {
    const {turn, tilt} = view, distance = view.zoom * fittingDistance();
    camera.position.set(Math.sin(turn) * Math.cos(tilt), Math.sin(tilt),
      Math.cos(turn) * Math.cos(tilt)).multiplyScalar(distance).add(target);
    camera.near = distance / 200;
    camera.far = distance + 50;
    camera.lookAt(target);
    camera.updateProjectionMatrix();
    camera.updateMatrixWorld();
  }

  function reset() {
    Object.assign(view, kStart);
    target.set(0, 0, 0);
    changed();
  }

  // Redraws a changed view, and stores it in the address after a pause, so that links include it.
  let saving = 0;
  function changed() {
    wantRender();
    clearTimeout(saving);
    saving = setTimeout(save, 250);
  }

  function save() {
    const numbers = [view.turn, view.tilt, view.zoom, ...target.toArray()];
    saveInAddress("view", numbers.map((number) => Number(number.toFixed(4))).join(","));
  }

  // Sets the view from its text in the address.
  function load(text) {
    const numbers = (text || "").split(",").map(Number);
    if (numbers.length !== 6 || !numbers.every(Number.isFinite) || !(numbers[2] > 0)) return;
    [view.turn, view.tilt, view.zoom] = numbers;
    target.fromArray(numbers, 3);
    wantRender();
  }

  function rotate(dx, dy) {
    view.turn -= 0.008 * dx;
    view.tilt = Math.min(Math.max(view.tilt + 0.008 * dy, -1.55), 1.55);
    changed();
  }

  function zoom(factor) {
    view.zoom = Math.min(Math.max(view.zoom * factor, 0.01), 10);
    changed();
  }

  function move(dx, dy) {
    const pixel = pixelAt(target);
    const side = new THREE.Vector3().setFromMatrixColumn(camera.matrix, 0);
    const up = new THREE.Vector3().setFromMatrixColumn(camera.matrix, 1);
    target.addScaledVector(side, -dx * pixel).addScaledVector(up, dy * pixel);
    changed();
  }

  // The midpoint of two touches, and their distance.
  function grip() {
    const [a, b] = [...pointers.values()];
    return {x: (a.x + b.x) / 2, y: (a.y + b.y) / 2, apart: Math.hypot(a.x - b.x, a.y - b.y) || 1};
  }

  canvas.addEventListener("pointerdown", (event) => {
    try {
      canvas.setPointerCapture(event.pointerId);
    } catch (error) { /* the pointer no longer exists */ }
    pointers.set(event.pointerId, {x: event.clientX, y: event.clientY});
  });
  canvas.addEventListener("pointermove", (event) => {
    const before = pointers.get(event.pointerId);
    if (!before) return;
    const dx = event.clientX - before.x, dy = event.clientY - before.y;
    const gripped = pointers.size === 2 ? grip() : null;
    pointers.set(event.pointerId, {x: event.clientX, y: event.clientY});
    if (gripped) {
      const now = grip();
      zoom(gripped.apart / now.apart);
      move(now.x - gripped.x, now.y - gripped.y);
    } else if (event.shiftKey || event.buttons & 2) {
      move(dx, dy);
    } else {
      rotate(dx, dy);
    }
  });
  for (const name of ["pointerup", "pointercancel"])
    canvas.addEventListener(name, (event) => pointers.delete(event.pointerId));
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    zoom(Math.exp(0.0012 * event.deltaY));
  }, {passive: false});
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener("dblclick", reset);
  beforeRender.push(placeCamera);
  Object.assign(view, kStart);
  return {reset, rotate, zoom, move, load, view, target};
})();

// A grid below the bodies, with squares of a round length.
const gridSquare = roundDown(0.2 / world.scale);
const grid = (() => {
  const side = gridSquare * world.scale, half = Math.ceil(1.3 / side);
  const made = new THREE.GridHelper(2 * half * side, 2 * half, 0xffffff, 0xffffff);
  made.position.y = world.points.reduce((low, {y}) => Math.min(low, y), 0) - 0.012;
  made.material.transparent = true;
  made.material.opacity = 0.45;
  made.material.depthWrite = false;
  scene.add(made);
  return made;
})();

// The scale bar: a round length at the centre of the view.
const scaleBar = {pixels: 0, text: ""};
beforeRender.push(() => {
  const pixel = pixelAt(orbit.target) / world.scale, kPixels = 120;
  const length = roundDown(kPixels * pixel);
  scaleBar.pixels = length / pixel;
  scaleBar.text = shown.round(length);
  const bar = document.getElementById("scale");
  bar.style.width = `${scaleBar.pixels}px`;
  bar.textContent = scaleBar.text;
  bar.setAttribute("aria-label", `Scale: the bar is ${scaleBar.text} long at the centre of the view`);
});
