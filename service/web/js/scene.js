// The stage: camera, light and floor; it draws only when something has changed.

import * as THREE from "three";
import { OrbitControls } from "three/OrbitControls";
import { calm } from "./dom.js";
import { Floor } from "./floor.js";
import { studio } from "./studio.js";

/** Room for dimension lines, in radii of the mesh. */
const MARGIN = 0.11;
const LOOK_FROM = new THREE.Vector3(0.8, 0.46, 1).normalize();

export class Scene {
  /**
   * @param toolbar what lies over the canvas's lower edge
   * @param software draw what takes least, as no graphics card helps
   */
  constructor(canvas, toolbar, software) {
    this.software = software;
    this.canvas = canvas;
    this.toolbar = toolbar;
    this.covered = 0;
    this.renderer = new THREE.WebGLRenderer({ canvas, antialias: !software, alpha: true });
    this.renderer.toneMapping = THREE.NeutralToneMapping;
    this.renderer.toneMappingExposure = 1.05;
    this.renderer.shadowMap.enabled = true;
    this.renderer.shadowMap.type = THREE.PCFShadowMap;
    // The light stands still: its shadows change with the mesh, not with the camera.
    this.renderer.shadowMap.autoUpdate = false;
    this.renderer.setPixelRatio(software ? 1 : Math.min(devicePixelRatio, 2));
    this.world = new THREE.Scene();
    this.camera = new THREE.PerspectiveCamera(32, 1, 0.01, 100);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.enableDamping = !calm();
    this.controls.dampingFactor = 0.12;
    this.controls.maxPolarAngle = Math.PI * 0.62;
    this.controls.addEventListener("change", () => this.invalidate());
    this.listeners = [];
    this.light();
    // Up is +y and front is +z in here, whatever the file's own axes are.
    this.stand = new THREE.Group();
    this.floor = new Floor();
    this.world.add(this.stand, this.floor.group);
    this.keys();
    new ResizeObserver(() => this.resize()).observe(canvas.parentElement);
    this.resize();
  }

  light() {
    if (this.software) this.world.add(new THREE.HemisphereLight(0xffffff, 0xc4beb4, 3));
    else this.world.environment = studio(this.renderer);
    this.world.environmentIntensity = 0.7;
    this.sun = new THREE.DirectionalLight(0xfff4e6, 1.9);
    this.sun.castShadow = true;
    this.sun.shadow.mapSize.setScalar(this.software ? 512 : 1024);
    this.sun.shadow.radius = 5;
    this.sun.shadow.normalBias = 0.02;
    this.rim = new THREE.DirectionalLight(0xdfe9ff, 0.7);
    this.world.add(this.sun, this.sun.target, this.rim, this.rim.target);
  }

  /** Show a figure in place of the last; `rotation` has the rows of its frame. */
  place(figure, rotation) {
    this.stand.clear();
    const rows = rotation ?? [[1, 0, 0], [0, 1, 0], [0, 0, 1]];
    const matrix = new THREE.Matrix4().set(...rows[0], 0, ...rows[1], 0, ...rows[2], 0, 0, 0, 0, 1);
    this.stand.quaternion.setFromRotationMatrix(matrix);
    this.stand.add(figure.root);
    this.stand.updateMatrixWorld(true);
    this.box = new THREE.Box3().setFromObject(figure.root, true);
    this.frame(false);
  }

  /** The floor and the shadow follow the mesh; `box` is in the stand's frame, in metres. */
  fit(box) {
    this.box = box;
    const size = box.getSize(new THREE.Vector3());
    const center = box.getCenter(new THREE.Vector3());
    this.radius = Math.max(size.length() / 2, 1e-6);
    this.floor.place(center, box.min.y, this.radius);
    this.sun.target.position.copy(center);
    this.sun.position.copy(center).addScaledVector(new THREE.Vector3(0.9, 2.1, 1.1).normalize(), 4 * this.radius);
    this.rim.target.position.copy(center);
    this.rim.position.copy(center).addScaledVector(new THREE.Vector3(-1.2, 0.8, -1), 3 * this.radius);
    const { camera } = this.sun.shadow;
    const reach = 1.5 * this.radius;
    Object.assign(camera, { left: -reach, right: reach, top: reach, bottom: -reach, near: this.radius, far: 8 * this.radius });
    camera.updateProjectionMatrix();
    this.sun.shadow.normalBias = 0.004 * this.radius;
    this.invalidate(true);
  }

