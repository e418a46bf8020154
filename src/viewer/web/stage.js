// What is drawn: the surfaces, the carried mesh, points, pairs and arrows of one time, and the two ends beside it.

import {
  BufferAttribute, BufferGeometry, Color, ConeGeometry, CylinderGeometry, DirectionalLight, DoubleSide, HemisphereLight,
  InstancedMesh, LineBasicMaterial, LineSegments, Matrix4, Mesh, MeshBasicMaterial, MeshLambertMaterial,
  MeshStandardMaterial, PerspectiveCamera, Points, PointsMaterial, Quaternion, Scene, Vector3, WebGLRenderer,
} from 'three';
import { OrbitControls } from 'three/addons/controls/OrbitControls.js';
import { mergeGeometries } from 'three/addons/utils/BufferGeometryUtils.js';

import { THEMES, paint } from './colours.js';
import { blend, place } from './data.js';
import { lengths, nearest, quantile, strain, velocities } from './measures.js';

/** From where a shape is seen: turn about the axis that points up, and height over the horizon, in degrees. */
export const VIEWS = {
  oblique: [35, 14], front: [0, 0], back: [180, 0], right: [90, 0], left: [-90, 0], top: [0, 89.9], bottom: [0, -89.9],
};

const FIELD_OF_VIEW = 28;
const ARROWS = 420;

const positions = (values) => new BufferAttribute(values, 3);

function geometryOf({ frames, positions: still, triangles }) {
  const geometry = new BufferGeometry();
  const first = still || frames[0].slice();
  geometry.setAttribute('position', positions(first));
  geometry.setAttribute('color', positions(new Float32Array(first.length).fill(1)));
  if (triangles) {
    geometry.setIndex(new BufferAttribute(triangles, 1));
    geometry.computeVertexNormals();
  }
  return geometry;
}

function solid(geometry) {
  return new Mesh(geometry, new MeshStandardMaterial({ vertexColors: true, roughness: 0.72, metalness: 0.0, side: DoubleSide }));
}

function dots(geometry, size) {
  return new Points(geometry, new PointsMaterial({ vertexColors: true, size, sizeAttenuation: false }));
}

function plainPoints(values, size) {
  const geometry = new BufferGeometry();
  geometry.setAttribute('position', positions(values));
  return new Points(geometry, new PointsMaterial({ size, sizeAttenuation: false }));
}

/** An arrow of length 1 and width 1 along y. */
function arrow() {
  const shaft = new CylinderGeometry(0.2, 0.2, 0.72, 8).translate(0, 0.36, 0);
  const head = new ConeGeometry(0.55, 0.28, 12).translate(0, 0.86, 0);
  return mergeGeometries([shaft, head]);
}

/** A shape that moves, with its wireframe. */
class Moving {
  constructor(track, scene) {
    this.track = track;
    this.geometry = geometryOf(track);
    this.body = track.triangles ? solid(this.geometry) : dots(this.geometry, 3);
    this.wire = new Mesh(this.geometry, new MeshBasicMaterial({ wireframe: true, transparent: true, opacity: 0.28 }));
    this.known = new Map();
    scene.add(this.body, this.wire);
  }

  show(visible, wire) {
    this.body.visible = visible;
    this.wire.visible = visible && wire && !!this.track.triangles;
  }

  /** What `make` gives for frame k, made once. */
  at(name, k, make) {
    const key = `${name} ${k}`;
    if (!this.known.has(key)) this.known.set(key, make(this.track, k));
    return this.known.get(key);
  }

  speed(k) { return this.at('speed', k, (track) => lengths(velocities(track, k))); }

  strain(k) { return this.at('strain', k, strain); }

  moveTo(t) {
    this.where = place(this.track.times, t);
    blend(this.geometry.attributes.position.array, this.track.frames, this.where);
    this.geometry.attributes.position.needsUpdate = true;
    if (this.track.triangles) this.geometry.computeVertexNormals();
    this.geometry.boundingSphere = null;
  }

