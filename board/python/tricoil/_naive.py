"""Poses of a tracker that moves while it measures, predicted from the true motion: columns of different ages, solved as if simultaneous."""

import dataclasses
import itertools

import numpy as np
from scipy.spatial.transform import Rotation

from . import _tricoil
from ._frame_solver import direct, matrices
from ._rotation import rotations, wxyz


class Counter:
    """Numbers of the poses, with those that are missing in gaps."""

    def __init__(self, time_s):
        self.time_s = time_s
        self.interval_s = float(np.median(np.diff(time_s)))
        for _ in range(3):  # rounded time stamps give the interval roughly; all poses give it exactly
            self.row = np.append(0, np.cumsum(np.maximum(1, np.rint(np.diff(time_s) / self.interval_s))))
            self.interval_s = float(np.polyfit(self.row, time_s, 1)[0])

    def rows(self, time_s):
        return np.rint(np.interp(time_s, self.time_s, self.row)).astype(int)


@dataclasses.dataclass(frozen=True)
class Pattern:
    """Coils of one pose: `first` is the newest of row 0, `step` further each row, and the older ones follow in the order `direction`."""

    first: int
    step: int
    direction: int
    counter: "Counter" = dataclasses.field(repr=False)

    def coils(self, time_s):
        """Source coils of each pose, newest first, (N, 3)."""
        row = self.counter.rows(time_s)
        return (self.first + self.step * row[:, None] - self.direction * np.arange(3)) % 3

    def __str__(self):
        def names(coils):
            return " ".join(f"S{coil % 3 + 1}" for coil in coils)

        order = names(self.first - self.direction * age for age in (2, 1, 0))
        return f"coils {order}" if self.step == 0 else f"coils {order} at the first pose, the newest then {names(self.first + self.step * n for n in range(3))}"


def patterns(time_s):
    """All patterns of a tracker with poses at these times."""
    counter = Counter(time_s)
    return [Pattern(first, step, direction, counter) for step, first, direction in itertools.product(range(3), range(3), (1, -1))]


def couplings_of(pair, a, time_s):
    p, turn = pair.expected(a, time_s)
    return matrices((p, wxyz(turn)))


class AgedCouplings:
    """Couplings at the ages 0, slot and 2 slot; the poses of every pattern follow from them."""

    def __init__(self, pair, a, time_s, slot_s, pose=None):
        """pose: that the alignment expects at these times, if it is known already."""
        self.time_s, self.scale = time_s, a.scale
        self.position, self.turn = pose or pair.expected(a, time_s)
        now = matrices((self.position, wxyz(self.turn)))
        self.ages = [now, *(couplings_of(pair, a, time_s - age * slot_s) for age in (1, 2))]

    def error(self, pattern):
        """Motion error of each pose, measured minus true: position (N, 3), and the turn from the true attitude to the measured one.

        A pose that has no solution has the position NaN and no turn; is_known() tells.
        """
        x = np.empty_like(self.ages[0])
        coils = pattern.coils(self.time_s)
        rows = np.arange(len(x))
        for age in range(3):
            x[rows, :, coils[:, age]] = self.ages[age][rows, :, coils[:, age]]
        p, quaternion_wxyz = direct(x, self.position)
        fine = np.isfinite(p[:, 0])
        turn = rotations(np.where(fine[:, None], quaternion_wxyz, wxyz(self.turn)))
        return self.scale * np.where(fine[:, None], p - self.position, np.nan), turn * self.turn.inv()


def is_known(error):
    """Poses whose position error (N, 3) is predicted; the others are left out."""
    return np.isfinite(error).all(axis=1)


def no_error(count):
    return np.zeros((count, 3)), Rotation.identity(count)


def previous_measurement(pair, a, time_s, interval_s, kappa, loop):
    """Error that the previous-measurement technique adds, by (19) to (37) along the true path: measured minus true, (N, 3)."""
    grid = np.arange(time_s[0], time_s[-1] + interval_s, interval_s)
    inside = np.clip(a.reference_time(grid), pair.reference.time_s[0], pair.reference.time_s[-1])
    back = a.middle_s + (inside - a.offset_s - a.middle_s) / (1 + a.rate)
    path, _ = pair.expected(a, back)
    error = -_tricoil.accumulated_error(np.ascontiguousarray(path), kappa, loop)
    return a.scale * error[np.clip(np.rint((time_s - grid[0]) / interval_s).astype(int), 0, len(grid) - 1)]
