// Rate and jitter over the last second of a history.
const kSecond = 1;
const kPiece_s = 0.1;
const kDegree = 3;
const kLeast = 6;  // fewest poses of a piece

/// Poses per second; null without poses.
export function rate(history) {
  const first = history.at(history.end - kSecond);
  const count = history.length - 1 - first;
  return count > 0 ? count / (history.end - history.times[first]) : null;
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
      other.forEach((u, k) => { v[k] -= along * u; });
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

/// RMS of the position (3D, mm) about a cubic through each 0.1 s of the last second: motion of a hand is left out. Null if unknown.
export function jitter(history) {
  const {times, columns} = history;
  let squares = 0, freedom = 0;
  let n = history.at(history.end - kSecond);
  while (n < history.length) {
    const end = history.at(times[n] + kPiece_s);
    if (end - n >= kLeast && columns.x.subarray(n, end).every(Number.isFinite)) {
      for (const name of ['x', 'y', 'z']) squares += aboutCubic(Array.from(columns[name].subarray(n, end)));
      freedom += end - n - 1 - kDegree;
    }
    n = Math.max(end, n + 1);
  }
  return freedom > 0 ? Math.sqrt(Math.max(0, squares) / freedom) : null;
}