  /** Colours each vertex by a value, or all by one colour. */
  colour(plain, value, most) {
    const out = this.geometry.attributes.color.array;
    for (let k = 0; k < out.length; k += 3) {
      if (value) paint(out, k, most > 0 ? value(k / 3) / most : 0);
      else { out[k] = plain.r; out[k + 1] = plain.g; out[k + 2] = plain.b; }
    }
    this.geometry.attributes.color.needsUpdate = true;
  }
}

export class Stage {
  constructor(canvas, run) {
    this.run = run;
    this.renderer = new WebGLRenderer({ canvas, antialias: true, preserveDrawingBuffer: true });
    this.camera = new PerspectiveCamera(FIELD_OF_VIEW, 1, 0.01, 50);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.enableDamping = false;
    this.scenes = { source: new Scene(), now: new Scene(), target: new Scene() };
    this.lights = Object.values(this.scenes).map((scene) => {
      const [key, fill] = [new DirectionalLight(0xffffff, 2.2), new DirectionalLight(0xdfe8ff, 0.7)];
      scene.add(new HemisphereLight(0xffffff, 0x9a968e, 1.45), key, fill);
      return [key, fill];
    });
    this.build();
    this.up = 'y';
    this.look('oblique');
  }

  build() {
    const { run, scenes } = this;
    this.surfaces = run.surfaces.map((track) => new Moving(track, scenes.now));
    this.carried = run.carried && new Moving(run.carried, scenes.now);
    this.ends = {};
    for (const end of ['source', 'target']) {
      const body = run[end].triangles ? solid(geometryOf(run[end])) : dots(geometryOf(run[end]), 3);
      const wire = new Mesh(body.geometry, new MeshBasicMaterial({ wireframe: true, transparent: true, opacity: 0.28 }));
      const points = plainPoints(run[end].positions, 2.5);
      scenes[end].add(body, wire);
      scenes.now.add(points);
      this.ends[end] = { body, wire, points };
    }
    const pairs = new BufferGeometry();
    pairs.setAttribute('position', positions(run.pairs || new Float32Array(0)));
    pairs.setAttribute('color', positions(new Float32Array((run.pairs || []).length)));
    this.pairs = new LineSegments(pairs, new LineBasicMaterial({ vertexColors: true, transparent: true, opacity: 0.75 }));
    this.arrows = new InstancedMesh(arrow(), new MeshLambertMaterial(), ARROWS);
    this.arrows.frustumCulled = false;
    scenes.now.add(this.pairs, this.arrows);
    // Surfaces take their strain from the carried mesh, whose rest shape is known.
    if (this.carried && run.carried.triangles) {
      this.map = this.surfaces.map(({ track }) => {
        const [a, b, share] = place(run.carried.times, track.time);
        const there = new Float32Array(run.carried.frames[0].length);
        blend(there, run.carried.frames, [a, b, share]);
        const own = place(track.times, track.time), at = new Float32Array(track.frames[0].length);
        blend(at, track.frames, own);
        return () => nearest(at, there);
      });
    }
    this.most = {};
  }

  /** The scales on which values are shown: what 98 % of them lie below. */
  scaleOf(name) {
    if (name in this.most) return this.most[name];
    const all = [];
    const every = (moving, what) => moving.track.times.forEach((_, k) => all.push(moving[what](k)));
    if (name === 'speed') [this.carried, ...this.surfaces].forEach((moving) => moving && every(moving, 'speed'));
    else if (name === 'strain') every(this.carried, 'strain');
    else this.surfaces.forEach(({ track }) => all.push(track.values[name]));
    this.most[name] = quantile(all, 0.98);
    return this.most[name];
  }

