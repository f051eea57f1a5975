// The source's triad, the sensor with its trail, and where it may be: the ellipsoid of its covariance. z points down.
import {AmbientLight, AxesHelper, BoxGeometry, BufferAttribute, BufferGeometry, DirectionalLight, DynamicDrawUsage, GridHelper, Group, Line,
        LineBasicMaterial, Matrix4, Mesh, MeshBasicMaterial, MeshLambertMaterial, PerspectiveCamera, Scene as ThreeScene, SphereGeometry,
        WebGLRenderer} from 'three';
import {OrbitControls} from 'three/addons/controls/OrbitControls.js';

const kTrail = 600;
const kSigmas = 3;
const kExaggeration = 20;

/// Lower triangle L of a covariance given as [xx, xy, xz, yy, yz, zz]: L of the unit sphere is its ellipsoid.
function cholesky([xx, xy, xz, yy, yz, zz]) {
  const a = Math.sqrt(Math.max(xx, 1e-14));
  const b = xy / a, c = xz / a;
  const d = Math.sqrt(Math.max(yy - b*b, 1e-14));
  const e = (yz - b*c) / d;
  return [a, b, d, c, e, Math.sqrt(Math.max(zz - c*c - e*e, 1e-14))];
}

function triad(size, box, color) {
  const group = new Group();
  group.add(new AxesHelper(size));
  group.add(new Mesh(new BoxGeometry(box, box, box), new MeshLambertMaterial({color})));
  return group;
}

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
    this.sensor = triad(0.1, 0.025, 0x3388ff);
    this.scene.add(this.sensor);
    this.ellipsoid = new Mesh(new SphereGeometry(1, 24, 16),
                              new MeshBasicMaterial({color: 0xff8800, transparent: true, opacity: 0.35, depthWrite: false}));
    this.ellipsoid.matrixAutoUpdate = false;
    this.scene.add(this.ellipsoid);
    this.trail = new BufferAttribute(new Float32Array(3 * kTrail), 3).setUsage(DynamicDrawUsage);
    this.trailLength = 0;
    const geometry = new BufferGeometry().setAttribute('position', this.trail);
    this.line = new Line(geometry, new LineBasicMaterial({color: 0x3388ff}));
    this.line.frustumCulled = false;
    this.scene.add(this.line);
    this.renderer.setAnimationLoop(() => this.draw());
  }

  show(pose, q) {
    this.sensor.position.set(...pose.p);
    this.sensor.quaternion.set(q[1], q[2], q[3], q[0]);
    this.sensor.visible = this.ellipsoid.visible = pose.valid;
    const scale = kSigmas * kExaggeration;
    const [a, b, d, c, e, f] = cholesky(pose.c).map(v => Math.min(scale * v, 1));
    this.ellipsoid.matrix = new Matrix4().set(a, 0, 0, pose.p[0], b, d, 0, pose.p[1], c, e, f, pose.p[2], 0, 0, 0, 1);
    if (pose.valid) this.extendTrail(pose.p);
  }

  extendTrail(p) {
    const points = this.trail.array;
    if (this.trailLength === kTrail) points.copyWithin(0, 3);
    else ++this.trailLength;
    points.set(p, 3 * (this.trailLength - 1));
    this.trail.needsUpdate = true;
    this.line.geometry.setDrawRange(0, this.trailLength);
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
