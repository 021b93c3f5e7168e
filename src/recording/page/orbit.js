// Looking around: turn, zoom and move the view by mouse, pen or fingers.
const orbit = (() => {
  const kStart = {turn: 0.62, tilt: 0.42, zoom: 1};
  const view = {};
  const target = new THREE.Vector3();
  const pointers = new Map();

  // From where the sample points, seen in the first direction, fill the picture.
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

  function place() {
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
    wantRender();
  }

  function rotate(dx, dy) {
    view.turn -= 0.008 * dx;
    view.tilt = Math.min(Math.max(view.tilt + 0.008 * dy, -1.55), 1.55);
    wantRender();
  }

  function zoom(factor) {
    view.zoom = Math.min(Math.max(view.zoom * factor, 0.01), 10);
    wantRender();
  }

  function move(dx, dy) {
    const pixel = camera.position.distanceTo(target) * 2 * Math.tan(camera.fov * Math.PI / 360) /
      Math.max(canvas.clientHeight, 1);
    const side = new THREE.Vector3().setFromMatrixColumn(camera.matrix, 0);
    const up = new THREE.Vector3().setFromMatrixColumn(camera.matrix, 1);
    target.addScaledVector(side, -dx * pixel).addScaledVector(up, dy * pixel);
    wantRender();
  }

  // Middle of the fingers, and how far they are apart.
  function grip() {
    const [a, b] = [...pointers.values()];
    return {x: (a.x + b.x) / 2, y: (a.y + b.y) / 2, apart: Math.hypot(a.x - b.x, a.y - b.y) || 1};
  }

  canvas.addEventListener("pointerdown", (event) => {
    try {
      canvas.setPointerCapture(event.pointerId);
    } catch (error) { /* a pointer that is gone already */ }
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
  beforeRender.push(place);
  reset();
  return {reset, rotate, zoom, move, view};
})();
