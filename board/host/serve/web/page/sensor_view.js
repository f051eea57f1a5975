// Sensor in the scene: triad, covariance ellipsoid and trail.
import {AxesHelper, BoxGeometry, BufferAttribute, BufferGeometry, DynamicDrawUsage, Group, LineBasicMaterial, LineSegments, Matrix4, Mesh,
        MeshBasicMaterial, MeshLambertMaterial, SphereGeometry} from 'three';
import {drawnFactor} from './ellipsoid.js';

const kTrail = 600;
const kColors = [0x3388ff, 0x22aa66, 0xaa44cc, 0x888800];

export function triad(size, box, color) {
  const group = new Group();
  group.add(new AxesHelper(size));
  group.add(new Mesh(new BoxGeometry(box, box, box), new MeshLambertMaterial({color})));
  return group;
}

export class SensorView {
  constructor(number) {
    const color = kColors[number % kColors.length];
    this.triad = triad(0.1, 0.015, color);
    // Without depth test, so that the sensor inside does not hide the ellipsoid.
    this.ellipsoid = new Mesh(new SphereGeometry(1, 24, 16),
                              new MeshBasicMaterial({color: 0xff8800, transparent: true, opacity: 0.45, depthTest: false, depthWrite: false}));
    this.ellipsoid.matrixAutoUpdate = false;
    this.ellipsoid.frustumCulled = false;
    this.trail = new BufferAttribute(new Float32Array(6 * kTrail), 3).setUsage(DynamicDrawUsage);
    this.steps = 0;
    this.last = null;
    this.line = new LineSegments(new BufferGeometry().setAttribute('position', this.trail), new LineBasicMaterial({color}));
    this.line.frustumCulled = false;
    this.line.geometry.setDrawRange(0, 0);
    this.group = new Group();
    this.group.add(this.triad, this.ellipsoid, this.line);
  }

  /// Draws a pose with the attitude q. begins: leaves a gap in the trail before this pose. An invalid pose hides the sensor; the trail
  /// remains.
  show(pose, q, exaggeration, begins) {
    this.triad.position.set(...pose.position_m);
    this.triad.quaternion.set(q[1], q[2], q[3], q[0]);
    const [a, b, d, c, e, f] = drawnFactor(pose.position_covariance_m2, exaggeration);
    this.ellipsoid.matrix = new Matrix4().set(a, 0, 0, pose.position_m[0], b, d, 0, pose.position_m[1], c, e, f, pose.position_m[2], 0, 0, 0, 1);
    if (pose.valid) this.#extendTrail(pose.position_m, begins);
    this.setVisible(pose.valid);
  }

  setVisible(visible) { this.triad.visible = this.ellipsoid.visible = visible; }

  #extendTrail(p, begins) {
    if (this.last && !begins) {
      const points = this.trail.array;
      if (this.steps === kTrail) points.copyWithin(0, 6);
      else ++this.steps;
      points.set([...this.last, ...p], 6 * (this.steps - 1));
      this.trail.needsUpdate = true;
      this.line.geometry.setDrawRange(0, 2 * this.steps);
    }
    this.last = p;
  }
}
