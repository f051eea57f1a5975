"""Poses of successive couplings, each found from the one before."""

import dataclasses

import numpy as np
from numpy.typing import NDArray

from ._coil_model import Coils
from ._coil_solver import refine, solve_cold
from ._rotation import rotations

MOST_ROWS = 256  # that are solved at once, from the same start
NEAR = (0.03, 0.05)  # from the start, relative to the range and rad: there the start cannot change which minimum is found


@dataclasses.dataclass
class PoseTrack:
    """position_m (N, 3), quaternion_wxyz (N, 4): poses; of a row without a solution, those of the last one with it. turned_rad (N, 3): sum of the small rotations
    so far, source frame. is_solved (N). is_known (N): the row is at or after a cold start, and the pose has not been lost since. is_start (N): cold start."""

    position_m: NDArray
    quaternion_wxyz: NDArray
    turned_rad: NDArray
    is_solved: NDArray
    is_known: NDArray
    is_start: NDArray

    def __getitem__(self, rows) -> "PoseTrack":
        return PoseTrack(*(getattr(self, field.name)[rows] for field in dataclasses.fields(self)))

    def __len__(self):
        return len(self.is_solved)


class _Tracker:
    def __init__(self, coils, x, ratio, hemisphere, most_misfit):
        self.coils, self.x, self.ratio, self.hemisphere, self.most_misfit = coils, x, ratio, hemisphere, most_misfit
        count = len(x)
        self.track = PoseTrack(np.zeros((count, 3)), np.zeros((count, 4)), np.zeros((count, 3)), *np.zeros((3, count), bool))
        self.position_m, self.quaternion_wxyz = np.array([1.0, 0, 0]), np.array([1.0, 0, 0, 0])
        self.is_known, self.rows = False, 1

    def start(self, at):
        """Number of rows, 1."""
        fit = solve_cold(self.coils, self.x[at], self.hemisphere, self.most_misfit)
        self.is_known = bool(fit.converged)
        if self.is_known:
            sign = -1 if fit.quaternion_wxyz @ self.quaternion_wxyz < 0 else 1
            self.position_m, self.quaternion_wxyz = fit.position_m, sign * fit.quaternion_wxyz
        self.put(slice(at, at + 1), self.position_m, self.quaternion_wxyz, self.is_known)
        self.track.is_start[at] = self.is_known
        return 1

    def step(self, at):
        """Solves a block of rows from the last pose and returns how many of them are used: up to the first that is far, or not solved."""
        fits = refine(self.coils, self.x[at:at + self.rows], self.position_m, self.quaternion_wxyz, self.most_misfit)
        moved = np.linalg.norm(fits.position_m - self.position_m, axis=1) / np.linalg.norm(self.position_m)
        cosine = abs(fits.quaternion_wxyz @ self.quaternion_wxyz)
        is_near = fits.converged & (moved < NEAR[0]) & (cosine > np.cos(NEAR[1] / 2))
        count = len(is_near) if is_near.all() else max(1, int(np.argmin(is_near)))
        self.rows = min(2 * self.rows, MOST_ROWS) if is_near.all() else count
        if fits.converged[0]:
            self.position_m, self.quaternion_wxyz = fits.position_m[count - 1], fits.quaternion_wxyz[count - 1]
            used = fits[:count]
            self.put(slice(at, at + count), used.position_m, used.quaternion_wxyz, True)
        else:
            self.put(slice(at, at + 1), self.position_m, self.quaternion_wxyz, False)
        return count

    def put(self, rows, position_m, quaternion_wxyz, is_solved):
        track = self.track
        track.position_m[rows], track.quaternion_wxyz[rows], track.is_solved[rows], track.is_known[rows] = position_m, quaternion_wxyz, is_solved, self.is_known

    def run(self):
        at = 0
        while at < len(self.x):
            at += self.step(at) if self.is_known else self.start(at)
            if at % self.ratio == 0:
                self.is_known = self.is_known and bool(self.track.is_solved[at - 1])
        solved = np.flatnonzero(self.track.is_solved)
        if solved.size:
            poses = rotations(self.track.quaternion_wxyz[solved])
            small = np.zeros((len(self.x), 3))
            small[solved[1:]] = (poses[1:] * poses[:-1].inv()).as_rotvec()
            small[self.track.is_start] = 0
            self.track.turned_rad = np.cumsum(small, axis=0)
        return self.track


def follow(coils: Coils, x: NDArray, ratio: int, hemisphere: NDArray, most_misfit: float) -> PoseTrack:
    """Poses of couplings (N, 9), each of which depends on rows up to its own. Begins with a cold start towards `hemisphere` (3), zero: unknown. After each
    `ratio` rows, the line of the other band, a sensor whose last row has no solution may be anywhere: then it starts again. most_misfit: share of the
    couplings beyond which no dipole explains them."""
    return _Tracker(coils, x, ratio, hemisphere, most_misfit).run()