  theme(name) {
    const colours = THEMES[name];
    this.colours = Object.fromEntries(Object.entries(colours).map(([key, hex]) => [key, new Color(hex)]));
    for (const scene of Object.values(this.scenes)) scene.background = this.colours.background;
    for (const end of ['source', 'target']) {
      const { body, wire, points } = this.ends[end];
      const out = body.geometry.attributes.color.array, colour = this.colours[end];
      for (let k = 0; k < out.length; k += 3) { out[k] = colour.r; out[k + 1] = colour.g; out[k + 2] = colour.b; }
      body.geometry.attributes.color.needsUpdate = true;
      wire.material.color = this.colours.wire;
      points.material.color = colour;
    }
    const lines = this.pairs.geometry.attributes.color.array;
    for (let k = 0; k < lines.length; k += 6) {
      this.colours.source.toArray(lines, k);
      this.colours.target.toArray(lines, k + 3);
    }
    this.pairs.geometry.attributes.color.needsUpdate = true;
    this.arrows.material.color = this.colours.ink;
    for (const moving of [...this.surfaces, this.carried]) if (moving) moving.wire.material.color = this.colours.wire;
  }

  /** A standard view, at a distance from which everything is seen. */
  look(name) {
    const [turn, height] = VIEWS[name].map((angle) => (angle * Math.PI) / 180);
    const flat = Math.cos(height), across = [Math.sin(turn) * flat, Math.cos(turn) * flat], over = Math.sin(height);
    const from = this.up === 'y' ? [across[0], over, across[1]] : [across[0], -across[1], over];
    this.camera.up.set(0, this.up === 'y' ? 1 : 0, this.up === 'y' ? 0 : 1);
    this.controls.target.set(0, 0, 0);
    const sides = this.run.box.sides.map((side) => side / this.run.span);
    const reach = Math.hypot(...sides) / 2;
    // A box is seldom filled to its corners.
    this.camera.position.set(...from).multiplyScalar((0.78 * reach) / Math.sin((FIELD_OF_VIEW * Math.PI) / 360));
    this.controls.dispose();
    this.controls = new OrbitControls(this.camera, this.renderer.domElement);
    this.controls.addEventListener('change', () => this.onTurn && this.onTurn());
    this.controls.update();
  }

  zoom(by) {
    this.camera.position.sub(this.controls.target).multiplyScalar(by).add(this.controls.target);
    this.controls.update();
  }

  turn(right, up) {
    const at = this.camera.position.clone().sub(this.controls.target);
    const axis = this.camera.up.clone().normalize();
    at.applyAxisAngle(axis, right);
    const side = new Vector3().crossVectors(axis, at).normalize();
    const before = at.angleTo(axis);
    if (before - up > 0.05 && before - up < Math.PI - 0.05) at.applyAxisAngle(side, -up);
    this.camera.position.copy(at.add(this.controls.target));
    this.controls.update();
  }

  /** The number of the surface whose time is the nearest. */
  nearestSurface(t) {
    let best = 0;
    this.surfaces.forEach(({ track }, k) => {
      if (Math.abs(track.time - t) < Math.abs(this.surfaces[best].track.time - t)) best = k;
    });
    return best;
  }

  valueOf(moving, name, index) {
    const [a, b, share] = moving.where;
    const mix = (of) => { const [x, y] = [of(a), of(b)]; return (k) => x[k] + share * (y[k] - x[k]); };
    if (name === 'speed') return moving.track.times.length > 1 ? mix((k) => moving.speed(k)) : null;
    if (name === 'strain') {
      if (moving === this.carried) return mix((k) => moving.strain(k));
      if (!this.map) return null;
      const near = moving.at('near', 0, () => this.map[index]());
      const [c, d, part] = place(this.run.carried.times, this.t);
      const [x, y] = [this.carried.strain(c), this.carried.strain(d)];
      return (k) => x[near[k]] + part * (y[near[k]] - x[near[k]]);
    }
    const values = moving.track.values[name];
    return values && ((k) => values[k]);
  }

