// Rate and jitter over the last second of a history.
const kSecond = 1;
const kPiece_s = 0.1;
const kDegree = 3;
const kLeast = 6;  // fewest poses of a piece

/// Poses per second up to the time `end`; null without poses.
export function rate(history, end = history.end) {
  const first = history.at(end - kSecond);
  const last = Math.min(history.at(end), history.length - 1);
  return last > first ? (last - first) / (history.times[last] - history.times[first]) : null;
}

const bases = new Map();

/// Orthonormal polynomials of degree 0 to kDegree at n equal steps.
function basis(n) {
  if (bases.has(n)) return bases.get(n);
  const made = [];
  for (let degree = 0; degree <= kDegree; ++degree) {
    const v = Array.from({length: n}, (_, k) => (2 * k / (n - 1) - 1) ** degree);
    for (const other of made) {
      const along = dot(v, other);
      other.forEach((u, k) => {
        v[k] -= along * u;
      });
    }
    const norm = Math.sqrt(dot(v, v));
    made.push(v.map(x => x / norm));
  }
  bases.set(n, made);
  return made;
}

const dot = (a, b) => a.reduce((sum, v, k) => sum + v * b[k], 0);

/// Residual sum of squares about the least-squares cubic of `values` at equal steps.
function aboutCubic(values) {
  const shifted = values.map(v => v - values[0]);
  return basis(values.length).reduce((sum, b) => sum - dot(shifted, b) ** 2, dot(shifted, shifted));
}

/// RMS of the position (3D, mm) about a cubic through each 0.1 s of the second up to `end`: motion of a hand is left out. Null if unknown.
export function jitter(history, end = history.end) {
  const {times, columns} = history;
  let squares = 0, freedom = 0;
  let n = history.at(end - kSecond);
  const last = Math.min(history.length, history.at(end) + 1);
  while (n < last) {
    const stop = Math.min(last, history.at(times[n] + kPiece_s));
    if (stop - n >= kLeast && columns.x.subarray(n, stop).every(Number.isFinite)) {
      for (const name of ['x', 'y', 'z']) squares += aboutCubic(Array.from(columns[name].subarray(n, stop)));
      freedom += stop - n - 1 - kDegree;
    }
    n = Math.max(stop, n + 1);
  }
  return freedom > 0 ? Math.sqrt(Math.max(0, squares) / freedom) : null;
}
