// 3D scene: the source and the sensors. z points down.
import {AmbientLight, DirectionalLight, GridHelper, PerspectiveCamera, Scene as ThreeScene, WebGLRenderer} from 'three';
import {OrbitControls} from 'three/addons/controls/OrbitControls.js';
import {SensorView, triad} from './sensor_view.js';

export class Scene {
  constructor(canvas) {
    this.canvas = canvas;
    this.renderer = new WebGLRenderer({canvas, antialias: true, alpha: true});
    this.camera = new PerspectiveCamera(45, 1, 0.01, 50);
    this.camera.up.set(0, 0, -1);
    this.camera.position.set(-0.7, -1.1, -0.8);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.target.set(0.4, 0, 0);
    this.scene = new ThreeScene();
    this.scene.add(new AmbientLight(0xffffff, 1.5));
    const sun = new DirectionalLight(0xffffff, 2);
    sun.position.set(-1, -2, -3);
    this.scene.add(sun);
    const grid = new GridHelper(2, 20, 0x888888, 0x888888);
    grid.rotation.x = Math.PI / 2;
    grid.material.transparent = true;
    grid.material.opacity = 0.35;
    this.scene.add(grid);
    this.scene.add(triad(0.2, 0.06, 0x777777));
    this.sensors = new Map();
    this.renderer.setAnimationLoop(() => this.draw());
  }

  /// View of a sensor; created at the first call.
  sensor(number) {
    if (!this.sensors.has(number)) {
      const view = new SensorView(number);
      this.sensors.set(number, view);
      this.scene.add(view.group);
    }
    return this.sensors.get(number);
  }

  draw() {
    const {clientWidth: width, clientHeight: height} = this.canvas;
    const ratio = Math.min(devicePixelRatio, 2);
    if (this.canvas.width !== Math.floor(width * ratio) || this.canvas.height !== Math.floor(height * ratio)) {
      this.renderer.setPixelRatio(ratio);
      this.renderer.setSize(width, height, false);
      this.camera.aspect = width / Math.max(height, 1);
      this.camera.updateProjectionMatrix();
    }
    this.controls.update();
    this.renderer.render(this.scene, this.camera);
  }
}
