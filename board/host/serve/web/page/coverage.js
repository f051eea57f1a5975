// Coverage of a free motion: directions of the sensor from the source, and of the source from the sensor, in cells of a half sphere,
// because a dipole field cannot tell opposite directions apart; and distances.
import {rotated} from './attitude.js';

const kRings = [{cells: 1, to: 18}, {cells: 6, to: 54}, {cells: 12, to: 90}];  // degrees from the pole
const kRadii = [0.28, 0.66, 1];                                                // of the rings in the picture
const kEnough = 12;                                                           // poses of a cell
const kNear_m = 0.4, kFar_m = 0.7;
const kDistances = ['nearer than 0.4 m', '0.4 to 0.7 m', 'farther than 0.7 m'];
const kShare = 0.7;         // of the cells, for a good calibration
const kLeastPart = 0.35;    // of a direction, along an axis that its name contains
const kAxes = ['x', 'y', 'z'];

const unit = v => v.map(x => x / Math.hypot(...v));
const degrees = rad => rad * 180 / Math.PI;

/// Half sphere about the axis `pole` (0 to 2), with its cells and the number of poses in each.
class HalfSphere {
  constructor(pole) {
    this.axes = [pole, (pole + 1) % 3, (pole + 2) % 3];
    this.cells = kRings.flatMap(({cells}, ring) => Array.from({length: cells}, (_, n) => ({ring, n, poses: 0})));
  }

  add(direction) {
    const [p, a, b] = this.axes.map(axis => direction[axis] * Math.sign(direction[this.axes[0]] || 1));
    const ring = kRings.findIndex(({to}) => degrees(Math.acos(Math.min(1, p))) <= to);
    const {cells} = kRings[ring];
    const turn = Math.atan2(b, a) / (2 * Math.PI);
    const n = Math.floor((turn + 1) * cells + 0.5) % cells;
    ++this.cells.find(cell => cell.ring === ring && cell.n === n).poses;
  }

  get share() { return this.cells.filter(({poses}) => poses >= kEnough).length / this.cells.length; }

  /// Names of the directions of the missing cells: +x, −y +z.
  get missing() {
    return this.cells.filter(({poses}) => poses < kEnough).map(({ring, n}) => {
      const from = ring === 0 ? 0 : (kRings[ring - 1].to + kRings[ring].to) / 2 / degrees(1);
      const about = 2 * Math.PI * n / kRings[ring].cells;
      const parts = [Math.cos(from), Math.sin(from) * Math.cos(about), Math.sin(from) * Math.sin(about)];
      const named = [0, 1, 2].map(axis => ({name: kAxes[axis], part: parts[this.axes.indexOf(axis)]}));
      return named.filter(({part}) => Math.abs(part) > kLeastPart).map(({name, part}) => `${part < 0 ? '−' : '+'}${name}`).join(' ');
    });
  }

  /// Picture: SVG of the cells seen along the pole; full ones are filled.
  get picture() {
    const point = (r, about) => `${(60 + 50 * r * Math.cos(about)).toFixed(1)} ${(60 - 50 * r * Math.sin(about)).toFixed(1)}`;
    const paths = this.cells.map(({ring, n, poses}) => {
      const outer = kRadii[ring], inner = ring > 0 ? kRadii[ring - 1] : 0, {cells} = kRings[ring];
      const [from, to] = [(n - 0.5) / cells, (n + 0.5) / cells].map(turn => 2 * Math.PI * turn);
      const d = ring === 0 ?
          `M ${point(outer, 0)} A ${50 * outer} ${50 * outer} 0 1 0 ${point(outer, Math.PI)} A ${50 * outer} ${50 * outer} 0 1 0 ${point(outer, 0)}` :
          `M ${point(inner, from)} L ${point(outer, from)} A ${50 * outer} ${50 * outer} 0 0 0 ${point(outer, to)} L ${point(inner, to)} A ${
              50 * inner} ${50 * inner} 0 0 1 ${point(inner, from)}`;
      return `<path d="${d} Z" class="${poses >= kEnough ? 'full' : 'empty'}"/>`;
    });
    const names = [['+', 1, 124, 61], ['−', 1, -4, 61], ['+', 2, 60, 1], ['−', 2, 60, 120]].map(
        ([sign, axis, x, y]) => `<text x="${x}" y="${y}">${sign}${kAxes[this.axes[axis]]}</text>`);
    return `<svg viewBox="-18 -10 156 140" aria-hidden="true">${paths.join('')}${names.join('')}</svg>`;
  }
}

export class Coverage {
  /// pole: axis of the half space of the sensor, 0 to 2.
  constructor(pole) {
    this.ofSource = new HalfSphere(pole);
    this.ofSensor = new HalfSphere(2);
    this.distances = [0, 0, 0];
    this.poses = 0;
    this.worst = null;  // distortion: {mm, position_m}
    this.squares_mm2 = 0;
    this.flagged = 0;
  }

  /// A valid pose.
  add(pose) {
    const p = pose.position_m, [w, x, y, z] = pose.q_wxyz;
    const distance = Math.hypot(...p);
    if (!(distance > 0)) return;
    ++this.poses;
    this.ofSource.add(unit(p));
    this.ofSensor.add(rotated([w, -x, -y, -z], unit(p)));
    ++this.distances[distance < kNear_m ? 0 : distance <= kFar_m ? 1 : 2];
    if (pose.names.includes('distorted')) ++this.flagged;
    if (!Number.isFinite(pose.distortion_mm)) return;
    this.squares_mm2 += pose.distortion_mm ** 2;
    if (!(this.worst?.mm >= pose.distortion_mm)) this.worst = {mm: pose.distortion_mm, position_m: p};
  }

  get missingDistances() { return kDistances.filter((_, n) => this.distances[n] < kEnough); }
  get isGood() { return this.ofSource.share >= kShare && this.ofSensor.share >= kShare && this.missingDistances.length < 2; }
  get distortion_mm() { return Math.sqrt(this.squares_mm2 / Math.max(1, this.poses)); }

  /// Sentences: what is missing.
  get text() {
    const of = (sphere, what) => {
      const missing = [...new Set(sphere.missing)];
      const some = missing.length > 4 ? `${missing.slice(0, 4).join(', ')} and ${missing.length - 4} more` : missing.join(', ');
      return `${what} ${Math.round(100 * sphere.share)} %${missing.length ? `, missing: ${some}` : ''}.`;
    };
    const far = this.missingDistances;
    return [
      of(this.ofSource, 'Sensor around the source:'), of(this.ofSensor, 'Sensor turned:'),
      far.length ? `Distances missing: ${far.join(', ')}.` : 'All distances.'
    ];
  }
}
