// Shows the two possible positions of the sensor, and the plane between the hemispheres.
import {CircleGeometry, DoubleSide, Group, Mesh, MeshBasicMaterial, Quaternion, SphereGeometry, Vector3} from 'three';

import {palette} from './palette.js';
import {dispose, label} from './triad.js';

const kBall_m = 0.035, kText_m = 0.07, kPlane_m = 0.3;

export class HemisphereView {
  constructor() { this.group = new Group(); }

  /// sides: of sidesOf(), with the position of the sensor; empty: nothing to choose.
  show(position_m, sides) {
    const key = sides.map(side => side.name).join() + palette.bad;
    if (key !== this.key) this.#rebuild(sides);
    this.key = key;
    this.balls?.forEach((ball, n) => {
      const along = sides[n].towards.reduce((sum, v, k) => sum + v * position_m[k], 0);
      ball.position.set(...position_m).multiplyScalar(along < 0 ? -1 : 1);
    });
  }

  #rebuild(sides) {
    dispose(this.group);
    this.group.clear();
    this.balls = sides.map(side => {
      const ball = new Group();
      ball.add(new Mesh(new SphereGeometry(kBall_m, 24, 16), new MeshBasicMaterial({color: palette.bad, transparent: true, opacity: 0.55})));
      const name = label(side.name, kText_m, palette.ink);
      name.position.set(0, 0, -kText_m);
      ball.add(name);
      this.group.add(ball);
      return ball;
    });
    if (!sides.length) return;
    const plane = new Mesh(
        new CircleGeometry(kPlane_m, 64),
        new MeshBasicMaterial({color: palette.muted, transparent: true, opacity: 0.16, side: DoubleSide, depthWrite: false}));
    plane.quaternion.copy(new Quaternion().setFromUnitVectors(new Vector3(0, 0, 1), new Vector3(...sides[0].towards)));
    this.group.add(plane);
  }
}
