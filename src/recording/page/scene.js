// The scene: camera, light, and the frame of reference. All is scaled to a size of about one and
// moved to the origin, in double precision, before the graphics card computes in single precision.
const canvas = document.getElementById("scene");

// A recorded pose (x, y, z, origin) as the numbers of a Matrix4.
function matrixOf(pose) {
  return [0, 1, 2, 3].flatMap((column) => [...pose.slice(3 * column, 3 * column + 3),
    column === 3 ? 1 : 0]);
}

// Some of the points that are seen in the run, in the world.
function samplePoints() {
  const points = [], step = Math.max(1, Math.floor(run.frames.length / 16));
  for (let f = 0; f < run.frames.length; f += step)
    for (const {positions, pose} of run.frames[f].bodies) {
      const all = readPoints(positions, new Float32Array(3 * positions.count));
      const matrix = new THREE.Matrix4().fromArray(matrixOf(pose));
      const stride = 3 * Math.max(1, Math.floor(positions.count / 400));
      for (let i = 0; i < all.length; i += stride)
        points.push(new THREE.Vector3(...positions.low.map((at, k) => at + all[i + k]))
          .applyMatrix4(matrix));
    }
  return points;
}

const world = (() => {
  const points = samplePoints(), box = new THREE.Box3().setFromPoints(points);
  const radius = box.getSize(new THREE.Vector3()).length() / 2;
  const up = new THREE.Vector3(...run.up).normalize();
  const turn = new THREE.Quaternion().setFromUnitVectors(up, new THREE.Vector3(0, 1, 0));
  const middle = box.getCenter(new THREE.Vector3());
  const scale = radius > 0 ? 1 / radius : 1;
  const matrix = new THREE.Matrix4().makeRotationFromQuaternion(turn)
    .multiply(new THREE.Matrix4().makeScale(scale, scale, scale))
    .multiply(new THREE.Matrix4().makeTranslation(-middle.x, -middle.y, -middle.z));
  return {matrix, scale, points: points.map((point) => point.applyMatrix4(matrix))};
})();

// Where something lies in the scene that is given in a body's frame, seen from `low`.
function placeInScene(object, pose, low) {
  object.matrixAutoUpdate = false;
  object.matrix.copy(world.matrix);
  if (pose) object.matrix.multiply(new THREE.Matrix4().fromArray(matrixOf(pose)));
  object.matrix.multiply(new THREE.Matrix4().makeTranslation(...low));
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
    const message = document.getElementById("message");
    message.textContent = "This browser shows no WebGL: the numbers and charts work, the scene does not.";
    message.hidden = false;
    return null;
  }
})();

const beforeRender = [];  // called with the camera in place
let renderWanted = false;
let firstPictureMs = null;

function render() {
  renderWanted = false;
  beforeRender.forEach((call) => call());
  if (!renderer) return;
  renderer.render(scene, camera);
  if (firstPictureMs === null) firstPictureMs = performance.now();
}

function wantRender() {
  if (renderWanted) return;
  renderWanted = true;
  requestAnimationFrame(render);
}

function fitCanvas() {
  const {clientWidth: width, clientHeight: height} = canvas.parentElement;
  if (renderer) {
    renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
    renderer.setSize(width, height, false);
  }
  camera.aspect = width / Math.max(height, 1);
  camera.updateProjectionMatrix();
  wantRender();
}
window.addEventListener("resize", fitCanvas);
