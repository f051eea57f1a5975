// Ellipsoid of a sensor's position covariance, exaggerated so that it is visible.
export const kSigmas = 3;
const kLongest_m = 0.12;  // maximum length of a drawn half-axis
const kTolerance = 1.5;   // factor by which the drawn length may leave its range before the exaggeration changes
const kMost_m = 1;        // limit of each entry of the transform
const kSteps = [1, 2, 5];

/// Cholesky factor L, row by row, of the covariance [xx, xy, xz, yy, yz, zz]. L maps the unit sphere to the 1 sigma ellipsoid.
export function cholesky([xx, xy, xz, yy, yz, zz]) {
  const a = Math.sqrt(Math.max(xx, 1e-14));
  const b = xy / a, c = xz / a;
  const d = Math.sqrt(Math.max(yy - b * b, 1e-14));
  const e = (yz - b * c) / d;
  return [a, b, d, c, e, Math.sqrt(Math.max(zz - c * c - e * e, 1e-14))];
}

/// Transform from the unit sphere to the drawn ellipsoid.
export function drawnFactor(covariance, exaggeration) {
  return cholesky(covariance).map(v => Math.max(-kMost_m, Math.min(kSigmas * exaggeration * v, kMost_m)));
}

/// Scale factor of the drawn ellipsoid: a round number, at least 1. Returns `current` while it is suitable.
export function exaggerationFor(covariance, current) {
  const longest = kSigmas * Math.sqrt(Math.max(covariance[0] + covariance[3] + covariance[5], 1e-14));  // an upper bound
  const drawn = longest * current;
  if (drawn <= kTolerance * kLongest_m && drawn >= kLongest_m / 2.5 / kTolerance) return current;
  const wanted = Math.max(1, kLongest_m / longest);
  const decade = 10 ** Math.floor(Math.log10(wanted));
  return decade * kSteps.filter(step => step * decade <= wanted * (1 + 1e-9)).at(-1);
}
