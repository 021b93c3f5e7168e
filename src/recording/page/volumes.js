// Bounding volumes at one depth of the trees. All volumes of a kind are instances of one geometry.
// Each of its vertices is a corner of a rectangle plus the radius times a direction: those of a
// sphere for a swept rectangle, along the rectangle's normal for a box. The GPU places them.
const volumeShader = {
  vertexShader: `
    attribute vec2 at;           // corner of the rectangle, 0 or 1 along each side
    attribute vec3 outward;      // offset from the corner, in radii
    attribute vec3 corner, axisX, axisY;
    attribute vec3 shape;        // lengths of both sides, radius
    attribute vec4 colour;       // a: 1 if refitted in this frame
    attribute vec2 onFace;       // for a box: coordinates on a face, from -1 to 1
    uniform float least;         // smallest radius, so that flat volumes are visible
    varying vec3 toEye, facing;
    varying vec4 tint;
    varying vec2 face;
    void main() {
      float radius = max(shape.z, least);
      face = onFace;
      vec3 axisZ = cross(axisX, axisY);
      vec3 point = corner + axisX * (at.x * shape.x) + axisY * (at.y * shape.y)
        + radius * (axisX * outward.x + axisY * outward.y + axisZ * outward.z);
      vec3 away = axisX * normal.x + axisY * normal.y + axisZ * normal.z;
      vec4 seen = modelViewMatrix * vec4(point, 1.0);
      facing = (modelViewMatrix * vec4(away, 0.0)).xyz;
      toEye = -seen.xyz;
      tint = colour;
      gl_Position = projectionMatrix * seen;
    }`,
  fragmentShader: `
    uniform float flash;
    varying vec3 toEye, facing;
    varying vec4 tint;
    varying vec2 face;
    void main() {
      float rim = 1.0 - abs(dot(normalize(facing), normalize(toEye)));
      float alpha = mix(0.13, 0.72, rim * rim);
      if (max(abs(face.x), abs(face.y)) > 0.97) alpha = 0.6;
      vec3 colour = mix(tint.rgb, vec3(1.0), 0.55 * flash * tint.a);
      gl_FragColor = vec4(colour, min(1.0, alpha + tint.a * (0.08 + 0.4 * flash)));
    }`,
};

function baseGeometry(at, outward, normals, onFace, triangles) {
  const geometry = new THREE.InstancedBufferGeometry();
  geometry.setAttribute("at", new THREE.Float32BufferAttribute(at, 2));
  geometry.setAttribute("onFace", new THREE.Float32BufferAttribute(onFace, 2));
  geometry.setAttribute("outward", new THREE.Float32BufferAttribute(outward, 3));
  geometry.setAttribute("position", new THREE.Float32BufferAttribute(outward, 3));
  geometry.setAttribute("normal", new THREE.Float32BufferAttribute(normals, 3));
  geometry.setIndex(triangles);
  return geometry;
}

function sweptRectangleGeometry() {
  const kQuarter = 6, kRings = 12, kColumns = 4 * (kQuarter + 1);
  const at = [], outward = [], triangles = [];
  for (let ring = 0; ring <= kRings; ++ring)
    for (let quarter = 0; quarter < 4; ++quarter)
      for (let i = 0; i <= kQuarter; ++i) {
        const across = Math.PI / 2 * (quarter + i / kQuarter), down = Math.PI * ring / kRings;
        at.push(quarter === 0 || quarter === 3 ? 1 : 0, quarter <= 1 ? 1 : 0);
        outward.push(Math.sin(down) * Math.cos(across), Math.sin(down) * Math.sin(across),
          Math.cos(down));
      }
  for (let ring = 0; ring < kRings; ++ring)
    for (let i = 0; i < kColumns; ++i) {
      const a = kColumns * ring + i, b = kColumns * ring + (i + 1) % kColumns;
      triangles.push(a, a + kColumns, b + kColumns, a, b + kColumns, b);
    }
  const side = kQuarter + 1, bottom = kColumns * kRings;  // the flat faces
  for (const i of [1, 2]) {
    triangles.push(0, i * side, (i + 1) * side);
    triangles.push(bottom, bottom + (i + 1) * side, bottom + i * side);
  }
  return baseGeometry(at, outward, outward, new Float32Array(at.length), triangles);
}

