// 3D scene: the source and the sensors on a grid. z points down.
import {AmbientLight, Color, DirectionalLight, GridHelper, Group, Mesh, MeshLambertMaterial, PerspectiveCamera, Scene as ThreeScene, SphereGeometry, Vector3, WebGLRenderer} from 'three';
import {OrbitControls} from 'three/addons/controls/OrbitControls.js';

import {fieldLines} from './field_lines.js';
import {HemisphereView} from './hemisphere_view.js';
import {palette} from './palette.js';
import {SensorView} from './sensor_view.js';
import {dispose, label, triad} from './triad.js';

export const kGrid_mm = 100;
const kGridSize_m = 2;
const kMarks_m = [0.5, 1];  // labelled distances on the axes of the grid
const kLeastReach_m = 0.45;
const kMargin = 1.05;
/// Directions from the target to the camera.
const kViews = {
  free: [-0.55, -0.75, -0.55],
  top: [-0.002, 0, -1],
  front: [-1, 0, -0.002],
  side: [0, -1, -0.002]
};

export class Scene {
  constructor(canvas) {
    this.canvas = canvas;
    this.renderer = new WebGLRenderer({canvas, antialias: true, alpha: true});
    this.camera = new PerspectiveCamera(38, 1, 0.01, 50);
    this.camera.up.set(0, 0, -1);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.addEventListener('change', () => this.invalidate());
    this.scene = new ThreeScene();
    this.scene.add(new AmbientLight(0xffffff, 1.6));
    const sun = new DirectionalLight(0xffffff, 2.2);
    sun.position.set(-1, -2, -3);
    this.scene.add(sun);
    this.sensors = new Map();
    this.field = null;
    this.hemisphere = new HemisphereView();
    this.scene.add(this.hemisphere.group);
    this.metal = new Group();
    this.scene.add(this.metal);
    this.center = new Vector3(0.4, 0, 0);
    this.reach = 0.9;
    this.view('free');
    this.setTheme();
    new ResizeObserver(() => this.invalidate()).observe(canvas);
    this.renderer.setAnimationLoop(() => {
      if (this.stale) this.draw();
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

  /// Moves the camera to one of kViews, so that source and the points are in sight.
  view(name, points = []) {
    if (points.length) {
      const all = [[0, 0, 0], ...points];
      const [low, high] = [Math.min, Math.max].map(pick => [0, 1, 2].map(k => pick(...all.map(p => p[k]))));
      this.center.set(...low.map((v, k) => (v + high[k]) / 2));
      this.reach = Math.max(kLeastReach_m, Math.hypot(...low.map((v, k) => high[k] - v)) * 0.62 + 0.15);
    }
    const narrow = Math.max(1, this.canvas.clientHeight / Math.max(1, this.canvas.clientWidth));
    const distance = kMargin * this.reach * narrow / Math.tan(this.camera.fov * Math.PI / 360);
    this.controls.target.copy(this.center);
    this.camera.position.copy(this.center).addScaledVector(new Vector3(...kViews[name]).normalize(), distance);
    this.controls.update();
    this.invalidate();
  }

  /// Field lines of the coil about `axis`: x, y, z or none.
  showField(axis) {
    if (this.field) {
      this.scene.remove(this.field);
      dispose(this.field);
    }
    this.field = axis === 'none' ? null : fieldLines(axis, palette[axis]);
    this.fieldAxis = axis;
    if (this.field) this.scene.add(this.field);
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
      name.position.set(position_m[0], position_m[1], position_m[2] - radius_m - 0.03);
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
    if (this.fieldAxis) this.showField(this.fieldAxis);
    this.invalidate();
  }

  draw() {
    this.stale = false;
    const {clientWidth: width, clientHeight: height} = this.canvas;
    const ratio = Math.min(devicePixelRatio, 2);
    if (this.canvas.width !== Math.floor(width * ratio) || this.canvas.height !== Math.floor(height * ratio)) {
      this.renderer.setPixelRatio(ratio);
      this.renderer.setSize(width, height, false);
      this.camera.aspect = width / Math.max(height, 1);
      this.camera.updateProjectionMatrix();
    }
    for (const view of this.sensors.values()) view.trail.update(this.background);
    this.renderer.render(this.scene, this.camera);
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
