// Colours by number, told apart also by those who do not see red and green.
function ramp(stops) {
  const colours = stops.map((stop) => new THREE.Color(stop));
  const at = (t) => {
    const place = Math.min(Math.max(t, 0), 1) * (colours.length - 1);
    const i = Math.min(Math.floor(place), colours.length - 2);
    return colours[i].clone().lerp(colours[i + 1], place - i);
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

const inflationRamp = ramp(["#3f8efc", "#8f6bd9", "#f0731c"]);
const clearanceRamp = ramp(["#b2182b", "#ef8a62", "#f3e9df", "#67a9cf", "#2166ac"]);
const kRefitted = "#12b76a";
const bodyColours = ["#7f9cbd", "#c9a97c", "#8fb08c", "#b08fb3", "#a3a3a3", "#c98f85"];

function css(name) {
  return getComputedStyle(document.documentElement).getPropertyValue(name).trim();
}

// The surfaces: shaded, edges on request, painted where a clearance was recorded.
const clearanceEnds = extremes(run.frames.flatMap((frame) => frame.bodies
  .filter((body) => body.clearance)
  .flatMap((body) => [body.clearance.low, body.clearance.high])));
const hasClearance = clearanceEnds[0] <= clearanceEnds[1];

// Of every vertex the mean of its triangles' normals by area: what makes a coarse mesh look smooth.
function writeNormals(positions, triangles, normals) {
  normals.fill(0);
  for (let t = 0; t < triangles.length; t += 3) {
    const a = 3 * triangles[t], b = 3 * triangles[t + 1], c = 3 * triangles[t + 2];
    const ux = positions[b] - positions[a], vx = positions[c] - positions[a];
    const uy = positions[b + 1] - positions[a + 1], vy = positions[c + 1] - positions[a + 1];
    const uz = positions[b + 2] - positions[a + 2], vz = positions[c + 2] - positions[a + 2];
    const x = uy * vz - uz * vy, y = uz * vx - ux * vz, z = ux * vy - uy * vx;
    for (const corner of [a, b, c]) {
      normals[corner] += x;
      normals[corner + 1] += y;
      normals[corner + 2] += z;
    }
  }
  for (let i = 0; i < normals.length; i += 3) {
    const length = Math.hypot(normals[i], normals[i + 1], normals[i + 2]) || 1;
    normals[i] /= length;
    normals[i + 1] /= length;
    normals[i + 2] /= length;
  }
}

class BodyView {
  constructor(body, index) {
    this.index = index;
    this.colour = new THREE.Color(bodyColours[index % bodyColours.length]);
    this.positions = new Float32Array(3 * body.vertices);
    this.triangles = readTriangles(body);
    this.geometry = new THREE.BufferGeometry();
    for (const name of ["position", "normal", "color"])
      this.geometry.setAttribute(name, new THREE.BufferAttribute(
        name === "position" ? this.positions : new Float32Array(3 * body.vertices), 3));
    this.geometry.setIndex(new THREE.BufferAttribute(this.triangles, 1));
    this.material = new THREE.MeshPhongMaterial({vertexColors: THREE.VertexColors,
      side: THREE.DoubleSide, specular: 0x16181c, shininess: 18, polygonOffset: true,
      polygonOffsetFactor: 1, polygonOffsetUnits: 1});
    this.mesh = new THREE.Mesh(this.geometry, this.material);
    this.mesh.frustumCulled = false;
    scene.add(this.mesh);
  }

  show(frame) {
    const now = run.frames[frame].bodies[this.index];
    if (now.positions !== this.shownPositions) {
      readPoints(now.positions, this.positions);
      writeNormals(this.positions, this.triangles, this.geometry.attributes.normal.array);
      this.geometry.attributes.position.needsUpdate = true;
      this.geometry.attributes.normal.needsUpdate = true;
      this.shownPositions = now.positions;
    }
    this.paint(now.clearance);
    placeInScene(this.mesh, now.pose, now.positions.low);
    if (this.edges) this.edges.matrix.copy(this.mesh.matrix);
  }

  paint(clearance) {
    const wanted = settings.clearance && clearance ? clearance : "plain";
    if (wanted === this.shownPaint) return;
    this.shownPaint = wanted;
    const colours = this.geometry.attributes.color.array;
    if (wanted === "plain") {
      for (let i = 0; i < colours.length; i += 3) this.colour.toArray(colours, i);
    } else {
      const [low, high] = clearanceEnds, values = readValues(clearance, colours.length / 3);
      values.forEach((value, v) =>
        clearanceRamp.write(high > low ? (value - low) / (high - low) : 1, colours, 3 * v));
    }
    this.geometry.attributes.color.needsUpdate = true;
  }

  setEdges(on) {
    if (on && !this.edges) {
      const ink = new THREE.MeshBasicMaterial({wireframe: true, color: 0x0b1118, transparent: true,
        opacity: 0.28, depthWrite: false});
      this.edges = new THREE.Mesh(this.geometry, ink);
      this.edges.matrixAutoUpdate = false;
      this.edges.frustumCulled = false;
      this.edges.matrix.copy(this.mesh.matrix);
      scene.add(this.edges);
    }
    if (this.edges) this.edges.visible = on && this.mesh.visible;
  }

  setVisible(on) {
    this.mesh.visible = on;
    this.setEdges(settings.edges);
  }
}
