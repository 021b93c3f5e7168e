// The bodies: surfaces with edges, colours and patches. `ramp` makes colour scales from 0 to 1.
function ramp(stops) {
  const colours = stops.map((stop) => new THREE.Color(stop));
  const at = (t) => {
    const position = Math.min(Math.max(t, 0), 1) * (colours.length - 1);
    const i = Math.min(Math.floor(position), colours.length - 2);
    return colours[i].clone().lerp(colours[i + 1], position - i);
  };
  const table = new Float32Array(3 * 256);
  for (let i = 0; i < 256; ++i) at(i / 255).toArray(table, 3 * i);
  return {
    css: `linear-gradient(90deg, ${stops.join(", ")})`,
    write: (t, out, k) => {
      const i = 3 * Math.round(255 * Math.min(Math.max(t, 0), 1));
      out[k] = table[i];
      out[k + 1] = table[i + 1];
      out[k + 2] = table[i + 2];
    },
  };
}

// Readable without distinguishing red from green.
const inflationRamp = ramp(["#3f8efc", "#8f6bd9", "#f0731c"]);
const distanceRamp = ramp(["#b2182b", "#ef8a62", "#f3e9df", "#67a9cf", "#2166ac"]);
const kRefitted = "#12b76a";
const patchColours = ["#e4572e", "#17a398", "#7b4ff0", "#e8a13a", "#2e86de", "#c2338f", "#5a9e1f",
  "#8d5524"];
const bodyColours = ["#7f9cbd", "#c9a97c", "#8fb08c", "#b08fb3", "#a3a3a3", "#c98f85"];

function css(name) {
  return getComputedStyle(document.documentElement).getPropertyValue(name).trim();
}

const distanceEnds = extremes(run.frames.flatMap((frame) => frame.bodies
  .filter((body) => body.vertexDistances)
  .flatMap((body) => [body.vertexDistances.low, body.vertexDistances.high])));
const hasVertexDistances = distanceEnds[0] <= distanceEnds[1];
// The range of the colours, which the panel changes.
const vertexDistanceRange = [...(run.vertexDistanceRange || distanceEnds)];

// Writes the normal of a triangle, whose length is twice its area.
function writeNormal(positions, triangles, t, out) {
  const [a, b, c] = [3 * triangles[t], 3 * triangles[t + 1], 3 * triangles[t + 2]];
  const ux = positions[b] - positions[a], vx = positions[c] - positions[a];
  const uy = positions[b + 1] - positions[a + 1], vy = positions[c + 1] - positions[a + 1];
  const uz = positions[b + 2] - positions[a + 2], vz = positions[c + 2] - positions[a + 2];
  out.set(uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx);
}

// Splits vertices at sharp edges, so that a box has flat faces. Returns the recorded vertex of each
// drawn vertex (`source`), and three drawn vertices for each triangle (`corners`).
const kSharp = 0.77;  // cosine of the angle between the normals of two triangles: 40 degrees
function splitAtSharpEdges(positions, triangles) {
  const corners = new Uint32Array(triangles.length), source = [], normals = [];
  const drawn = Array.from({length: positions.length / 3}, () => []), normal = new THREE.Vector3();
  for (let t = 0; t < triangles.length; t += 3) {
    writeNormal(positions, triangles, t, normal);
    normal.normalize();
    for (let k = t; k < t + 3; ++k) {
      const same = drawn[triangles[k]];
      let vertex = same.find((other) => !(normals[other].dot(normal) < kSharp));
      if (vertex === undefined) {
        vertex = source.push(triangles[k]) - 1;
        normals.push(normal.clone());
        same.push(vertex);
      }
      corners[k] = vertex;
    }
  }
  return {source, corners};
}

