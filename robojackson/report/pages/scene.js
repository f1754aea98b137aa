/* Figures on a floor, drawn by three.js: robots by the poses of their bodies, a person by its points. */
'use strict';
const Stage = (() => {
  const T = THREE;
  const bytes = (text) => Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)).buffer;
  const floats = (text) => new Float32Array(bytes(text));
  const css = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

  /* Whether WebGL runs on the processor: edges are then not smoothed and pixels are larger. */
  function softwareRendering() {
    const gl = document.createElement('canvas').getContext('webgl2');
    const info = gl?.getExtension('WEBGL_debug_renderer_info');
    const name = info ? gl.getParameter(info.UNMASKED_RENDERER_WEBGL) : '';
    gl?.getExtension('WEBGL_lose_context')?.loseContext();
    return /swiftshader|llvmpipe|software|basic render/i.test(name);
  }

  function meshGeometry(mesh) {
    const whole = new Int16Array(bytes(mesh.vertices)), geometry = new T.BufferGeometry();
    geometry.setAttribute('position', new T.BufferAttribute(Float32Array.from(whole, (steps) => steps * mesh.scale), 3));
    geometry.setIndex(new T.BufferAttribute(new (mesh.wide ? Uint32Array : Uint16Array)(bytes(mesh.faces)), 1));
    geometry.setAttribute('normal', new T.BufferAttribute(Float32Array.from(new Int8Array(bytes(mesh.normals)), (steps) => steps / 127), 3));
    return geometry;
  }

  /* Corners of a circle, and of half a meridian, by the level of detail; a processor takes as long for a corner as for ten pixels. */
  const ROUND = { '': [20, 14], rough: [12, 8], shadow: [8, 5] };
  function geometryOf(geom, mesh, level) {
    const [a, b, c] = geom.size, [round, half] = ROUND[level];
    switch (geom.kind) {
      case 'mesh': return meshGeometry(level ? mesh[level] : mesh);
      case 'capsule': return new T.CapsuleGeometry(a, 2 * b, half >> 1, round).rotateX(Math.PI / 2);
      case 'cylinder': return new T.CylinderGeometry(a, a, 2 * b, round).rotateX(Math.PI / 2);
      case 'box': return new T.BoxGeometry(2 * a, 2 * b, 2 * c);
      case 'ellipsoid': return new T.SphereGeometry(1, round, half).scale(a, b, c);
      default: return new T.SphereGeometry(a, round, half);
    }
  }

  /* The geoms of each body of a robot as one geometry. */
  function partsOf(shape, level) {
    const bodies = new Map(), pose = new T.Matrix4(), one = new T.Vector3(1, 1, 1), turn = new T.Quaternion();
    for (const geom of shape.geoms) {
      const part = geometryOf(geom, shape.meshes[geom.mesh], level);
      turn.set(geom.quat[1], geom.quat[2], geom.quat[3], geom.quat[0]);
      part.applyMatrix4(pose.compose(new T.Vector3(...geom.pos), turn, one));
      if (!bodies.has(geom.body)) bodies.set(geom.body, { corners: [], normals: [], index: [] });
      const { corners, normals, index } = bodies.get(geom.body), first = corners.length / 3;
      for (const corner of part.index.array) index.push(first + corner);
      for (const value of part.attributes.position.array) corners.push(value);
      for (const value of part.attributes.normal.array) normals.push(value);
    }
    return [...bodies].map(([body, { corners, normals, index }]) => {
      const geometry = new T.BufferGeometry();
      geometry.setAttribute('position', new T.BufferAttribute(Float32Array.from(corners), 3));
      geometry.setAttribute('normal', new T.BufferAttribute(Float32Array.from(normals), 3));
      geometry.setIndex(index);
      return { body, geometry };
    });
  }

  const flatten = new T.Matrix4().set(1, 0, -0.32, 0, 0, 1, -0.22, 0, 0, 0, 0, 0.003, 0, 0, 0, 1);
  function asShadow(object) {
    object.matrixAutoUpdate = false; object.matrix.copy(flatten); object.frustumCulled = false;
    return object;
  }

  /* A robot; `pose` takes a row of x y z qw qx qy qz a body from an offset. */
  function robot(shape, material, shadowMaterial, simple = false) {
    const group = new T.Group(), below = asShadow(new T.Group());
    shape.shadow ??= partsOf(shape, 'shadow'); shape.fine ??= partsOf(shape, simple ? 'rough' : '');
    const build = (parts, dressed, into) => parts.map(({ body, geometry }) => {
      const mesh = new T.Mesh(geometry, dressed);
      mesh.frustumCulled = false; mesh.userData.body = body; into.add(mesh);
      return mesh;
    });
    const parts = build(shape.fine, material, group), all = [...parts];
    if (shadowMaterial) { group.add(below); all.push(...build(shape.shadow, shadowMaterial, below)); }
    const pose = (values, from = 0) => {
      for (const { position, quaternion, userData } of all) {
        const at = from + 7 * userData.body;
        position.set(values[at], values[at + 1], values[at + 2]);
        quaternion.set(values[at + 4], values[at + 5], values[at + 6], values[at + 3]);
      }
    };
    return { group, parts, pose };
  }

  /* Corners of the trunk: its thick parts overlap, and fewer would cut into each other. */
  const TRUNK = [16, 10];

  /* A person of rounded parts between points; `pose` takes rows of x y z from an offset. */
  function person(shape, colours, shadowMaterial, simple = false) {
    const group = new T.Group(), up = new T.Vector3(0, 1, 0), a = new T.Vector3(), b = new T.Vector3();
    const stick = (round) => new T.CylinderGeometry(1, 1, 1, round, 1, true).translate(0, 0.5, 0), ball = (round, half) => new T.SphereGeometry(1, round, half);
    const fine = simple ? [10, 6] : [14, 10], coarse = [6, 4];
    const turn = new T.Quaternion(), matrix = new T.Matrix4(), size = new T.Vector3();
    const sides = ['left', 'right', 'middle'].map((side) => {
      const bones = shape.bones.filter((bone) => bone.side === side), round = side === 'middle' ? TRUNK : fine;
      const build = (geometry, shadow, count) => {
        const shown = new T.InstancedMesh(geometry, colours[side], count), below = asShadow(new T.InstancedMesh(shadow, shadowMaterial, count));
        below.instanceMatrix = shown.instanceMatrix; shown.frustumCulled = false;
        group.add(shown, below);
        return shown;
      };
      return { bones, rods: build(stick(round[0]), stick(coarse[0]), bones.length), balls: build(ball(...round), ball(...coarse), 2 * bones.length) };
    });
    const pose = (values, at = 0) => {
      for (const { bones, rods, balls } of sides) {
        bones.forEach((bone, i) => {
          a.fromArray(values, at + 3 * bone.from); b.fromArray(values, at + 3 * bone.to);
          size.subVectors(b, a);
          const length = Math.max(size.length(), 1e-4);
          turn.setFromUnitVectors(up, size.divideScalar(length));
          rods.setMatrixAt(i, matrix.compose(a, turn, size.set(bone.radius, length, bone.radius)));
          size.setScalar(bone.radius);
          balls.setMatrixAt(2 * i, matrix.compose(a, turn, size)); balls.setMatrixAt(2 * i + 1, matrix.compose(b, turn, size));
        });
        rods.instanceMatrix.needsUpdate = balls.instanceMatrix.needsUpdate = true;
      }
    };
    return { group, pose };
  }

  /* What draws on a canvas; null where the browser has no WebGL. */
  function rendererOf(canvas, smooth) {
    try {
      return new T.WebGLRenderer({ canvas, antialias: smooth, powerPreference: 'high-performance' });
    } catch {
      return null;
    }
  }

  /* Panes that share one canvas, one light and one orbit, each with a floor and a point it follows; empty where `renderer` is null. */
  class Panes {
    constructor(canvas, elements, orbitElement) {
      this.canvas = canvas;
      this.software = softwareRendering();
      this.renderer = rendererOf(canvas, !this.software);
      this.renderer?.setPixelRatio(this.software ? Math.min(1, 900 / canvas.clientWidth) : Math.min(devicePixelRatio, 2));
      canvas.addEventListener('webglcontextrestored', () => this.draw());
      this.materials = {
        reference: new T.MeshLambertMaterial(), trained: new T.MeshLambertMaterial(), shadow: new T.MeshBasicMaterial(),
        ghost: new T.MeshLambertMaterial({ transparent: true, opacity: 0.32, depthWrite: false }),
        left: new T.MeshLambertMaterial(), right: new T.MeshLambertMaterial(), middle: new T.MeshLambertMaterial(),
      };
      this.panes = elements.map((element) => this.#pane(element));
      this.orbit = new T.PerspectiveCamera();
      this.orbit.up.set(0, 0, 1);
      this.controls = new T.OrbitControls(this.orbit, orbitElement);
      Object.assign(this.controls, { enablePan: false, enableZoom: false, minPolarAngle: 0.15, maxPolarAngle: 1.56 });
      orbitElement.style.touchAction = 'pan-y';
      orbitElement.addEventListener('wheel', (event) => {
        if (!event.ctrlKey && !event.metaKey) return;
        event.preventDefault(); this.zoom(Math.exp(event.deltaY * 0.004));
      }, { passive: false });
      this.controls.addEventListener('change', () => this.draw());
      this.scale = 1;
      this.look();
      new ResizeObserver(() => this.measure()).observe(canvas.parentElement);
      matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => { this.dress(); this.draw(); });
      this.dress();
    }

    #pane(element) {
      const scene = new T.Scene(), camera = new T.PerspectiveCamera(26, 1, 0.1, 60);
      camera.up.set(0, 0, 1);
      const sky = new T.HemisphereLight(0xffffff, 0x8a93a3, 2.0), key = new T.DirectionalLight(0xffffff, 1.9);
      key.position.set(3, 2.2, 5);
      const floor = new T.Mesh(new T.PlaneGeometry(80, 80), new T.MeshBasicMaterial());
      const grid = new T.GridHelper(40, 80, 0, 0);
      grid.rotateX(Math.PI / 2); grid.position.z = 0.0015;
      floor.renderOrder = 1; grid.renderOrder = 2;
      scene.add(sky, key, floor, grid);
      scene.fog = new T.Fog(0, 6, 18);
      return { element, scene, camera, floor, grid, target: new T.Vector3(0, 0, 0.9), height: 1.8, width: 1.2 };
    }

    dress() {
      for (const [name, material] of Object.entries(this.materials)) material.color.set(css(`--robot-${name}`));
      for (const pane of this.panes) {
        pane.floor.material.color.set(css('--floor'));
        pane.grid.material.vertexColors = false; pane.grid.material.color.set(css('--grid')); pane.grid.material.needsUpdate = true;
        pane.scene.background = new T.Color(css('--scene')); pane.scene.fog.color.set(css('--scene'));
      }
    }

    look(azimuth = 0.35, polar = 1.36) {
      this.orbit.position.setFromSphericalCoords(1, polar, 0);
      const level = Math.sin(polar);
      this.orbit.position.set(level * Math.cos(azimuth), level * Math.sin(azimuth), Math.cos(polar));
      this.orbit.lookAt(0, 0, 0); this.controls.update(); this.draw();
    }

    turn(azimuth, polar) {
      const p = this.orbit.position;
      this.look(Math.atan2(p.y, p.x) + azimuth, Math.min(1.56, Math.max(0.15, Math.acos(p.z / p.length()) + polar)));
    }

    zoom(factor) { this.scale = Math.min(3, Math.max(0.35, this.scale * factor)); this.draw(); }

    measure() {
      const box = this.canvas.parentElement.getBoundingClientRect();
      this.renderer?.setSize(box.width, box.height, false);
      for (const pane of this.panes) {
        const r = pane.element.getBoundingClientRect();
        pane.box = [r.left - box.left, box.height - (r.bottom - box.top), r.width, r.height];
        pane.camera.aspect = r.width / Math.max(1, r.height);
      }
      this.draw();
    }

    /* Places a pane's camera; a ray through it is what a pointer touches. */
    aim(pane) {
      const half = Math.tan((pane.camera.fov * Math.PI) / 360);
      const far = Math.max(pane.height / (2 * half), pane.width / (2 * half * pane.camera.aspect)) * this.scale;
      pane.camera.position.copy(this.orbit.position).normalize().multiplyScalar(far).add(pane.target);
      pane.camera.position.z = Math.max(0.05, pane.camera.position.z);
      pane.camera.lookAt(pane.target);
      pane.camera.updateProjectionMatrix();
      pane.scene.fog.near = far + 1.5; pane.scene.fog.far = far + 12;
      pane.floor.position.set(Math.round(pane.target.x * 2) / 2, Math.round(pane.target.y * 2) / 2, 0);
      pane.grid.position.set(pane.floor.position.x, pane.floor.position.y, 0.0015);
    }

    draw() { this.dirty = true; }

    render() {
      if (!this.dirty || !this.renderer || !this.panes[0].box) return false;
      this.dirty = false;
      /* Each time: a context that was lost and restored has forgotten it. */
      this.renderer.setScissorTest(true);
      for (const pane of this.panes) {
        if (pane.element.hidden) continue;
        this.aim(pane);
        this.renderer.setViewport(...pane.box); this.renderer.setScissor(...pane.box);
        this.renderer.render(pane.scene, pane.camera);
      }
      return true;
    }
  }
  return { bytes, floats, css, robot, person, Panes };
})();
