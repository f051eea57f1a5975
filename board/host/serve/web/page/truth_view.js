// The true sensor of a simulation as a ghost, and the error of the estimate as an arrow, drawn to a stated scale, with the trail of
// its tip: the path with enlarged errors.
import {ConeGeometry, CylinderGeometry, Group, Mesh, MeshBasicMaterial, Quaternion, Vector3} from 'three';

import {palette} from './palette.js';
import {Trail} from './trail.js';
import {dispose, triad} from './triad.js';

const kBody_m = 0.03, kAxes_m = 0.11;  // as those of the sensor
const kRadius_m = 0.006, kHead_m = 0.03;
const kShortest_m = 1e-3, kLongest_m = 3;  // of the arrow: others are not drawn
const kGhost = 0.3;                        // opacity
const kUp = new Vector3(0, 1, 0);

export class TruthView {
  constructor() {
    this.group = new Group();
    this.tips = new Trail(1, 0.4);
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
    // Without depth test, so that the sensor does not hide a small error.
    const material = new MeshBasicMaterial({color: palette.ink, depthTest: false, transparent: true});
    this.shaft = new Mesh(new CylinderGeometry(kRadius_m, kRadius_m, 1, 12), material);
    this.head = new Mesh(new ConeGeometry(2.4 * kRadius_m, 1, 16), material);
    this.arrow = new Group();
    this.arrow.add(this.shaft, this.head);
    this.shaft.renderOrder = this.head.renderOrder = 3;
    this.group.add(this.ghost, this.arrow, this.tips.line);
  }

  /// Continues the trail of the tip by a valid pose. begins: there is a gap before it.
  add(pose, scale, begins) {
    if (!pose.truth) return;
    if (scale !== this.scale) this.tips.clear();
    this.scale = scale;
    const p = pose.truth.position_m;
    this.tips.add(p.map((v, k) => v + scale * (pose.position_m[k] - v)), pose.t, pose.true_mm, begins);
  }

  hide() { this.ghost.visible = this.arrow.visible = false; }

  /// scale: of the arrow, which begins at the true position. Without a truth nothing is drawn, without a valid pose no arrow.
  show(pose, scale) {
    this.hide();
    if (!pose.truth) return;
    const {position_m: p, q_wxyz: [w, x, y, z]} = pose.truth;
    this.ghost.visible = true;
    this.ghost.position.set(...p);
    this.ghost.quaternion.set(x, y, z, w);
    const error = new Vector3(...pose.position_m.map((v, k) => v - p[k]));
    const length = scale * error.length();
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
