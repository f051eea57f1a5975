// Sensor in the scene: triad, covariance ellipsoid, trail, and a plumb line to the grid.
import {BufferAttribute, BufferGeometry, Color, Group, Line, LineDashedMaterial, Matrix4} from 'three';

import {drawnFactor, ellipsoidMesh} from './ellipsoid.js';
import {errorColor, palette} from './palette.js';
import {nameOf} from './state.js';
import {RibbonTrail} from './trail.js';
import {dispose, label, triad} from './triad.js';
import {TruthView} from './truth_view.js';

const kBody_m = 0.03, kAxes_m = 0.11, kText_m = 0.045;

export class SensorView {
  constructor(number) {
    this.number = number;
    this.ellipsoid = ellipsoidMesh();
    this.trail = new RibbonTrail();
    this.plumb = new Line(
        new BufferGeometry().setAttribute('position', new BufferAttribute(new Float32Array(6), 3)),
        new LineDashedMaterial({dashSize: 0.012, gapSize: 0.012}));
    this.plumb.frustumCulled = false;
    this.truth = new TruthView();
    this.group = new Group();
    this.group.add(this.truth.group, this.ellipsoid, this.trail.line, this.plumb);
    this.setTheme();
    this.setVisible(false);
  }

  setTheme() {
    this.truth.setTheme();
    const visible = this.triad?.visible ?? false;
    const [position, quaternion] = [this.triad?.position.clone(), this.triad?.quaternion.clone()];
    if (this.triad) {
      this.group.remove(this.triad);
      dispose(this.triad);
    }
    this.triad = triad(kBody_m, kAxes_m, kText_m);
    this.name = label(nameOf(this.number), 1.2 * kText_m, palette.ink);
    this.name.position.set(-kText_m, -kText_m, -kText_m);
    this.name.visible = false;
    this.triad.add(this.name);
    if (position) {
      this.triad.position.copy(position);
      this.triad.quaternion.copy(quaternion);
    }
    this.triad.visible = visible;
    this.plumb.material.color = new Color(palette.muted);
    this.group.add(this.triad);
  }

  /// Draws a pose with the attitude q. An invalid pose hides the sensor; its trail and its truth remain. errorScale: of the
  /// ellipsoid and of the arrow of the error.
  show(pose, q, errorScale) {
    this.setVisible(pose.valid);
    this.truth.show(pose, errorScale);
    if (!pose.valid) return;
    const p = pose.position_m;
    this.triad.position.set(...p);
    this.triad.quaternion.set(q[1], q[2], q[3], q[0]);
    const [a, b, d, c, e, f] = drawnFactor(pose.covariance, errorScale);
    this.ellipsoid.matrix = new Matrix4().set(a, 0, 0, p[0], b, d, 0, p[1], c, e, f, p[2], 0, 0, 0, 1);
    this.ellipsoid.material.uniforms.color.value.setRGB(...errorColor(pose.expected_mm), 'srgb');
    this.plumb.geometry.attributes.position.array.set([...p, p[0], p[1], 0]);
    this.plumb.geometry.attributes.position.needsUpdate = true;
    this.plumb.computeLineDistances();
  }

  /// Continues the trails by a valid pose. begins: there is a gap before it.
  add(pose, errorScale, begins) {
    this.trail.add(pose.position_m, pose.t, pose.expected_mm, begins);
    this.truth.add(pose, errorScale, begins);
  }

  /// background, camera, pixel: of Trail.update.
  updateTrails(...view) {
    this.trail.update(...view);
    this.truth.tips.update(...view);
  }

  clearTrails() {
    this.trail.clear();
    this.truth.tips.clear();
  }

  setVisible(visible) {
    this.triad.visible = this.ellipsoid.visible = this.plumb.visible = visible;
    if (!visible) this.truth.hide();
  }
}
