// Quaternions [w, x, y, z], and their angles in the conventions that the page offers.
const kDegrees = 180 / Math.PI;

export function conjugate([w, x, y, z]) { return [w, -x, -y, -z]; }

export function product([a, b, c, d], [e, f, g, h]) {
  return [a * e - b * f - c * g - d * h, a * f + b * e + c * h - d * g, a * g - b * h + c * e + d * f, a * h + b * g - c * f + d * e];
}

export function rotated([w, x, y, z], [a, b, c]) { return product(product([w, x, y, z], [0, a, b, c]), conjugate([w, x, y, z])).slice(1); }

/// Attitude relative to the boresight, if there is one.
export const relative = (q, boresight) => boresight ? product(q, conjugate(boresight)) : q;

const clamped = v => Math.max(-1, Math.min(1, v));

/// Angles of each convention, in degrees, with their names.
export const kConventions = {
  // As core/geometry defines them: about z, then the new y, then the new x.
  zyx: {
    label: 'azimuth, elevation, roll',
    names: ['azimuth', 'elevation', 'roll'],
    angles: ([w, x, y, z]) =>
        [Math.atan2(2 * (x * y + w * z), 1 - 2 * (y * y + z * z)), Math.asin(clamped(2 * (w * y - x * z))),
         Math.atan2(2 * (y * z + w * x), 1 - 2 * (x * x + y * y))]
  },
  xyz: {
    label: 'x, then new y, then new z',
    names: ['x angle', 'y angle', 'z angle'],
    angles: ([w, x, y, z]) =>
        [Math.atan2(2 * (w * x - y * z), 1 - 2 * (x * x + y * y)), Math.asin(clamped(2 * (x * z + w * y))),
         Math.atan2(2 * (w * z - x * y), 1 - 2 * (y * y + z * z))]
  },
  vector: {
    label: 'rotation vector',
    names: ['vector x', 'vector y', 'vector z'],
    angles: ([w, x, y, z]) => {
      const sine = Math.hypot(x, y, z);
      const angle = 2 * Math.atan2(sine, Math.abs(w)) * Math.sign(w || 1);
      return sine < 1e-12 ? [0, 0, 0] : [x, y, z].map(v => v / sine * angle);
    }
  },
};

/// turn: {order, boresight}.
export function angles(q, {order, boresight}) { return kConventions[order].angles(relative(q, boresight)).map(a => a * kDegrees); }
