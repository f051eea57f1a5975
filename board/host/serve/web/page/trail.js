// Trail of a sensor: a line whose colour is the expected error, and whose older parts are fainter.
import {BufferAttribute, BufferGeometry, Color, DoubleSide, LineBasicMaterial, LineSegments, Mesh, MeshBasicMaterial, SRGBColorSpace, Vector3} from 'three';

import {errorColor} from './palette.js';

const kMost = 360;  // points
const kStep_m = 0.0025;
const kStep_s = 0.125;  // a new point after either
const kFaint = 0.35;    // weight of the oldest colour
const kWidth_px = 3.5;
const kThin = 0.4;  // opacity of a thin line of one pixel of the page
const kLeast_m = 1e-6;

const [along, sight, forward] = [new Vector3(), new Vector3(), new Vector3()];
const difference = (a, b) => a.map((v, k) => v - b[k]);

/// From the middle of a ribbon at `here` to its edge, in a plane parallel to the picture. pixel: size of a pixel at a depth of 1 m.
function toEdge(before, here, after, camera, pixel) {
  sight.set(...here).sub(camera.position);
  along.set(...difference(after, before));
  if (along.length() < kLeast_m) along.set(...difference(here, before));  // it turns back
  along.cross(sight).projectOnPlane(forward);
  return along.setLength(along.lengthSq() > 0 ? kWidth_px / 2 * pixel * sight.dot(forward) : 0).toArray();
}

/// A ribbon, or a thin line: the wide lines of three.js take five times as long without a graphics processor.
export class Trail {
  /// isThin: of one device pixel and pale.
  constructor(isThin = false) {
    this.points = [];  // {p, t, color, begins}; color: linear
    this.isThin = isThin;
    this.geometry = new BufferGeometry().setIndex(new BufferAttribute(new Uint16Array(6 * kMost), 1));
    for (const name of ['position', 'color']) this.geometry.setAttribute(name, new BufferAttribute(new Float32Array(6 * kMost), 3));
    this.line = isThin ?
        new LineSegments(this.geometry, new LineBasicMaterial({vertexColors: true, transparent: true, opacity: kThin * Math.min(devicePixelRatio, 2), depthWrite: false})) :
        new Mesh(this.geometry, new MeshBasicMaterial({vertexColors: true, side: DoubleSide, depthWrite: false}));
    this.line.frustumCulled = false;
  }

  /// begins: there is a gap before this point.
  add(p, t, error_mm, begins) {
    const last = this.points.at(-1);
    const near = last && !begins && Math.hypot(...p.map((v, k) => v - last.p[k])) < kStep_m && t - last.t < kStep_s;
    if (near) return;
    this.points.push({p, t, color: new Color().setRGB(...errorColor(error_mm), SRGBColorSpace).toArray(), begins});
    if (this.points.length > kMost) this.points.splice(0, this.points.length - kMost);
  }

  clear() { this.points.length = 0; }

  /// background: colour that old parts fade to: red, green and blue, linear. height: of the picture, pixels.
  update(background, camera, height) {
    const {index, attributes: {position, color}} = this.geometry;
    const pixel = 2 * Math.tan(camera.fov * Math.PI / 360) / height;
    camera.getWorldDirection(forward);
    let count = 0;
    this.points.forEach(({p, color: own, begins}, n) => {
      const weight = kFaint + (1 - kFaint) * (n + 1) / this.points.length;
      const mixed = own.map((v, k) => weight * v + (1 - weight) * background[k]);
      const [before, after] = [this.points[n - 1], this.points[n + 1]];
      const edge = this.isThin ? [0, 0, 0] : toEdge(before && !begins ? before.p : p, p, after && !after.begins ? after.p : p, camera, pixel);
      position.array.set(p.map((v, k) => v + edge[k]), 6 * n);
      position.array.set(p.map((v, k) => v - edge[k]), 6 * n + 3);
      color.array.set([...mixed, ...mixed], 6 * n);
      if (!before || begins) return;
      const corners = this.isThin ? [2 * n - 2, 2 * n] : [2 * n - 2, 2 * n - 1, 2 * n, 2 * n, 2 * n - 1, 2 * n + 1];
      index.array.set(corners, count);
      count += corners.length;
    });
    for (const buffer of [index, position, color]) buffer.needsUpdate = true;
    this.geometry.setDrawRange(0, count);
  }
}
