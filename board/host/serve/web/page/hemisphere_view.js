// Shows the two possible positions of the sensor with the plane between the hemispheres, and the boundary of a sensor's half space.
import {ArrowHelper, CircleGeometry, DoubleSide, Group, Mesh, MeshBasicMaterial, Quaternion, SphereGeometry, Vector3} from 'three';

import {palette} from './palette.js';
import {dispose, label} from './triad.js';

const kBall_m = 0.035, kText_m = 0.07, kPlane_m = 0.3, kArrow_m = 0.12, kSmallText_m = 0.04;
const kTarget_px = 30;

export class HemisphereView {
  constructor() {
    this.question = new Group();
    this.boundary = new Group();
    this.group = new Group();
    this.group.add(this.question, this.boundary);
  }

  /// towards: direction to the half space that the sensor never leaves; null: it may be on both sides.
  confine(towards) {
    const key = `${towards} ${palette.muted}`;
    if (key === this.boundaryKey) return;
    this.boundaryKey = key;
    dispose(this.boundary);
    this.boundary.clear();
    if (!towards) return;
    const direction = new Vector3(...towards).normalize();
    const top = new Vector3(0, 0, -kPlane_m).projectOnPlane(direction);
    const name = label('hemisphere', kSmallText_m, palette.muted);
    name.position.copy(top).addScaledVector(direction, kArrow_m + kSmallText_m);
    this.boundary.add(plane(direction), new ArrowHelper(direction, top, kArrow_m, palette.muted), name);
  }

  /// sides: of sidesOf(), with the position of the sensor; empty: nothing to choose.
  show(position_m, sides) {
    const key = sides.map(side => side.name).join() + palette.bad;
    if (key !== this.key) this.#rebuild(sides);
    this.key = key;
    this.sides = sides;
    this.balls?.forEach((ball, n) => {
      const along = sides[n].towards.reduce((sum, v, k) => sum + v * position_m[k], 0);
      ball.position.set(...position_m).multiplyScalar(along < 0 ? -1 : 1);
    });
  }

  /// Direction to the side whose ball is drawn at this place of the canvas; null: none.
  sideAt(x, y, canvas, camera) {
    const places = (this.sides ?? []).map((_, n) => this.balls[n].position.clone().project(camera));
    const distances = places.map(p => Math.hypot((p.x + 1) / 2 * canvas.clientWidth - x, (1 - p.y) / 2 * canvas.clientHeight - y));
    const nearest = distances.indexOf(Math.min(...distances));
    return nearest >= 0 && distances[nearest] < kTarget_px ? this.sides[nearest].towards : null;
  }

  #rebuild(sides) {
    dispose(this.question);
    this.question.clear();
    this.balls = sides.map(side => {
      const ball = new Group();
      ball.add(new Mesh(new SphereGeometry(kBall_m, 24, 16), new MeshBasicMaterial({color: palette.bad, transparent: true, opacity: 0.55})));
      const name = label(side.name, kText_m, palette.ink);
      name.position.set(0, 0, -kText_m);
      ball.add(name);
      this.question.add(ball);
      return ball;
    });
    if (sides.length) this.question.add(plane(new Vector3(...sides[0].towards)));
  }
}

/// Disc about the source.
function plane(normal) {
  const disc = new Mesh(
      new CircleGeometry(kPlane_m, 64),
      new MeshBasicMaterial({color: palette.muted, transparent: true, opacity: 0.16, side: DoubleSide, depthWrite: false}));
  disc.quaternion.copy(new Quaternion().setFromUnitVectors(new Vector3(0, 0, 1), normal));
  return disc;
}
