// One shape in its own view: drawn, turned, and asked which vertex is under the pointer.

import {
  BufferAttribute, BufferGeometry, Color, DirectionalLight, DoubleSide, Fog, HemisphereLight, Mesh, MeshBasicMaterial,
  MeshStandardMaterial, PerspectiveCamera, Points, PointsMaterial, Scene, ShaderMaterial, Vector3, WebGLRenderer,
  WebGLRenderTarget,
} from 'three';
import { OrbitControls } from 'three/addons/controls/OrbitControls.js';

import { THEMES } from './colours.js';
import { cornerAt, pointAt } from './pick_ray.js';
import { VIEWS } from './stage.js';

const FIELD_OF_VIEW = 28;
/** A press that moves no further than this, in pixels, is a click. */
const STILL = { mouse: 4, pen: 8, touch: 12 };
/** How near a point of a cloud or a marker must be to the pointer, in pixels. */
const REACH = { mouse: 10, pen: 14, touch: 24 };
/** Points this far behind the first one, as a share of the box, are another layer of a cloud. */
const LAYER = 0.06;
/** The distance that the depth map ends at, and how much nearer than a vertex its surface must be to hide it. */
const FARTHEST = 32, HIDING = 0.006;

/** Distances to the camera as three bytes. */
const depths = () => new ShaderMaterial({
  side: DoubleSide,
  vertexShader: 'varying float depth; void main() { vec4 place = modelViewMatrix * vec4(position, 1.0); depth = -place.z; gl_Position = projectionMatrix * place; }',
  fragmentShader: `varying float depth; void main() {
    float whole = floor(clamp(depth / ${FARTHEST.toFixed(1)}, 0.0, 1.0) * 16777215.0);
    gl_FragColor = vec4(mod(whole, 256.0), mod(floor(whole / 256.0), 256.0), floor(whole / 65536.0), 255.0) / 255.0; }`,
});

export class Panel {
  /** `onPick` and `onHover` receive a vertex or -1, and the kind of the pointer; `onTurn` nothing. */
  constructor(canvas, side, shape, { onPick, onHover, onTurn }) {
    Object.assign(this, { canvas, side, shape, onTurn });
    this.count = shape.positions.length / 3;
    this.renderer = new WebGLRenderer({ canvas, antialias: true, preserveDrawingBuffer: true });
    this.camera = new PerspectiveCamera(FIELD_OF_VIEW, 1, 0.01, 50);
    this.scene = new Scene();
    this.hidden = new Set();
    // Whether the shape has to be drawn anew, and its depth map with it.
    [this.stale, this.map] = [true, null];
    this.up = 'y';
    this.build();
    this.listen(onPick, onHover);
  }

  build() {
    const { positions, triangles } = this.shape;
    const geometry = new BufferGeometry();
    geometry.setAttribute('position', new BufferAttribute(positions, 3));
    this.lights = [new DirectionalLight(0xffffff, 2.2), new DirectionalLight(0xdfe8ff, 0.7)];
    this.scene.add(new HemisphereLight(0xffffff, 0x9a968e, 1.45), ...this.lights);
    if (triangles) {
      geometry.setIndex(new BufferAttribute(triangles, 1));
      geometry.computeVertexNormals();
      this.body = new Mesh(geometry, new MeshStandardMaterial({ roughness: 0.72, side: DoubleSide, polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1 }));
      this.wire = new Mesh(geometry, new MeshBasicMaterial({ wireframe: true, transparent: true, opacity: 0.3 }));
      this.wire.visible = false;
      this.scene.add(this.wire);
      this.depth = { scene: new Scene(), target: new WebGLRenderTarget(1, 1) };
      this.depth.scene.add(new Mesh(geometry, depths()));
      // Where nothing is, nothing hides.
      this.depth.scene.background = new Color(0xffffff);
    } else {
      const size = Math.min(6, Math.max(2, 330 / Math.sqrt(this.count)));
      this.body = new Points(geometry, new PointsMaterial({ size, sizeAttenuation: false }));
    }
    this.scene.add(this.body);
  }

