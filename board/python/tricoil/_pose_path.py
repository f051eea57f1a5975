"""A smooth path through poses."""

import numpy as np
from numpy.typing import NDArray

END = 9  # rows of the parabola beyond an end
DEGREE = 5  # of the splines; errors of a motion of 6 Hz through 120 poses a second are below 1e-6 of its size


class Curve:
    """Spline through rows of values, shape (N, ...), N at least 4. Beyond the ends: a parabola through the last rows, which amplifies noise less."""

    def __init__(self, time_s: NDArray, values: NDArray):
        from scipy.interpolate import make_interp_spline

        self._spline = make_interp_spline(time_s, values, k=DEGREE if len(time_s) > DEGREE else 3, axis=0)
        self._ends = (time_s[0], time_s[-1])
        self._parabolas = [_parabola(time_s[:END], values[:END], time_s[0]), _parabola(time_s[-END:], values[-END:], time_s[-1])]

    def __call__(self, time_s: NDArray) -> NDArray:
        values = self._spline(np.clip(time_s, *self._ends))
        for end, parabola, is_beyond in zip(self._ends, self._parabolas, (time_s < self._ends[0], time_s > self._ends[1])):
            values[is_beyond] = np.tensordot(np.vander(time_s[is_beyond] - end, 3), parabola, 1)
        return values


def _parabola(time_s, values, origin_s):
    """Coefficients of the best parabola, highest power first, shape (3, ...)."""
    return np.tensordot(np.linalg.pinv(np.vander(time_s - origin_s, 3)), values, 1)


def continuous(quaternion_wxyz: NDArray) -> NDArray:
    """The same attitudes with signs such that neighbours are close."""
    turned = np.sum(quaternion_wxyz[1:] * quaternion_wxyz[:-1], axis=1) < 0
    signs = np.append(1.0, np.where(np.cumsum(turned) % 2, -1.0, 1.0))
    return quaternion_wxyz * signs[:, None]


class PosePath:
    """Position and attitude at any time, by splines through poses."""

    def __init__(self, time_s: NDArray, position_m: NDArray, quaternion_wxyz: NDArray):
        self._curve = Curve(time_s, np.hstack((position_m, continuous(quaternion_wxyz))))

    def __call__(self, time_s: NDArray) -> tuple[NDArray, NDArray]:
        """position_m (N, 3) and quaternion_wxyz (N, 4)."""
        values = self._curve(time_s)
        return values[:, :3], values[:, 3:] / np.linalg.norm(values[:, 3:], axis=1)[:, None]


def difference(true, measured) -> NDArray:
    """True minus measured pose: position (m), then small rotation (rad), both in the source frame. Poses are (position_m, quaternion_wxyz); shape (N, 6)."""
    from ._rotation import rotations

    turn = rotations(true[1]) * rotations(measured[1]).inv()
    return np.hstack((true[0] - measured[0], turn.as_rotvec()))