function boxGeometry() {
  const at = [], outward = [], normals = [], onFace = [], triangles = [];
  for (let axis = 0; axis < 3; ++axis)
    for (const side of [-1, 1]) {
      const first = at.length / 2;
      for (const [u, v] of side > 0 ? [[-1, -1], [1, -1], [1, 1], [-1, 1]]
        : [[-1, -1], [-1, 1], [1, 1], [1, -1]]) {
        const corner = [0, 0, 0], normal = [0, 0, 0];
        corner[axis] = normal[axis] = side;
        corner[(axis + 1) % 3] = u;
        corner[(axis + 2) % 3] = v;
        at.push((corner[0] + 1) / 2, (corner[1] + 1) / 2);
        outward.push(0, 0, corner[2]);
        normals.push(...normal);
        onFace.push(u, v);
      }
      triangles.push(first, first + 1, first + 2, first, first + 2, first + 3);
    }
  return baseGeometry(at, outward, normals, onFace, triangles);
}

// The end of the colour scale at a depth: the largest inflation there, from a sample of frames.
const largestInflation = (() => {
  const found = new Array(Math.max(run.volumeDepth, 0) + 1).fill(0);
  const step = Math.max(1, Math.floor(run.frames.length / 100));
  for (let frame = 0; frame < run.frames.length; frame += step)
    run.bodies.forEach((_, body) => {
      const volumes = readVolumes(frame, body);
      for (let i = 0; i < volumes.length; i += kVolumeNumbers) {
        const depth = volumes[i + volumeField.depth];
        found[depth] = Math.max(found[depth] || 0, volumes[i + volumeField.inflation]);
      }
    });
  return (depth) => found[depth] || 1;
})();

// The offsets in `all` of a body's volumes at a depth, including leaves above it (`chosen`), and of
// refitted volumes at other depths (`others`).
function volumesAt(frame, body, depth) {
  const all = readVolumes(frame, body), chosen = [], others = [];
  for (let i = 0; i < all.length; i += kVolumeNumbers) {
    const at = all[i + volumeField.depth];
    if (at === depth || (at < depth && all[i + volumeField.leaf])) chosen.push(i);
    else if (all[i + volumeField.refitted]) others.push(i);
  }
  return {all, chosen, others};
}

const refittedColour = new THREE.Color(kRefitted);

class VolumeView {
  constructor(body, index) {
    this.index = index;
    this.exists = body.volumes !== "none" && run.volumeDepth >= 0;
    if (!this.exists) return;
    this.material = new THREE.ShaderMaterial({...volumeShader, transparent: true,
      depthWrite: false, uniforms: {flash: {value: 0},
        least: {value: 0.0015 / world.scale}}});
    this.base = body.volumes === "box" ? boxGeometry() : sweptRectangleGeometry();
    this.mesh = new THREE.Mesh(this.base, this.material);
    this.mesh.frustumCulled = false;
    this.mesh.renderOrder = 1;
    this.count = this.refitted = this.others = 0;
    scene.add(this.mesh);
  }

  show(frame, depth) {
    if (!this.exists) return;
    const now = run.frames[frame].bodies[this.index];
    this.absent = now.absent;
    if (now.absent) return;
    const {all, chosen, others} = volumesAt(frame, this.index, depth);
    const drawn = [...chosen, ...others];
    if (drawn.length > (this.capacity || 0)) this.grow(drawn.length);
    const set = (name, width, from) => {
      const attribute = this.base.attributes[name];
      drawn.forEach((i, k) => from(i, attribute.array, width * k));
      attribute.needsUpdate = true;
    };
    const copy = (field, width) => (i, out, k) =>
      out.set(all.subarray(i + field, i + field + width), k);
    set("corner", 3, copy(volumeField.corner, 3));
    set("axisX", 3, copy(volumeField.axis, 3));
    set("axisY", 3, copy(volumeField.axis + 3, 3));
    set("shape", 3, copy(volumeField.side, 3));
    set("colour", 4, (i, out, k) => this.writeColour(all, i, depth, out, k));
    this.base.maxInstancedCount = drawn.length;
    this.count = chosen.length;
    this.others = others.length;
    this.refitted = chosen.filter((i) => all[i + volumeField.refitted]).length;
    placeInScene(this.mesh, now.pose, now.positions.low);
  }

  writeColour(all, i, depth, out, k) {
    const refitted = all[i + volumeField.refitted];
    if (refitted) refittedColour.toArray(out, k);
    else inflationRamp.write(all[i + volumeField.inflation] / largestInflation(depth), out, k);
    out[k + 3] = refitted;
  }

  grow(count) {
    this.capacity = count;
    for (const [name, width] of Object.entries({corner: 3, axisX: 3, axisY: 3, shape: 3, colour: 4}))
      this.base.setAttribute(name,
        new THREE.InstancedBufferAttribute(new Float32Array(width * count), width));
  }

  setVisible(on) {
    if (this.exists) this.mesh.visible = on;
  }
  setFlash(share) {
    if (this.exists) this.material.uniforms.flash.value = share;
  }
}