  theme(name) {
    const colours = THEMES[name];
    this.scene.background = new Color(colours.background);
    this.body.material.color = new Color(colours[this.side]);
    if (this.wire) this.wire.material.color = new Color(colours.wire);
    // Depth in a cloud, which has no shading.
    else this.scene.fog = new Fog(colours.background, 1, 4);
    this.spoil();
  }

  listen(onPick, onHover) {
    let pressed = null, waiting = 0, cost = 0;
    const at = (event) => {
      const box = this.canvas.getBoundingClientRect();
      return { x: event.clientX - box.left, y: event.clientY - box.top, kind: event.pointerType || 'mouse' };
    };
    const fingers = new Set();
    this.canvas.addEventListener('pointerdown', (event) => {
      fingers.add(event.pointerId);
      pressed = fingers.size === 1 && event.button === 0 ? at(event) : null;
    });
    const ended = (event) => fingers.delete(event.pointerId);
    this.canvas.addEventListener('pointercancel', (event) => { ended(event); pressed = null; });
    this.canvas.addEventListener('pointerup', (event) => {
      ended(event);
      const now = at(event), from = pressed;
      pressed = null;
      if (from && Math.hypot(now.x - from.x, now.y - from.y) <= STILL[now.kind]) onPick(now);
    });
    this.canvas.addEventListener('pointermove', (event) => {
      if (event.pointerType === 'touch') return;
      clearTimeout(waiting);
      const now = at(event);
      if (pressed) return onHover(-1);
      // A large mesh is asked once the pointer rests.
      waiting = setTimeout(() => {
        const began = performance.now();
        onHover(this.vertexAt(now));
        cost = performance.now() - began;
      }, cost > 12 ? 90 : 0);
    });
    this.canvas.addEventListener('pointerleave', () => { clearTimeout(waiting); onHover(-1); });
  }

  /** The vertex under a place of the canvas, -1 if there is none. */
  vertexAt({ x, y, kind }) {
    const { positions, triangles } = this.shape;
    this.camera.updateMatrixWorld();
    if (!triangles) {
      const matrix = this.camera.projectionMatrix.clone().multiply(this.camera.matrixWorldInverse).elements;
      return pointAt(positions, matrix, { x, y, width: this.width, height: this.height }, REACH[kind], LAYER);
    }
    const along = new Vector3((2 * x) / this.width - 1, 1 - (2 * y) / this.height, 0.5).unproject(this.camera);
    along.sub(this.camera.position).normalize();
    return cornerAt(positions, triangles, this.camera.position.toArray(), along.toArray());
  }

  /** Where a vertex is on the canvas, in pixels, and how far from the camera. */
  project(vertex) {
    const place = new Vector3().fromArray(this.shape.positions, 3 * vertex).applyMatrix4(this.camera.matrixWorldInverse);
    const depth = -place.z;
    place.applyMatrix4(this.camera.projectionMatrix);
    return { x: (0.5 + 0.5 * place.x) * this.width, y: (0.5 - 0.5 * place.y) * this.height, depth };
  }

  /** The first of these vertices whose marker is under a place of the canvas, -1 if there is none. */
  markerAt({ x, y, kind }, vertices) {
    const is_there = (vertex) => {
      if (vertex === null || this.hidden.has(vertex)) return false;
      const place = this.project(vertex);
      return Math.hypot(place.x - x, place.y - y) < REACH[kind];
    };
    return vertices.findIndex(is_there);
  }

  /** Finds which of these vertices the surface hides from here. A cloud hides none. */
  lookForHidden(vertices) {
    this.hidden = new Set();
    if (!this.depth || !vertices.length) return;
    const { scale, width, height, bytes } = this.map || (this.map = this.measured());
    for (const vertex of vertices) {
      const { x, y, depth } = this.project(vertex);
      const [column, row] = [Math.floor(x * scale), height - 1 - Math.floor(y * scale)];
      if (column < 0 || row < 0 || column >= width || row >= height) continue;
      const k = 4 * (row * width + column);
      const surface = (FARTHEST * (bytes[k] + 256 * bytes[k + 1] + 65536 * bytes[k + 2])) / 16777215;
      if (surface < depth - HIDING * 2) this.hidden.add(vertex);
    }
  }

