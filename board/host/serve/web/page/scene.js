// 3D scene: the source and the sensors on a grid.
import {AmbientLight, Color, DirectionalLight, GridHelper, Group, Mesh, MeshLambertMaterial, Scene as ThreeScene, SphereGeometry, WebGLRenderer} from 'three';

import {CameraView} from './camera_view.js';
import {fieldLines} from './field_lines.js';
import {HemisphereView} from './hemisphere_view.js';
import {palette} from './palette.js';
import {SensorView} from './sensor_view.js';
import {dispose, keepLegible, label, triad} from './triad.js';

export const kGrid_mm = 100;
const kGridSize_m = 2;
const kMarks_m = [0.5, 1];  // labelled distances on the axes of the grid
const kFieldAxes = {
  none: '',
  x: 'x',
  y: 'y',
  z: 'z',
  all: 'xyz'
};

/// True if there is no graphics processor: smooth edges would then cost a third of the frames.
function isSoftware() {
  const gl = document.createElement('canvas').getContext('webgl2');
  const info = gl?.getExtension('WEBGL_debug_renderer_info');
  const name = info ? gl.getParameter(info.UNMASKED_RENDERER_WEBGL) : '';
  gl?.getExtension('WEBGL_lose_context')?.loseContext();
  return /SwiftShader|llvmpipe|softpipe|Basic Render/.test(name);
}

export class Scene {
  /// freeArea(), taken(): of CameraView. measure(ms): time of a drawing.
  constructor(canvas, {freeArea, taken, measure}) {
    this.canvas = canvas;
    this.renderer = new WebGLRenderer({canvas, antialias: !isSoftware(), alpha: true});
    this.view = new CameraView(canvas, {moved: () => this.invalidate(), freeArea, taken});
    this.scene = new ThreeScene();
    this.scene.add(new AmbientLight(0xffffff, 1.6));
    this.sun = new DirectionalLight(0xffffff, 2.2);
    this.scene.add(this.sun);
    this.sensors = new Map();
    this.field = new Group();
    this.fieldAxis = 'none';
    this.scene.add(this.field);
    this.hemisphere = new HemisphereView();
    this.scene.add(this.hemisphere.group);
    this.metal = new Group();
    this.scene.add(this.metal);
    this.setUp(-1);
    this.setTheme();
    this.#resize();
    new ResizeObserver(() => this.#resize()).observe(canvas);
    let drawnMs = 0;
    this.renderer.setAnimationLoop(() => {
      const ms = performance.now();
      if (!this.stale || this.height === 0) return;
      this.view.ease(Math.min(0.1, (ms - drawnMs) / 1000));
      drawnMs = ms;
      this.draw();
      measure(performance.now() - ms);
    });
  }

  /// The next frame draws the scene again. Without changes nothing is drawn, which saves power.
  invalidate() { this.stale = true; }

  /// View of a sensor; created at the first call.
  sensor(number) {
    if (!this.sensors.has(number)) {
      const view = new SensorView(number);
      this.sensors.set(number, view);
      this.scene.add(view.group);
      for (const each of this.sensors.values()) each.name.visible = this.sensors.size > 1;
    }
    return this.sensors.get(number);
  }

  /// sign: of the z axis that points up in the picture.
  setUp(sign) {
    this.view.setUp(sign);
    this.sun.position.set(-1, -2, 3 * sign);
    this.invalidate();
  }

  /// Field lines of the coil about `axis`: x, y, z, all or none.
  showField(axis) {
    dispose(this.field);
    this.field.clear();
    this.fieldAxis = axis;
    for (const name of kFieldAxes[axis]) this.field.add(fieldLines(name, palette[name], axis === 'all'));
    this.invalidate();
  }

  /// Spheres of metal of a simulation: [{position_m, radius_m}].
  showMetal(spheres) {
    dispose(this.metal);
    this.metal.clear();
    for (const {position_m, radius_m} of spheres) {
      const sphere = new Mesh(new SphereGeometry(radius_m, 40, 24), new MeshLambertMaterial({color: palette.core, transparent: true, opacity: 0.85}));
      const name = label('metal', 0.045, palette.muted);
      sphere.position.set(...position_m);
      name.position.set(position_m[0], position_m[1], position_m[2] + this.view.up * (radius_m + 0.03));
      this.metal.add(sphere, name);
    }
    this.invalidate();
  }

  setTheme() {
    if (this.surroundings) {
      this.scene.remove(this.surroundings);
      dispose(this.surroundings);
    }
    this.surroundings = surroundings();
    this.scene.add(this.surroundings);
    for (const view of this.sensors.values()) {
      view.setTheme();
      view.name.visible = this.sensors.size > 1;
    }
    const behind = new Color(palette.canvas);
    this.background = behind.toArray();
    this.showField(this.fieldAxis);
    this.invalidate();
  }

  draw() {
    this.stale = this.view.goal !== null;
    const {camera} = this.view, pixel = this.view.pixel(this.height);
    for (const view of this.sensors.values()) view.updateTrails(this.background, camera, pixel);
    keepLegible(this.scene, camera, pixel);
    this.renderer.render(this.scene, camera);
  }

  #resize() {
    const {clientWidth: width, clientHeight: height} = this.canvas;
    this.height = height;
    if (width === 0 || height === 0) return;
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.renderer.setSize(width, height, false);
    this.view.setAspect(width / height);
    this.invalidate();
  }
}

/// Grid, its distances, and the source.
function surroundings() {
  const group = new Group();
  const grid = new GridHelper(kGridSize_m, kGridSize_m * 1000 / kGrid_mm, palette.muted, palette.grid);
  grid.rotation.x = Math.PI / 2;
  grid.material.transparent = true;
  grid.material.opacity = 0.75;
  group.add(grid, triad(0.09, 0.24, 0.06));
  for (const mark of kMarks_m) {
    for (const [p, sign] of [[[mark, 0.05, 0], 1], [[-mark, 0.05, 0], -1]]) {
      const text = label(`${sign < 0 ? '−' : ''}${mark} m`, 0.038, palette.muted);
      text.position.set(...p);
      group.add(text);
    }
  }
  return group;
}
