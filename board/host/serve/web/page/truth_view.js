// The true sensor of a simulation, pale in a ball, and the error of the estimate as an arrow, drawn to a stated scale, with the trail
// of its tip: the path with enlarged errors. Both are labelled, in the colour of errors.
import {ConeGeometry, CylinderGeometry, Group, Mesh, MeshBasicMaterial, Quaternion, SphereGeometry, Vector3} from 'three';

import {palette} from './palette.js';
import {ThinTrail} from './trail.js';
import {dispose, label, triad} from './triad.js';

const kBody_m = 0.03, kAxes_m = 0.11;  // as those of the sensor
const kRadius_m = 0.006, kHead_m = 0.03;
const kShortest_m = 1e-3, kLongest_m = 3;  // of the arrow: others are not drawn
const kGhost = 0.3;                        // opacity
const kBall_m = 0.034, kBall = 0.35;       // radius and opacity
const kText_m = 0.04;
const kEase = 0.15, kJump_m = 0.2;  // the label follows the tip slowly, so that it can be read
const kUp = new Vector3(0, 1, 0);

export class TruthView {
  constructor() {
    this.group = new Group();
    this.tips = new ThinTrail();
    this.scale = null;  // of the tips
    this.setTheme();
    this.hide();
  }

  setTheme() {
    dispose(this.group);
    this.group.clear();
    this.ghost = triad(kBody_m, kAxes_m, 0);
    this.ghost.traverse(part => {
      if (part.material) Object.assign(part.material, {transparent: true, opacity: kGhost, depthWrite: false});
    });
    const ball = new MeshBasicMaterial({color: palette.error, transparent: true, opacity: kBall, depthWrite: false});
    this.ghost.add(new Mesh(new SphereGeometry(kBall_m, 24, 12), ball));
    this.name = label('true sensor', kText_m, palette.error);
    this.name.center.set(0.5, 2.4);  // below the sensor
    // Without depth test, so that the sensor does not hide a small error.
    const material = new MeshBasicMaterial({color: palette.error, depthTest: false, transparent: true});
    this.shaft = new Mesh(new CylinderGeometry(kRadius_m, kRadius_m, 1, 12), material);
    this.head = new Mesh(new ConeGeometry(2.4 * kRadius_m, 1, 16), material);
    this.arrow = new Group();
    this.arrow.add(this.shaft, this.head);
    this.shaft.renderOrder = this.head.renderOrder = 3;
    this.group.add(this.ghost, this.arrow, this.tips.line, this.name);
    this.#labelError(this.labelled ?? 1);
  }

  #labelError(scale) {
    const at = this.errorName?.position;
    if (this.errorName) dispose(this.errorName.removeFromParent());
    this.labelled = scale;
    this.errorName = label(`error x${scale}`, kText_m, palette.error);
    this.errorName.center.set(0.5, -1);  // above the tip
    if (at) this.errorName.position.copy(at);
    this.group.add(this.errorName);
  }

  /// Continues the trail of the tip by a valid pose. begins: there is a gap before it.
  add(pose, scale, begins) {
    if (!pose.truth) return;
    if (scale !== this.scale) this.tips.clear();
    this.scale = scale;
    const p = pose.truth.position_m;
    this.tips.add(p.map((v, k) => v + scale * (pose.position_m[k] - v)), pose.t, pose.true_mm, begins);
  }

  hide() { this.ghost.visible = this.name.visible = this.arrow.visible = this.errorName.visible = false; }

  /// scale: of the arrow, which begins at the true position. Without a truth nothing is drawn, without a valid pose no arrow.
  show(pose, scale) {
    if (scale !== this.labelled) this.#labelError(scale);
    this.hide();
    if (!pose.truth) return;
    const {position_m: p, q_wxyz: [w, x, y, z]} = pose.truth;
    this.ghost.visible = this.name.visible = true;
    this.ghost.position.set(...p);
    this.name.position.set(...p);
    this.ghost.quaternion.set(x, y, z, w);
    const error = new Vector3(...pose.position_m.map((v, k) => v - p[k]));
    const length = scale * error.length();
    const tip = this.ghost.position.clone().addScaledVector(error, scale);
    this.errorName.visible = pose.valid && length < kLongest_m;
    this.errorName.position.lerp(tip, this.errorName.position.distanceTo(tip) < kJump_m ? kEase : 1);
    if (!pose.valid || !(length > kShortest_m && length < kLongest_m)) return;
    const head = Math.min(kHead_m, length / 2);
    this.arrow.visible = true;
    this.arrow.position.set(...p);
    this.arrow.quaternion.copy(new Quaternion().setFromUnitVectors(kUp, error.normalize()));
    this.shaft.scale.y = length - head;
    this.shaft.position.y = (length - head) / 2;
    this.head.scale.set(head / kHead_m, head, head / kHead_m);
    this.head.position.y = length - head / 2;
  }
}
