// Tip of a pointer from poses while it turns about its resting tip: p = x_i + R_i t for the same point p and tip t.
import {rotated} from './attitude.js';

const kLeast = 30;           // poses
const kLeastSpread = 0.015;  // smallest eigenvalue of the spread of R: too little tilt, or about one axis only

const kUnit = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];

export class Pivot {
  constructor() {
    this.poses = [];  // {x: m, r: columns of R}
  }

  add(pose) { this.poses.push({x: pose.position_m, r: kUnit.map(axis => rotated(pose.q_wxyz, axis))}); }

  /// {tip_m, rms_mm, sigma_mm}, or {error}: a sentence.
  solve() {
    const n = this.poses.length;
    if (n < kLeast) return {error: `Only ${n} valid poses: tilt the pointer for some seconds.`};
    const mean = (of, k) => this.poses.reduce((sum, pose) => sum + of(pose)[k], 0) / n;
    const x0 = [0, 1, 2].map(k => mean(pose => pose.x, k));
    const r0 = [0, 1, 2].map(j => [0, 1, 2].map(k => mean(pose => pose.r[j], k)));
    const a = [0, 1, 2].map(() => [0, 0, 0]), b = [0, 0, 0];
    for (const {x, r} of this.poses) {
      const d = r.map((column, j) => column.map((v, k) => v - r0[j][k]));
      for (let i = 0; i < 3; ++i) {
        for (let j = 0; j < 3; ++j) a[i][j] += d[i].reduce((sum, v, k) => sum + v * d[j][k], 0) / n;
        b[i] -= d[i].reduce((sum, v, k) => sum + v * (x[k] - x0[k]), 0) / n;
      }
    }
    if (smallestEigenvalue(a) < kLeastSpread) return {error: 'Too little tilt: tilt the pointer to all sides by 30 degrees, its tip at rest.'};
    const inverse = inverted(a);
    const tip_m = inverse.map(row => row.reduce((sum, v, k) => sum + v * b[k], 0));
    const point = [0, 1, 2].map(k => x0[k] + tip_m.reduce((sum, v, j) => sum + r0[j][k] * v, 0));
    const square =
        this.poses.reduce(
            (sum, {x, r}) => sum + [0, 1, 2].reduce((s, k) => s + (x[k] + tip_m.reduce((v, t, j) => v + r[j][k] * t, 0) - point[k]) ** 2, 0), 0) /
        n;
    const rms_mm = 1000 * Math.sqrt(square);
    return {tip_m, rms_mm, poses: n};
  }
}

function inverted([[a, b, c], [d, e, f], [g, h, i]]) {
  const determinant = a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g);
  return [
    [e * i - f * h, c * h - b * i, b * f - c * e], [f * g - d * i, a * i - c * g, c * d - a * f], [d * h - e * g, b * g - a * h, a * e - b * d]
  ].map(row => row.map(v => v / determinant));
}

/// Of a symmetric matrix, from its characteristic polynomial.
function smallestEigenvalue(m) {
  const q = (m[0][0] + m[1][1] + m[2][2]) / 3;
  const off = m[0][1] ** 2 + m[0][2] ** 2 + m[1][2] ** 2;
  const p = Math.sqrt(((m[0][0] - q) ** 2 + (m[1][1] - q) ** 2 + (m[2][2] - q) ** 2 + 2 * off) / 6);
  if (p < 1e-12) return q;
  const b = m.map((row, i) => row.map((v, j) => (v - (i === j ? q : 0)) / p));
  const half = (b[0][0] * (b[1][1] * b[2][2] - b[1][2] ** 2) - b[0][1] * (b[0][1] * b[2][2] - b[1][2] * b[0][2]) +
                b[0][2] * (b[0][1] * b[1][2] - b[1][1] * b[0][2])) /
      2;
  return q + 2 * p * Math.cos(Math.acos(Math.max(-1, Math.min(1, half))) / 3 + 2 * Math.PI / 3);
}
