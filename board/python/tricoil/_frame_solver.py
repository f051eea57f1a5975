"""The columns that a tracker would measure along a path, and the poses that it would make of them."""

import numpy as np
from numpy.typing import NDArray

from . import _tricoil
from ._model import COUPLING_CONSTANT
from ._timing import COLUMNS, Timing


def matrices(pose) -> NDArray:
    """Couplings of poses (position_m, quaternion_wxyz) by equation (6), shape (N, 3, 3)."""
    return _tricoil.couplings(*(np.ascontiguousarray(part) for part in pose), COUPLING_CONSTANT, "")


def direct(x: NDArray, near: NDArray):
    """Maximum-likelihood poses of signal matrices, in the hemisphere of the positions `near`."""
    rows = _tricoil.solve(x, np.ones(len(x)), COUPLING_CONSTANT, np.array([1.0, 0.0, 0.0]), "", None)
    position = rows["position_m"].copy()
    position[np.sum(position * near, axis=1) < 0] *= -1
    return position, rows["quaternion_wxyz"].copy()


class FrameSolver:
    """A tracker with a given timing, for the poses that it gave.

    time_s: (N,), without gaps. pose: the given poses (position_m, quaternion_wxyz). age_s: age of each column at each time stamp, (N, 3).
    """

    def __init__(self, time_s: NDArray, pose, age_s: NDArray, timing: Timing):
        self.column_time_s = time_s[:, None] - age_s
        self.middle_s = self.column_time_s.mean(axis=1)
        self._given, self._given_matrices, self._timing = pose, matrices(pose), timing
        steps = timing.slots if timing.solver == "previous-frame" else 1
        self._follows = np.flatnonzero(np.diff(time_s) < (steps + 0.5) * timing.slot_s) + 1  # the given pose before is the tracker's last one

    def at_slots(self, path, shift_s: NDArray | float = 0.0) -> NDArray:
        """Signal matrices of a path with each column at its own time, shape (N, 3, 3). shift_s: of the columns, (N, 3)."""
        x = np.empty((len(self.middle_s), COLUMNS, COLUMNS))
        time_s = self.column_time_s + shift_s
        for coil in range(COLUMNS):
            x[:, :, coil] = matrices(path(time_s[:, coil]))[:, :, coil]
        return x

    def measured(self, path) -> NDArray:
        """The signal matrices that the tracker would take: means over the window of each column, by the two-point rule of Gauss."""
        if not self._timing.window_s:
            return self.at_slots(path)
        half_s = self._timing.window_s / np.sqrt(12)
        return (self.at_slots(path, -half_s) + self.at_slots(path, half_s)) / 2

    def solved(self, x: NDArray, path):
        """The poses that the tracker would make of these matrices, as if their columns were simultaneous."""
        if self._timing.solver == "direct":
            return direct(x, self._given[0])
        start = self._last_poses(path)
        rows = _tricoil.step(x, *(np.ascontiguousarray(part) for part in start), COUPLING_CONSTANT, 1)
        return rows["position_m"], rows["quaternion_wxyz"]

    def _last_poses(self, path):
        """The poses about which the previous-measurement technique linearises; those that were not given: of the columns before, solved directly."""
        frame_s = self._timing.slots * self._timing.slot_s
        is_replaced = np.ones_like(self.column_time_s, bool)
        if self._timing.solver == "previous":  # a step after each column
            is_replaced = self.column_time_s == self.column_time_s.max(axis=1, keepdims=True)
        last = direct(self.at_slots(path, -frame_s * is_replaced), self._given[0])
        for part, given in zip(last, self._given):
            part[self._follows] = given[self._follows - 1]
        return last

    def recovered(self, path) -> NDArray:
        """Matrices at the middle of each column's window: those of the given poses, plus what averaging and solving lost, as this path shows it.

        A pose has six of the nine numbers of its matrix. The other three follow from the path, so the result is exact where the path is.
        """
        return self.at_slots(path) + self._given_matrices - matrices(self.solved(self.measured(path), path))