// Writes vertex normals for smooth shading: means of the adjacent normals, weighted by area.
function writeNormals(positions, corners, normals) {
  const normal = new THREE.Vector3();
  normals.fill(0);
  for (let t = 0; t < corners.length; t += 3) {
    writeNormal(positions, corners, t, normal);
    for (let k = t; k < t + 3; ++k) {
      const at = 3 * corners[k];
      normals[at] += normal.x;
      normals[at + 1] += normal.y;
      normals[at + 2] += normal.z;
    }
  }
  for (let i = 0; i < normals.length; i += 3) {
    const length = Math.hypot(normals[i], normals[i + 1], normals[i + 2]) || 1;
    normals[i] /= length;
    normals[i + 1] /= length;
    normals[i + 2] /= length;
  }
}

// The common material of all surfaces.
function surfaceMaterial(options) {
  return new THREE.MeshPhongMaterial({side: THREE.DoubleSide, specular: 0x16181c, shininess: 18,
    polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1, ...options});
}

// Makes a material draw what is behind other surfaces, faintly.
function seenThrough(material) {
  Object.assign(material, {transparent: true, opacity: 0.4, depthTest: false, depthWrite: false});
  return material;
}

class BodyView {
  constructor(body, index) {
    this.index = index;
    this.unbounded = body.unbounded;
    this.wanted = true;
    this.patches = [];  // meshes: as surfaces, and as seen through other surfaces
    this.colour = new THREE.Color(bodyColours[index % bodyColours.length]);
    this.positions = new Float32Array(3 * body.vertices);
    this.triangles = readTriangles(body);
    this.geometry = new THREE.BufferGeometry();
    this.material = surfaceMaterial({vertexColors: THREE.VertexColors});
    this.mesh = new THREE.Mesh(this.geometry, this.material);
    this.mesh.frustumCulled = false;
    scene.add(this.mesh);
    this.setOpacity(body.unbounded ? 0.3 : 1);
  }

  show(frame) {
    const now = run.frames[frame].bodies[this.index];
    this.absent = Boolean(now.absent);
    if (!this.absent && now.positions !== this.shownPositions) {
      readPoints(now.positions, this.positions);
      if (!this.source) this.split();
      this.updateGeometry();
      this.shownPositions = now.positions;
    }
    this.showPatches(now.patches);
    this.applyVisible();
    if (this.absent) return;
    this.paint(now.vertexDistances);
    placeInScene(this.mesh, now.pose, now.positions.low);
    if (this.unbounded) this.spread(now.positions.size);
    for (const other of [this.edges, ...this.patches]) if (other) placeAs(other, this.mesh);
  }

  // Splits vertices at the sharp edges of the first positions.
  split() {
    Object.assign(this, splitAtSharpEdges(this.positions, this.triangles));
    for (const name of ["position", "normal", "color"])
      this.geometry.setAttribute(name,
        new THREE.BufferAttribute(new Float32Array(3 * this.source.length), 3));
    this.geometry.setIndex(new THREE.BufferAttribute(this.corners, 1));
  }

  // Copies recorded positions to the drawn vertices, and computes normals.
  updateGeometry() {
    const {position, normal} = this.geometry.attributes;
    this.source.forEach((from, to) => {
      for (let k = 0; k < 3; ++k) position.array[3 * to + k] = this.positions[3 * from + k];
    });
    writeNormals(position.array, this.corners, normal.array);
    position.needsUpdate = normal.needsUpdate = true;
  }

  // Enlarges the square of a plane beyond the scene, about its point nearest to the scene's origin.
  spread(size) {
    const {matrix} = this.mesh, axes = [0, 1, 2].map(() => new THREE.Vector3());
    const corner = (i) => new THREE.Vector3().fromArray(this.positions, 3 * i).applyMatrix4(matrix);
    const middle = new THREE.Vector3(...size).multiplyScalar(0.5).applyMatrix4(matrix);
    axes[0].subVectors(corner(1), corner(0)).normalize();
    axes[1].subVectors(corner(3), corner(0)).normalize();
    axes[2].crossVectors(axes[0], axes[1]);
    const nearest = axes[2].clone().multiplyScalar(axes[2].dot(middle)), factor = 1.5 / world.scale;
    matrix.premultiply(new THREE.Matrix4().makeTranslation(-middle.x, -middle.y, -middle.z))
      .premultiply(new THREE.Matrix4().makeScale(factor, factor, factor))
      .premultiply(new THREE.Matrix4().makeTranslation(nearest.x, nearest.y, nearest.z));
  }

