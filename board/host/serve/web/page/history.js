// History of one sensor as typed columns: every pose of the last minutes, or of a recording.
import {angles} from './attitude.js';

const kGap_s = 0.3;                // a longer interval between poses is a gap
const kSpeedBase_s = 0.03;         // interval over which the speed is measured
const kStep_deg = 180;             // a larger step means that the angle has wrapped
const kFirst = 4096;               // entries at first
export const kMostLive = 160_000;  // then the oldest quarter is dropped: eleven minutes at 240 poses/s

export const kNames =
    ['x', 'y', 'z', 'qw', 'qx', 'qy', 'qz', 'a0', 'a1', 'a2', 'speed', 'sigma', 'error', 'expected', 'true', 'distortion', 'snr', 'flags', 'level'];
const kKept = new Set(['snr', 'flags', 'level']);  // also valid in an invalid pose
/// Values of the column `level`, by severity.
export const Level = {
  good: 0,
  caution: 1,
  invalid: 2,
  silent: 3
};

export class History {
  constructor(most = kMostLive) {
    this.most = most;
    this.length = 0;
    this.times = new Float64Array(kFirst);
    this.columns = Object.fromEntries(kNames.map(name => [name, new Float32Array(kFirst)]));
    this.turn = {order: 'zyx', boresight: null};
    this.previous = null;  // newest pose, with its time t
  }

  /// Adds a pose at time t (s) with its level. Poses that do not advance in time are refused.
  add(pose, t, level) {
    if (this.previous && t <= this.previous.t) return false;
    if (this.breaksAt(t)) this.#put((this.previous.t + t) / 2, {level: Level.silent}, false);
    const a = angles(pose.q_wxyz, this.turn);
    const [x, y, z] = pose.position_m.map(v => 1000 * v);
    const [qw, qx, qy, qz] = pose.q_wxyz;
    this.previous = {...pose, t};
    this.#put(
        t, {
          x,
          y,
          z,
          qw,
          qx,
          qy,
          qz,
          a0: a[0],
          a1: a[1],
          a2: a[2],
          speed: this.#speed(x, y, z, t),
          sigma: pose.sigma_mm,
          error: pose.error_mm ?? NaN,
          expected: pose.expected_mm,
          true: pose.true_mm,
          distortion: pose.distortion_mm,
          snr: pose.snr_db,
          flags: pose.flags,
          level
        },
        pose.valid);
    return true;
  }

  /// Moves all times by seconds.
  shift(by) {
    for (let n = 0; n < this.length; ++n) this.times[n] += by;
    this.previous.t += by;
  }

  breaksAt(t) { return this.previous !== null && t - this.previous.t > kGap_s; }

  /// Computes the columns of angles again. turn: {order, boresight}.
  setTurn(turn) {
    this.turn = turn;
    const c = this.columns;
    for (let n = 0; n < this.length; ++n) {
      if (!Number.isFinite(c.qw[n])) continue;
      this.#putAngles(n, angles([c.qw[n], c.qx[n], c.qy[n], c.qz[n]], turn));
    }
  }

  /// Index of the first entry at or after t.
  at(t) {
    let low = 0, high = this.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.times[middle] < t)
        low = middle + 1;
      else
        high = middle;
    }
    return low;
  }

  get end() { return this.length ? this.times[this.length - 1] : 0; }

  #speed(x, y, z, t) {
    const c = this.columns;
    for (let n = this.length - 1; n >= 0 && t - this.times[n] < kGap_s; --n) {
      if (!Number.isFinite(c.x[n])) return NaN;
      const dt = t - this.times[n];
      if (dt >= kSpeedBase_s) return Math.hypot(x - c.x[n], y - c.y[n], z - c.z[n]) / dt / 1000;
    }
    return NaN;
  }

  /// An angle that steps over 180 degrees leaves a gap, so that no line crosses its plot.
  #putAngles(n, a) {
    ['a0', 'a1', 'a2'].forEach((name, k) => {
      const step = n > 0 ? Math.abs(a[k] - this.columns[name][n - 1]) : 0;
      this.columns[name][n] = step > kStep_deg ? NaN : a[k];
    });
  }

  #put(t, values, valid) {
    if (this.length === this.times.length) this.#makeRoom();
    const n = this.length;
    this.times[n] = t;
    for (const name of kNames) this.columns[name][n] = valid || kKept.has(name) ? values[name] ?? NaN : NaN;
    if (valid) this.#putAngles(n, [values.a0, values.a1, values.a2]);
    ++this.length;
  }

  #makeRoom() {
    const drop = this.length >= this.most ? this.length >> 2 : 0;
    const resize = old => {
      const array = drop ? old : new old.constructor(Math.min(2 * old.length, Math.max(this.most, old.length + 1)));
      array.set(old.subarray(drop));
      return array;
    };
    this.times = resize(this.times);
    for (const name of kNames) this.columns[name] = resize(this.columns[name]);
    this.length -= drop;
  }
}
