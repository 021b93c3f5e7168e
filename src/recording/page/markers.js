// Nearest points, drawn as segments, and contacts, drawn as points. Both have a constant size on
// the screen. Parts behind a surface are drawn faintly.
class Segments {
  constructor() {
    this.group = new THREE.Group();
    this.solid = new THREE.MeshBasicMaterial();
    this.faint = new THREE.MeshBasicMaterial({transparent: true, opacity: 0.35, depthTest: false,
      depthWrite: false});
    this.rod = new THREE.CylinderBufferGeometry(1, 1, 1, 12);
    this.ball = new THREE.SphereBufferGeometry(1, 16, 12);
    this.shown = [];
    scene.add(this.group);
    beforeRender.push(() => this.keepSize());
  }

  setColour(colour) {
    this.solid.color.set(colour);
    this.faint.color.set(colour);
  }

  // Shows pairs of points, given in the world.
  show(pairs) {
    this.shown = pairs.map((pair) => [pair.slice(0, 3), pair.slice(3)].map((point) =>
      new THREE.Vector3(...point).applyMatrix4(world.matrix)));
    while (this.group.children.length < 6 * this.shown.length)
      for (const material of [this.faint, this.solid])
        for (const geometry of [this.rod, this.ball, this.ball]) {
          const mesh = new THREE.Mesh(geometry, material);
          mesh.renderOrder = material === this.solid ? 2 : 3;
          this.group.add(mesh);
        }
    this.group.children.forEach((mesh, i) => { mesh.visible = i < 6 * this.shown.length; });
  }

  keepSize() {
    const up = new THREE.Vector3(0, 1, 0);
    this.shown.forEach(([a, b], i) => {
      const middle = a.clone().lerp(b, 0.5), axis = b.clone().sub(a), length = axis.length();
      const pixel = pixelAt(middle);
      for (const first of [6 * i, 6 * i + 3]) {
        const [rod, from, to] = this.group.children.slice(first, first + 3);
        rod.position.copy(middle);
        if (length > 0) rod.quaternion.setFromUnitVectors(up, axis.clone().divideScalar(length));
        rod.scale.set(1.7 * pixel, Math.max(length, 1e-9), 1.7 * pixel);
        from.position.copy(a);
        to.position.copy(b);
        from.scale.setScalar(4.5 * pixel);
        to.scale.setScalar(4.5 * pixel);
      }
    });
  }
}

const pointShader = {
  vertexShader: `
    uniform float size;
    void main() {
      gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
      gl_PointSize = size;
    }`,
  fragmentShader: `
    uniform vec3 colour;
    uniform float opacity;
    void main() {
      float r = length(gl_PointCoord - 0.5);
      if (r > 0.5) discard;
      gl_FragColor = vec4(mix(colour, vec3(1.0), smoothstep(0.36, 0.44, r)), opacity);
    }`,
};

class Contacts {
  constructor() {
    this.geometry = new THREE.BufferGeometry();
    this.layers = [{opacity: 0.3, depthTest: false}, {opacity: 1, depthTest: true}].map((layer) => {
      const material = new THREE.ShaderMaterial({...pointShader, transparent: true,
        depthTest: layer.depthTest, depthWrite: false, uniforms: {size: {value: 1},
          opacity: {value: layer.opacity}, colour: {value: new THREE.Color()}}});
      material.polygonOffset = true;
      const points = new THREE.Points(this.geometry, material);
      points.frustumCulled = false;
      points.renderOrder = 2;
      scene.add(points);
      return points;
    });
    beforeRender.push(() => this.layers.forEach(({material}) => {
      material.uniforms.size.value = 8 * window.devicePixelRatio;
    }));
  }

  setColour(colour) {
    this.layers.forEach(({material}) => material.uniforms.colour.value.set(colour));
  }

  show(block) {
    this.layers.forEach((points) => { points.visible = Boolean(block); });
    if (!block) return;
    this.geometry.setAttribute("position",
      new THREE.BufferAttribute(readPoints(block, new Float32Array(3 * block.count)), 3));
    this.layers.forEach((points) => placeInScene(points, null, block.low));
  }
}