  /** Puts everything where it is at a time, and shows what is asked for. */
  set(t, { show, colour }) {
    this.t = t;
    const now = this.surfaces.length ? this.nearestSurface(t) : -1;
    const value = (moving, index) => (colour === 'plain' ? null : this.valueOf(moving, colour, index));
    const most = colour === 'plain' ? 0 : this.scaleOf(colour);
    this.surfaces.forEach((moving, k) => {
      const visible = k === now && show.has('surface');
      moving.show(visible, show.has('wireframe'));
      if (!visible) return;
      moving.moveTo(t);
      moving.colour(this.colours.surface, value(moving, k), most);
    });
    if (this.carried) {
      this.carried.show(show.has('carried'), show.has('wireframe'));
      this.carried.moveTo(t);
      if (show.has('carried')) this.carried.colour(this.colours.carried, value(this.carried, 0), most);
    }
    for (const { wire, points } of Object.values(this.ends)) {
      wire.visible = show.has('wireframe');
      points.visible = show.has('points');
    }
    this.pairs.visible = show.has('pairs');
    this.arrows.visible = show.has('arrows');
    if (this.arrows.visible) this.point(this.carried || this.surfaces[now]);
    this.beside = show.has('beside');
  }

  /** Arrows along the velocity at some of the vertices. */
  point(moving) {
    const { track } = moving;
    if (moving !== this.carried) moving.moveTo(this.t);
    const [a, b, share] = moving.where;
    const of = (k) => moving.at('velocity', k, velocities);
    const [v, w] = [of(a), of(b)], x = moving.geometry.attributes.position.array;
    const count = x.length / 3, stride = Math.max(1, Math.ceil(count / ARROWS));
    const scale = 0.13 / Math.max(1e-9, this.scaleOf('speed'));
    const [matrix, turn, along, up] = [new Matrix4(), new Quaternion(), new Vector3(), new Vector3(0, 1, 0)];
    let made = 0;
    for (let k = 0; k < count && made < ARROWS; k += stride) {
      along.set(...[0, 1, 2].map((axis) => v[3 * k + axis] + share * (w[3 * k + axis] - v[3 * k + axis])));
      const length = Math.min(0.2, along.length() * scale);
      if (length < 0.003) continue;
      const wide = Math.min(0.012, 0.3 * length);
      turn.setFromUnitVectors(up, along.normalize());
      const at = new Vector3(x[3 * k], x[3 * k + 1], x[3 * k + 2]);
      this.arrows.setMatrixAt(made++, matrix.compose(at, turn, new Vector3(wide, length, wide)));
    }
    this.arrows.count = made;
    this.arrows.instanceMatrix.needsUpdate = true;
  }

  resize(width, height, ratio) {
    this.renderer.setPixelRatio(ratio);
    this.renderer.setSize(width, height, false);
    [this.width, this.height] = [width, height];
  }

  render() {
    for (const [key, fill] of this.lights) {
      const offset = (x, y, z) => new Vector3(x, y, z).applyQuaternion(this.camera.quaternion);
      key.position.copy(offset(-0.55, 0.85, 0.9));
      fill.position.copy(offset(0.9, 0.1, 0.35));
    }
    const names = this.beside ? ['source', 'now', 'target'] : ['now'];
    const width = this.width / names.length;
    this.aspect = width / Math.max(1, this.height);
    this.camera.aspect = this.aspect;
    // The field of view is that of the shorter side, so that narrow panels cut nothing off.
    const half = Math.tan((FIELD_OF_VIEW * Math.PI) / 360) / Math.min(1, this.aspect);
    this.camera.fov = (2 * Math.atan(half) * 180) / Math.PI;
    this.camera.updateProjectionMatrix();
    this.renderer.setScissorTest(true);
    names.forEach((name, k) => {
      const [left, right] = [Math.round(k * width), Math.round((k + 1) * width)];
      this.renderer.setViewport(left, 0, right - left, this.height);
      this.renderer.setScissor(left, 0, right - left, this.height);
      this.renderer.render(this.scenes[name], this.camera);
    });
  }
}