  // Draws coloured triangles over the surface, and faintly through other surfaces. They share its
  // vertices.
  showPatches(block) {
    if (block === this.shownPatches) return;
    this.shownPatches = block;
    if (!block) return;
    if (!this.patches.length) {
      const geometry = new THREE.BufferGeometry();
      for (const name of ["position", "normal"]) geometry.attributes[name] = this.geometry.attributes[name];
      const coloured = (make) => new THREE.Mesh(geometry, patchColours.map(make));
      this.patches = [coloured((color) =>
        surfaceMaterial({color, polygonOffsetFactor: 0, polygonOffsetUnits: 0})),
      coloured((color) => seenThrough(new THREE.MeshBasicMaterial({color, side: THREE.DoubleSide})))];
      this.patches.forEach((mesh, i) => {
        mesh.frustumCulled = false;
        mesh.renderOrder = 2 * i;
        scene.add(mesh);
      });
    }
    const numbers = readPatches(block), byColour = patchColours.map(() => []);
    for (let i = 0; i < block.count; ++i) {
      const t = 3 * numbers[i];
      byColour[numbers[block.count + i] % patchColours.length].push(...this.corners.subarray(t, t + 3));
    }
    const {geometry} = this.patches[0];
    geometry.clearGroups();
    let first = 0;
    byColour.forEach((corners, colour) => {
      geometry.addGroup(first, corners.length, colour);
      first += corners.length;
    });
    geometry.setIndex(byColour.flat());
  }

  setColour(colour) {
    this.colour.set(colour);
    this.paintAgain();
  }

  paintAgain() {
    this.shownPaint = null;
    this.show(frameShown);
  }

  setOpacity(opacity) {
    const {material} = this;
    material.opacity = opacity;
    material.transparent = opacity < 1;
    material.depthWrite = opacity === 1;
    material.needsUpdate = true;
  }

  // Colours the vertices by distance, or all in the body's colour.
  paint(distances) {
    const wanted = settings.vertexDistances && distances ? distances.at : "plain";
    if (wanted === this.shownPaint) return;
    this.shownPaint = wanted;
    const colours = this.geometry.attributes.color.array;
    if (wanted === "plain") {
      for (let i = 0; i < colours.length; i += 3) this.colour.toArray(colours, i);
    } else {
      const [low, high] = vertexDistanceRange, values = readValues(distances, this.positions.length / 3);
      this.source.forEach((from, to) => distanceRamp.write(
        high > low ? (values[from] - low) / (high - low) : 1, colours, 3 * to));
    }
    this.geometry.attributes.color.needsUpdate = true;
  }

  setEdges(on) {
    if (on && !this.edges) {
      const ink = new THREE.MeshBasicMaterial({wireframe: true, color: 0x0b1118, transparent: true,
        opacity: 0.28, depthWrite: false});
      this.edges = new THREE.Mesh(this.geometry, ink);
      this.edges.frustumCulled = false;
      placeAs(this.edges, this.mesh);
      scene.add(this.edges);
    }
    if (this.edges) this.edges.visible = on && this.mesh.visible;
  }

  setVisible(on) {
    this.wanted = on;
    this.applyVisible();
  }

  applyVisible() {
    this.mesh.visible = this.wanted && !this.absent;
    this.patches.forEach((mesh, i) => {
      mesh.visible = this.mesh.visible && settings.patches && Boolean(this.shownPatches) &&
        (i === 0 || settings.through);
    });
    this.setEdges(settings.edges);
  }
}