  /** Look at all of the mesh, and at the lines around it. */
  frame(animated = !calm()) {
    this.fit(this.box);
    const center = this.box.getCenter(new THREE.Vector3());
    const distance = this.distance(center);
    const to = center.clone().addScaledVector(LOOK_FROM, distance);
    this.camera.near = distance / 100;
    this.camera.far = distance * 12;
    this.camera.updateProjectionMatrix();
    this.controls.minDistance = 0.2 * this.radius;
    this.controls.maxDistance = 6 * distance;
    if (animated) this.fly(to, center);
    else {
      this.camera.position.copy(to);
      this.controls.target.copy(center);
    }
    this.invalidate();
  }

  /** How far away all corners of the box, somewhat enlarged, are in the free part of the view. */
  distance(center) {
    const right = new THREE.Vector3(0, 1, 0).cross(LOOK_FROM).normalize();
    const up = LOOK_FROM.clone().cross(right);
    const free = 1 - this.covered / this.canvas.parentElement.clientHeight;
    const tall = Math.tan((this.camera.fov * Math.PI) / 360);
    const wide = 0.96 * tall * this.camera.aspect;
    const half = this.box.getSize(new THREE.Vector3()).divideScalar(2).addScalar(MARGIN * this.radius);
    let distance = 1.05 * this.radius;
    for (let corner = 0; corner < 8; corner += 1) {
      const at = new THREE.Vector3(corner & 1 ? 1 : -1, corner & 2 ? 1 : -1, corner & 4 ? 1 : -1).multiply(half);
      const near = at.dot(LOOK_FROM);
      distance = Math.max(distance, near + Math.abs(at.dot(right)) / wide, near + Math.abs(at.dot(up)) / (0.96 * tall * free));
    }
    return distance;
  }

  fly(to, target) {
    this.flight = { start: performance.now(), from: this.camera.position.clone(), to, eye: this.controls.target.clone(), target };
  }

  /** Draw with the next frame; the shadow anew where the mesh has `moved`. */
  invalidate(moved = false) {
    if (moved) this.renderer.shadowMap.needsUpdate = true;
    if (this.pending) return;
    this.pending = requestAnimationFrame(() => this.draw());
  }

  draw() {
    this.pending = 0;
    if (this.flight) {
      const { start, from, to, eye, target } = this.flight;
      const share = Math.min(1, (performance.now() - start) / 350);
      const eased = 1 - (1 - share) ** 3;
      this.camera.position.lerpVectors(from, to, eased);
      this.controls.target.lerpVectors(eye, target, eased);
      if (share === 1) this.flight = null;
      this.invalidate();
    }
    // Damping: as long as the camera glides, "change" asks for the next frame.
    this.controls.update();
    this.renderer.render(this.world, this.camera);
    for (const listener of this.listeners) listener();
  }

  onDraw(listener) {
    this.listeners.push(listener);
  }

  resize() {
    const { clientWidth: width, clientHeight: height } = this.canvas.parentElement;
    if (!width || !height) return;
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    // The toolbar lies over the lower edge: what is looked at stands in the middle of the rest.
    const bar = this.toolbar.getBoundingClientRect();
    this.covered = bar.height ? this.canvas.getBoundingClientRect().bottom - bar.top : 0;
    this.camera.setViewOffset(width, height, 0, this.covered / 2, width, height);
    this.invalidate();
  }

  /** Arrow keys turn, plus and minus zoom, 0 frames. */
  keys() {
    const turns = { ArrowLeft: [-0.12, 0], ArrowRight: [0.12, 0], ArrowUp: [0, -0.09], ArrowDown: [0, 0.09] };
    this.canvas.addEventListener("keydown", (event) => {
      if (event.ctrlKey || event.metaKey || event.altKey) return;
      if (event.key === "0") this.frame();
      const zoom = { "+": 0.88, "=": 0.88, "-": 1.14 }[event.key];
      if (!(event.key in turns) && !zoom) return;
      event.preventDefault();
      const offset = this.camera.position.clone().sub(this.controls.target);
      const place = new THREE.Spherical().setFromVector3(offset);
      const [theta, phi] = turns[event.key] ?? [0, 0];
      place.theta += theta;
      place.phi = THREE.MathUtils.clamp(place.phi + phi, 0.05, this.controls.maxPolarAngle);
      place.radius *= zoom ?? 1;
      this.camera.position.copy(this.controls.target).add(offset.setFromSpherical(place));
      this.invalidate();
    });
  }
}