  /** How far the surface is from the camera, at each pixel of a small picture. */
  measured() {
    const { scene, target } = this.depth, scale = Math.min(1, 700 / Math.max(this.width, this.height));
    const [width, height] = [this.width, this.height].map((side) => Math.max(1, Math.round(side * scale)));
    target.setSize(width, height);
    const bytes = new Uint8Array(4 * width * height);
    this.renderer.setRenderTarget(target);
    this.renderer.render(scene, this.camera);
    this.renderer.readRenderTargetPixels(target, 0, 0, width, height, bytes);
    this.renderer.setRenderTarget(null);
    return { scale, width, height, bytes };
  }

  /** The view or the look has changed: all is drawn anew. */
  spoil() { [this.stale, this.map] = [true, null]; }

  /** A standard view, at a distance from which everything is seen. */
  look(name, up) {
    this.up = up;
    const [turn, height] = VIEWS[name].map((angle) => (angle * Math.PI) / 180);
    const flat = Math.cos(height), across = [Math.sin(turn) * flat, Math.cos(turn) * flat], over = Math.sin(height);
    const from = up === 'y' ? [across[0], over, across[1]] : [across[0], -across[1], over];
    this.camera.up.set(0, up === 'y' ? 1 : 0, up === 'y' ? 0 : 1);
    const reach = Math.max(0.1, Math.hypot(...this.shape.sides) / 2);
    this.camera.position.set(...from).multiplyScalar((0.95 * reach) / Math.sin((FIELD_OF_VIEW * Math.PI) / 360));
    this.control([0, 0, 0]);
    this.spoil();
  }

  /** The view of another panel, whose box has the same size. */
  follow({ camera, controls, up }) {
    const turned = this.up !== up;
    this.spoil();
    this.up = up;
    this.camera.up.copy(camera.up);
    this.camera.position.copy(camera.position);
    if (turned) return this.control(controls.target.toArray());
    this.controls.target.copy(controls.target);
    this.camera.lookAt(this.controls.target);
  }

  control(target) {
    if (this.controls) this.controls.dispose();
    this.controls = new OrbitControls(this.camera, this.canvas);
    this.controls.enableDamping = false;
    this.controls.target.set(...target);
    this.controls.addEventListener('change', () => { this.spoil(); this.onTurn(); });
    this.controls.update();
    this.camera.lookAt(this.controls.target);
  }

  zoom(by) {
    this.camera.position.sub(this.controls.target).multiplyScalar(by).add(this.controls.target);
    this.controls.update();
    this.spoil();
    this.onTurn();
  }

  turn(right, up) {
    const at = this.camera.position.clone().sub(this.controls.target), axis = this.camera.up.clone().normalize();
    at.applyAxisAngle(axis, right);
    const before = at.angleTo(axis);
    if (before - up > 0.05 && before - up < Math.PI - 0.05) at.applyAxisAngle(new Vector3().crossVectors(axis, at).normalize(), -up);
    this.camera.position.copy(at.add(this.controls.target));
    this.controls.update();
    this.spoil();
    this.onTurn();
  }

  resize(ratio) {
    [this.width, this.height] = [Math.max(1, this.canvas.clientWidth), Math.max(1, this.canvas.clientHeight)];
    this.renderer.setPixelRatio(ratio);
    this.renderer.setSize(this.width, this.height, false);
    this.camera.aspect = this.width / this.height;
    // The field of view is that of the shorter side, so that a narrow panel cuts nothing off.
    const half = Math.tan((FIELD_OF_VIEW * Math.PI) / 360) / Math.min(1, this.camera.aspect);
    this.camera.fov = (2 * Math.atan(half) * 180) / Math.PI;
    this.camera.updateProjectionMatrix();
    this.spoil();
  }

  /** Draws the shape if it has changed. */
  render() {
    if (!this.stale) return;
    this.stale = false;
    this.lights.forEach((light, k) => light.position.set(...[[-0.55, 0.85, 0.9], [0.9, 0.1, 0.35]][k]).applyQuaternion(this.camera.quaternion));
    if (this.scene.fog) {
      const away = this.camera.position.distanceTo(this.controls.target), reach = Math.hypot(...this.shape.sides) / 2;
      [this.scene.fog.near, this.scene.fog.far] = [away - reach, away + 2.2 * reach];
    }
    this.renderer.render(this.scene, this.camera);
  }
}
