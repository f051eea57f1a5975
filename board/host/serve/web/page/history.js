// History of one sensor over the last ten seconds, as columns for the plots.
export const kSeconds = 10;
const kMax = 600;  // entries
const kGap_s = 0.3;  // a longer interval between poses is a gap

/// Values of a pose, in the order of the columns. speed: m/s, or null if unknown.
const kValues = [pose => 1000 * pose.position_m[0], pose => 1000 * pose.position_m[1], pose => 1000 * pose.position_m[2], (pose, speed) => speed,
                 pose => pose.predicted_error_mm, pose => pose.distortion_mm, pose => pose.snr_db];
const kAlwaysValid = 6;  // index of the column that is filled for invalid poses too: signal-to-noise ratio

export class History {
  constructor() {
    this.times = [];  // s since 1970 (UTC)
    this.columns = kValues.map(() => []);
    this.previous = null;
  }

  /// Adds a pose. Invalid poses and times without poses become gaps.
  add(pose) {
    const t = pose.utc_ms / 1000;
    if (this.previous && pose.utc_ms < this.previous.utc_ms) this.clear();
    const dt = this.previous ? t - this.previous.utc_ms / 1000 : 0;
    const broken = dt > kGap_s;
    if (broken) this.#push(t - dt / 2, () => null);
    const both = dt > 0 && !broken && this.previous.valid && pose.valid;
    const speed = both ? Math.hypot(...pose.position_m.map((v, n) => v - this.previous.position_m[n])) / dt : null;
    this.previous = pose;
    this.#push(t, n => pose.valid || n === kAlwaysValid ? kValues[n](pose, speed) : null);
    this.forget(t);
  }

  /// True if `pose` does not continue the previous one: no valid pose before it, a gap, or time went back.
  breaksWith(pose) { return !this.previous?.valid || pose.utc_ms < this.previous.utc_ms || pose.utc_ms - this.previous.utc_ms > 1000 * kGap_s; }

  /// Drops entries older than ten seconds at `now` (s since 1970), and the oldest beyond kMax.
  forget(now) {
    while (this.times.length > kMax || this.times[0] < now - kSeconds) {
      this.times.shift();
      for (const column of this.columns) column.shift();
    }
  }

  clear() {
    this.previous = null;
    this.times.length = 0;
    for (const column of this.columns) column.length = 0;
  }

  #push(t, value) {
    this.times.push(t);
    this.columns.forEach((column, n) => column.push(value(n)));
  }
}
