// Quaternions [w, x, y, z].
export function conjugate([w, x, y, z]) { return [w, -x, -y, -z]; }

export function product([a, b, c, d], [e, f, g, h]) {
  return [a*e - b*f - c*g - d*h, a*f + b*e + c*h - d*g, a*g - b*h + c*e + d*f, a*h + b*g - c*f + d*e];
}

/// Azimuth, elevation and roll in degrees, as defined in core/geometry.
export function eulerAngles([w, x, y, z]) {
  const degrees = 180 / Math.PI;
  return [Math.atan2(2*(x*y + w*z), 1 - 2*(y*y + z*z)), Math.asin(Math.max(-1, Math.min(1, 2*(w*y - x*z)))),
          Math.atan2(2*(y*z + w*x), 1 - 2*(x*x + y*y))].map(a => a * degrees);
}
