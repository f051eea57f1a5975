// Camera of the scene: fits source and sensors into the picture, follows them, and is moved by mouse, touch and keys.
import {PerspectiveCamera, Vector3} from 'three';
import {OrbitControls} from 'three/addons/controls/OrbitControls.js';

/// Directions from the target to the camera: x, y, height.
const kViews = {
  free: [-0.55, -0.75, 0.55],
  top: [-0.002, 0, 1],
  front: [-1, 0, 0.002],
  side: [0, -1, 0.002]
};
const kSource_m = 0.28, kSensor_m = 0.12;  // from the centre to the name of an axis
const kFitted = 0.85;                      // share of the free part of the picture that a fit fills
const kRounds = 8, kFar_m = 4, kNear_m = 0.5;
const kEase_s = 0.15;
const kTurn_rad = 0.12, kZoom = 1.15;  // of one key

/// Corners of the space that an object at p needs.
const around = (p, reach) => [[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]].map(
    d => new Vector3(...p).addScaledVector(new Vector3(...d), reach));

export class CameraView {
  /// moved(): draw again. freeArea(): {left, right, top, bottom} of the picture without texts, 0 to 1. taken(): the user took the camera.
  constructor(canvas, {moved, freeArea, taken}) {
    this.moved = moved;
    this.freeArea = freeArea;
    this.camera = new PerspectiveCamera(38, 1, 0.01, 50);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.addEventListener('change', moved);
    this.following = true;
    this.goal = null;
    this.steps = matchMedia('(prefers-reduced-motion: reduce)').matches;
    const take = () => {
      this.stay();
      taken();
    };
    this.controls.addEventListener('start', take);
    canvas.addEventListener('wheel', take, {passive: true});
    canvas.addEventListener('keydown', event => {
      if (event.ctrlKey || event.metaKey || event.altKey || !this.#key(event.key)) return;
      event.preventDefault();
      event.stopPropagation();
      take();
    });
    this.setUp(-1);
  }

  /// sign: of the z axis that points up in the picture.
  setUp(sign) {
    this.up = sign;
    this.camera.up.set(0, 0, sign);
    this.turn('free');
  }

  /// One of kViews. fit() then moves the camera.
  turn(name) {
    const [x, y, height] = kViews[name];
    const direction = new Vector3(x, y, this.up * height).normalize();
    this.#place(this.controls.target, direction, this.camera.position.distanceTo(this.controls.target) || 1);
    this.controls.update();
  }

  /// Follows no longer, and ends a movement that is under way.
  stay() {
    this.goal = null;
    this.following = false;
  }

  setAspect(aspect) {
    this.camera.aspect = aspect;
    this.camera.updateProjectionMatrix();
  }

  /// Half the height of the picture at a depth of 1 m.
  get half() { return Math.tan(this.camera.fov * Math.PI / 360); }

  /// Size of a pixel at a depth of 1 m. height: of the picture, pixels.
  pixel(height) { return 2 * this.half / height; }

  /// Fits the source and `points` (m), at once unless `eased`.
  fit(points, eased = false) {
    const corners = [...around([0, 0, 0], kSource_m), ...points.flatMap(p => around(p, kSensor_m))];
    const before = [this.camera.position.clone(), this.controls.target.clone()];
    const direction = before[0].clone().sub(before[1]).normalize();
    let distance = kFar_m;
    const target = corners.reduce((sum, p) => sum.add(p), new Vector3()).divideScalar(corners.length);
    const free = this.freeArea();
    for (let round = 0; round < kRounds; ++round) {
      this.#place(target, direction, distance);
      const {low, high} = this.#bounds(corners);
      const half = this.half * distance;
      const right = new Vector3().setFromMatrixColumn(this.camera.matrixWorld, 0), up = new Vector3().setFromMatrixColumn(this.camera.matrixWorld, 1);
      const scale = Math.max((high[0] - low[0]) / (free.right - free.left), (high[1] - low[1]) / (free.bottom - free.top)) / kFitted;
      // The middle of the points moves to the middle of the free part.
      const aside = (low[0] + high[0]) / 2 - 0.5 - ((free.left + free.right) / 2 - 0.5) * scale;
      const below = (low[1] + high[1]) / 2 - 0.5 - ((free.top + free.bottom) / 2 - 0.5) * scale;
      target.addScaledVector(right, 2 * half * this.camera.aspect * aside).addScaledVector(up, -2 * half * below);
      distance = Math.max(kNear_m, distance * scale);
    }
    this.#place(target, direction, distance);
    if (eased && !this.steps) {
      this.goal = {position: this.camera.position.clone(), target: target.clone()};
      this.camera.position.copy(before[0]);
      this.controls.target.copy(before[1]);
    } else {
      this.controls.target.copy(target);
      this.goal = null;
    }
    this.controls.update();
    this.moved();
  }

  /// Fits again if one of `now` left the free part of the picture. recent(): points of the last seconds.
  follow(now, recent) {
    if (!this.following || this.goal) return;
    const free = this.freeArea();
    const {low, high} = this.#bounds(now.flatMap(p => around(p, kSensor_m)));
    if (low[0] < free.left || high[0] > free.right || low[1] < free.top || high[1] > free.bottom) this.fit([...now, ...recent()], true);
  }

  /// Moves towards the goal. dt: seconds since the last picture.
  ease(dt) {
    if (!this.goal) return;
    const share = 1 - Math.exp(-dt / kEase_s);
    this.camera.position.lerp(this.goal.position, share);
    this.controls.target.lerp(this.goal.target, share);
    if (this.camera.position.distanceTo(this.goal.position) < 0.002) this.goal = null;
    this.controls.update();
    this.moved();
  }

  #place(target, direction, distance) {
    this.camera.position.copy(target).addScaledVector(direction, distance);
    this.camera.lookAt(target);
    this.camera.updateMatrixWorld();
  }

  /// Smallest and largest place in the picture: 0 to 1, from the left and from the top.
  #bounds(points) {
    const places = points.map(p => p.clone().project(this.camera)).map(({x, y, z}) => z > 1 ? [-9, -9] : [(x + 1) / 2, (1 - y) / 2]);
    return {low: [0, 1].map(k => Math.min(...places.map(p => p[k]))), high: [0, 1].map(k => Math.max(...places.map(p => p[k])))};
  }

  #key(key) {
    const arm = this.camera.position.clone().sub(this.controls.target);
    const about = {ArrowLeft: 1, ArrowRight: -1}[key], above = {ArrowUp: 1, ArrowDown: -1}[key], nearer = {'+': 1 / kZoom, '-': kZoom}[key];
    if (about)
      arm.applyAxisAngle(new Vector3(0, 0, this.up), about * kTurn_rad);
    else if (above) {
      const side = new Vector3().setFromMatrixColumn(this.camera.matrixWorld, 0);
      arm.applyAxisAngle(side, -above * kTurn_rad);
    } else if (nearer)
      arm.multiplyScalar(nearer);
    else
      return false;
    this.camera.position.copy(this.controls.target).add(arm);
    this.controls.update();
    this.moved();
    return true;
  }
}
