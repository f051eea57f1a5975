// Trail of a sensor: a line whose colour is the expected error, and whose older parts are fainter.
import {Color, SRGBColorSpace} from 'three';
import {LineMaterial} from 'three/addons/lines/LineMaterial.js';
import {LineSegments2} from 'three/addons/lines/LineSegments2.js';
import {LineSegmentsGeometry} from 'three/addons/lines/LineSegmentsGeometry.js';

import {errorColor} from './palette.js';

const kMost = 900;  // segments
const kStep_m = 0.001;
const kStep_s = 0.05;  // a new point after either
const kFaint = 0.35;   // weight of the oldest colour

export class Trail {
  constructor(width = 3.5, opacity = 1) {
    this.points = [];  // {p, t, color, begins}; color: linear
    this.newest = null;
    this.geometry = new LineSegmentsGeometry();
    this.geometry.setPositions(new Float32Array(6 * kMost));
    this.geometry.setColors(new Float32Array(6 * kMost));
    this.geometry.instanceCount = 0;
    this.line = new LineSegments2(
        this.geometry, new LineMaterial({linewidth: width, vertexColors: true, transparent: opacity < 1, opacity, depthWrite: false}));
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

  /// background: colour that old parts fade to: red, green and blue, linear.
  update(background) {
    const positions = this.geometry.attributes.instanceStart.data;
    const colors = this.geometry.attributes.instanceColorStart.data;
    let count = 0;
    for (let n = 1; n < this.points.length; ++n) {
      const [a, b] = [this.points[n - 1], this.points[n]];
      if (b.begins) continue;
      const weight = kFaint + (1 - kFaint) * n / this.points.length;
      const mixed = color => color.map((v, k) => weight * v + (1 - weight) * background[k]);
      positions.array.set([...a.p, ...b.p], 6 * count);
      colors.array.set([...mixed(a.color), ...mixed(b.color)], 6 * count);
      ++count;
    }
    positions.needsUpdate = colors.needsUpdate = true;
    this.geometry.instanceCount = count;
  }
}
