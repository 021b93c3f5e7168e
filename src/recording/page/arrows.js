// The recorded arrows and segments. All with one label have one colour.
const labelColours = ["#0b8f86", "#e8590c", "#6741d9", "#2f9e44", "#c2255c", "#1971c2"];

// The labels of a kind (arrows or segments), in the order of their first use.
function labelsOf(kind) {
  return [...new Set(run.frames.flatMap((frame) => (frame[kind] || []).map(({label}) => label)))];
}
const arrowLabels = labelsOf("arrows"), segmentLabels = labelsOf("segments");

// For each label and frame, the length of the longest arrow and the number of arrows.
const arrowLengths = arrowLabels.map((label) => run.frames.map((frame) => {
  const found = (frame.arrows || []).filter((arrows) => arrows.label === label)
    .flatMap(({blocks}) => readWorldPoints(blocks[1]).map((vector) => vector.length()));
  return {longest: found.reduce((a, b) => Math.max(a, b), 0), count: found.length};
}));

// Draws many copies of a shape of length 1, which begins at the origin and points along y. Parts
// behind a surface are drawn faintly.
class Copies {
  constructor(geometry) {
    this.geometry = geometry;
    this.material = new THREE.MeshPhongMaterial({specular: 0x16181c});
    this.faint = seenThrough(new THREE.MeshBasicMaterial());
    this.meshes = [];
  }

  setColour(colour) {
    for (const material of [this.material, this.faint]) material.color.set(colour);
  }

  // Draws a copy for each entry {from, direction, length, width}, in scene coordinates.
  show(list) {
    if (this.meshes.length === 0 || list.length > this.capacity) {
      scene.remove(...this.meshes);
      this.capacity = Math.max(2 * list.length, 16);
      this.meshes = [this.material, this.faint].map((material) => {
        const mesh = new THREE.InstancedMesh(this.geometry, material, this.capacity);
        mesh.frustumCulled = false;
        mesh.renderOrder = material === this.faint ? 3 : 0;
        scene.add(mesh);
        return mesh;
      });
    }
    const matrix = new THREE.Matrix4(), turn = new THREE.Quaternion(), up = new THREE.Vector3(0, 1, 0);
    list.forEach(({from, direction, length, width}, i) => {
      turn.setFromUnitVectors(up, direction);
      matrix.compose(from, turn, new THREE.Vector3(width, length, width));
      for (const mesh of this.meshes) mesh.setMatrixAt(i, matrix);
    });
    for (const mesh of this.meshes) {
      mesh.count = list.length;
      mesh.visible = list.length > 0;
      mesh.instanceMatrix.needsUpdate = true;
    }
    this.applyThrough();
  }

  applyThrough() {
    if (this.meshes.length) this.meshes[1].visible = this.meshes[0].visible && settings.through;
  }
}

class LabelView {
  constructor(kind, label, colour) {
    Object.assign(this, {kind, label, colour, wanted: true, drawn: 0});
    const rod = new THREE.CylinderBufferGeometry(1, 1, 1, 8), tip = new THREE.ConeBufferGeometry(1, 1, 12);
    for (const geometry of [rod, tip]) geometry.translate(0, 0.5, 0);
    this.rods = new Copies(rod);
    this.tips = new Copies(tip);
    for (const copies of [this.rods, this.tips]) copies.setColour(colour);
  }

  // The pairs [from, to] of a frame, in scene coordinates.
  pairsIn(frame) {
    const pairs = [];
    for (const {label, scale, blocks} of run.frames[frame][this.kind] || []) {
      if (label !== this.label) continue;
      const seconds = readWorldPoints(blocks[1]);
      readWorldPoints(blocks[0]).forEach((from, i) => {
        const to = this.kind === "arrows"
          ? from.clone().addScaledVector(seconds[i], scale || this.usualScale()) : seconds[i];
        pairs.push([from.applyMatrix4(world.matrix), to.applyMatrix4(world.matrix)]);
      });
    }
    return pairs;
  }

  // The scale of arrows without a recorded one: the longest is an eighth of the scene's diameter.
  usualScale() {
    const longest = arrowLengths[arrowLabels.indexOf(this.label)]
      .reduce((all, {longest: one}) => Math.max(all, one), 0);
    return longest > 0 ? 0.25 / world.scale / longest : 0;
  }

  show(frame) {
    const rods = [], tips = [], arrows = this.kind === "arrows";
    for (const [from, to] of this.wanted ? this.pairsIn(frame) : []) {
      const direction = to.clone().sub(from), length = direction.length();
      if (!(length > 0)) continue;
      direction.divideScalar(length);
      const tip = arrows ? Math.min(0.035, 0.4 * length) : 0;
      rods.push({from, direction, length: length - tip, width: arrows ? 0.12 * tip : 0.003});
      if (arrows)
        tips.push({from: to.clone().addScaledVector(direction, -tip), direction, length: tip,
          width: 0.32 * tip});
    }
    this.drawn = rods.length;
    this.rods.show(rods);
    this.tips.show(tips);
  }
}
