// Trails of points: lines whose older parts are fainter. The ribbon's colour is the expected error. The wide lines of three.js take five
// times as long without a graphics processor.
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

/// Points in the buffers of an object of three.js. A kind of trail says where the vertices of a point are, and which vertices its step
/// from the point before has.
class Trail {
  /// perPoint, perStep: number of vertices. toObject(geometry): what is drawn.
  constructor(perPoint, perStep, toObject) {
    this.points = [];  // {p, t, color, begins}; color: linear
    this.perPoint = perPoint;
    this.geometry = new BufferGeometry().setIndex(new BufferAttribute(new Uint16Array(perStep * kMost), 1));
    for (const name of ['position', 'color']) this.geometry.setAttribute(name, new BufferAttribute(new Float32Array(3 * perPoint * kMost), 3));
    this.line = toObject(this.geometry);
    this.line.frustumCulled = false;
  }

  /// begins: there is a gap before this point.
  add(p, t, error_mm, begins) {
    const last = this.points.at(-1);
    const near = last && !begins && Math.hypot(...difference(p, last.p)) < kStep_m && t - last.t < kStep_s;
    if (near) return;
    this.points.push({p, t, color: new Color().setRGB(...errorColor(error_mm), SRGBColorSpace).toArray(), begins});
    if (this.points.length > kMost) this.points.splice(0, this.points.length - kMost);
  }

  clear() { this.points.length = 0; }

  /// background: colour that old parts fade to: red, green and blue, linear. pixel: size of a pixel at a depth of 1 m.
  update(background, camera, pixel) {
    const {index, attributes: {position, color}} = this.geometry;
    camera.getWorldDirection(forward);
    let count = 0;
    this.points.forEach(({color: own, begins}, n) => {
      const weight = kFaint + (1 - kFaint) * (n + 1) / this.points.length;
      const mixed = own.map((v, k) => weight * v + (1 - weight) * background[k]);
      this.vertices(n, camera, pixel).forEach((vertex, k) => {
        position.array.set(vertex, 3 * (n * this.perPoint + k));
        color.array.set(mixed, 3 * (n * this.perPoint + k));
      });
      if (n === 0 || begins) return;
      const step = this.step(n * this.perPoint);
      index.array.set(step, count);
      count += step.length;
    });
    for (const buffer of [index, position, color]) buffer.needsUpdate = true;
    this.geometry.setDrawRange(0, count);
  }
}

/// A ribbon of constant width in the picture.
export class RibbonTrail extends Trail {
  constructor() {
    super(2, 6, geometry => new Mesh(geometry, new MeshBasicMaterial({vertexColors: true, side: DoubleSide, depthWrite: false})));
  }

  /// Both edges, in a plane parallel to the picture.
  vertices(n, camera, pixel) {
    const {p, begins} = this.points[n], next = this.points[n + 1];
    const before = n > 0 && !begins ? this.points[n - 1].p : p;
    sight.set(...p).sub(camera.position);
    along.set(...difference(next && !next.begins ? next.p : p, before));
    if (along.length() < kLeast_m) along.set(...difference(p, before));  // it turns back
    along.cross(sight).projectOnPlane(forward);
    const edge = along.setLength(along.lengthSq() > 0 ? kWidth_px / 2 * pixel * sight.dot(forward) : 0).toArray();
    return [p.map((v, k) => v + edge[k]), difference(p, edge)];
  }

  /// Two triangles. first: vertex of the newer point.
  step(first) { return [first - 2, first - 1, first, first, first - 1, first + 1]; }
}

/// A pale line of one device pixel.
export class ThinTrail extends Trail {
  constructor() {
    const opacity = kThin * Math.min(devicePixelRatio, 2);
    super(1, 2, geometry => new LineSegments(geometry, new LineBasicMaterial({vertexColors: true, transparent: true, opacity, depthWrite: false})));
  }

  vertices(n) { return [this.points[n].p]; }

  step(first) { return [first - 1, first]; }
}
