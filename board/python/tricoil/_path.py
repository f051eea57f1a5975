"""A recorded motion as a continuous path: smoothing splines between its gaps."""

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.linalg import solveh_banded

from ._pose_path import continuous
from ._rotation import rotations

GAP = 4.0  # a longer pause is a gap, in median sample intervals
FEWEST = 5  # samples of a segment
STRENGTHS = np.logspace(-6, 6, 25)  # of the smoothing, lambda / h^3


def smoothed(x, y, strength):
    """Values at x of the natural cubic smoothing spline (Reinsch 1967). y: (N, D). strength: lambda / h^3, h the median step."""
    h = np.diff(x)
    scale = strength * np.median(h) ** 3
    n = len(x) - 2
    # Q^T y are second divided differences; R is tridiagonal. (R + lambda Q^T Q) gamma = Q^T y.
    a, b = 1 / h[:-1], 1 / h[1:]
    c = -(a + b)
    bands = np.zeros((3, n))
    bands[2] = (h[:-1] + h[1:]) / 3 + scale * (a * a + b * b + c * c)
    bands[1, 1:] = h[1:-1] / 6 + scale * (c[:-1] * a[1:] + b[:-1] * c[1:])
    bands[0, 2:] = scale * b[:-2] * a[2:]
    second = a[:, None] * y[:-2] + c[:, None] * y[1:-1] + b[:, None] * y[2:]
    gamma = solveh_banded(bands, second, check_finite=False)
    moved = np.zeros_like(y)
    moved[:-2] += a[:, None] * gamma
    moved[1:-1] += c[:, None] * gamma
    moved[2:] += b[:, None] * gamma
    return y - scale * moved


def freedom(count, strength):
    """Degrees of freedom of the smoothing spline of equally spaced samples, from its frequency response."""
    w = np.pi * (np.arange(count) + 0.5) / count
    return np.sum(1 / (1 + strength * 16 * np.sin(w / 2) ** 4 * 3 / (2 + np.cos(w))))


def best_strength(segments, values):
    """Strength with the lowest generalised cross-validation over all segments, and the variance of the noise and of the spline."""
    count = sum(map(len, segments))
    best = (np.inf, STRENGTHS[0], 0.0, 0.0)
    for strength in STRENGTHS:
        squares = sum(np.sum((smoothed(x, y, strength) - y) ** 2) for x, y in zip(segments, values))
        free = freedom(count, strength)
        score = squares / max(count - free, 1e-9) ** 2
        if score < best[0]:
            noise = squares / max(count - free, 1e-9)
            best = (score, strength, noise, noise * free / count)
    return best[1:]


class Path:
    """Position and attitude at any time between the gaps.

    time_s: (N,). position_m: (N, 3). quaternion_wxyz: (N, 4) or None. After that: noise_m2, variance of one sample's noise (3D), and
    spline_m2, variance of the path (3D).
    """

    def __init__(self, time_s, position_m, quaternion_wxyz=None):
        self.time_s = time_s
        self.interval_s = float(np.median(np.diff(time_s)))
        breaks = np.flatnonzero(np.diff(time_s) > GAP * self.interval_s) + 1
        parts = [part for part in np.split(np.arange(len(time_s)), breaks) if len(part) >= FEWEST]
        self.begin = np.array([time_s[part[0]] for part in parts])
        self.end = np.array([time_s[part[-1]] for part in parts])
        self.has_attitude = quaternion_wxyz is not None
        x = [time_s[part] for part in parts]
        self.position, (self.noise_m2, self.spline_m2) = self.splines(x, [position_m[part] for part in parts])
        if self.has_attitude:
            q = continuous(np.asarray(quaternion_wxyz))
            self.attitude, _ = self.splines(x, [q[part] for part in parts])

    @staticmethod
    def splines(x, y):
        if not x:
            return [], (0.0, 0.0)
        strength, noise, spline = best_strength(x, y)
        return [CubicSpline(one, smoothed(one, values, strength), bc_type="natural") for one, values in zip(x, y)], (noise, spline)

    def covers(self, time_s, before_s=0.0):
        """True where the path is known, also before_s earlier; not within one sample of a gap."""
        if not len(self.begin):
            return np.zeros(len(time_s), bool)
        n = np.clip(np.searchsorted(self.begin, time_s, side="right") - 1, 0, None)
        edge = self.interval_s
        return (time_s - before_s >= self.begin[n] + edge) & (time_s <= self.end[n] - edge)

    def _each(self, splines, time_s, width, derivative):
        out = np.empty((len(time_s), width))
        n = np.clip(np.searchsorted(self.begin, time_s, side="right") - 1, 0, None)
        for one in np.unique(n):
            rows = n == one
            out[rows] = splines[one](np.clip(time_s[rows], self.begin[one], self.end[one]), derivative)
        return out

    def p(self, time_s, derivative=0):
        """Position, m, or its derivative, (N, 3)."""
        return self._each(self.position, time_s, 3, derivative)

    def turn(self, time_s):
        """Attitude as a Rotation."""
        return rotations(self._each(self.attitude, time_s, 4, 0))

    def rate(self, time_s):
        """Angular rate in the frame of the path, rad/s, (N, 3): 2 dq/dt conj(q)."""
        q, d = self._each(self.attitude, time_s, 4, 0), self._each(self.attitude, time_s, 4, 1)
        square = np.sum(q * q, axis=1)[:, None]
        w, v, dw, dv = q[:, :1], q[:, 1:], d[:, :1], d[:, 1:]
        return 2 * (w * dv - dw * v - np.cross(dv, v)) / square

    def coverage(self):
        return float(np.sum(self.end - self.begin))
