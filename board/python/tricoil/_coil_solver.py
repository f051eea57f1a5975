"""Poses of single couplings of real coils: Levenberg-Marquardt from a start, and a cold start without one. The rules of core/solver/refine.hpp and
core/solver/cold_start.hpp, on many rows at once."""

import dataclasses
import itertools

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ._coil_model import Coils
from ._rotation import rotations, wxyz

MOST_STEPS = 20  # trial steps, accepted or not
STEP_TOLERANCE = 1e-4  # of a step, relative to the range and in rad; the remaining error is its square
LONGEST_STEP = (0.35, 0.7)  # relative to the range; rad
MOST_CONDITION = 1e6
PASSES = 5  # corrected direct solutions for each hemisphere
CLEAR_SHARE = 1e-3  # of the allowed misfit: below it no other start is tried
HARDLY = 0.5  # a pass that reduces a small misfit by less is the last
NEARNESS = 7  # range over the sizes of the triads
DIRECTIONS = np.array([d for d in itertools.product((-1.0, 0, 1), repeat=3) if any(d)])[:, ::-1]  # faces, edges and corners of a cube
DIRECTIONS /= np.linalg.norm(DIRECTIONS, axis=1, keepdims=True)
DIRECTION_STARTS = 10


@dataclasses.dataclass
class Fits:
    """position_m (N, 3), quaternion_wxyz (N, 4): sensor frame in the source frame. misfit_share (N): unexplained couplings relative to all, root sum
    squares. converged (N): the misfit is within its limit, too."""

    position_m: NDArray
    quaternion_wxyz: NDArray
    misfit_share: NDArray
    converged: NDArray

    def __getitem__(self, rows) -> "Fits":
        return Fits(*(getattr(self, field.name)[rows] for field in dataclasses.fields(self)))


def turned(quaternion_wxyz: NDArray, rotation_rad: NDArray) -> NDArray:
    """exp(rotation) q of quaternions (N, 4) and rotation vectors (N, 3) in the source frame; q, where a rotation is not finite."""
    return wxyz(Rotation.from_rotvec(np.where(np.isfinite(rotation_rad).all(axis=1, keepdims=True), rotation_rad, 0)) * rotations(quaternion_wxyz))


def _linearised(coils, x, position_m, quaternion_wxyz):
    """Squared misfit, J^T J, J^T r and range; lengths in units of the range."""
    modelled, jacobian = coils.couplings(position_m, rotations(quaternion_wxyz).as_matrix())
    range_m = np.linalg.norm(position_m, axis=1)
    jacobian[:, :, :3] *= range_m[:, None, None]
    residual = modelled - x
    transposed = jacobian.swapaxes(1, 2)
    return np.sum(residual**2, axis=1), transposed @ jacobian, (transposed @ residual[..., None])[..., 0], range_m


def _solved(matrices, rows):
    """NaN for a singular matrix."""
    try:
        return np.linalg.solve(matrices, rows[..., None])[..., 0]
    except np.linalg.LinAlgError:
        regular = np.linalg.cond(matrices, 1) < 1 / np.finfo(float).eps
        return np.where(regular[:, None], np.linalg.solve(np.where(regular[:, None, None], matrices, np.eye(6)), rows[..., None])[..., 0], np.nan)


def _limited(step):
    """Shortened to the region in which the linear model is valid."""
    longest = np.maximum(np.linalg.norm(step[:, :3], axis=1) / LONGEST_STEP[0], np.linalg.norm(step[:, 3:], axis=1) / LONGEST_STEP[1])
    return step / np.maximum(longest, 1)[:, None]


@np.errstate(all="ignore")
def refine(coils: Coils, x: NDArray, position_m: NDArray, quaternion_wxyz: NDArray, most_misfit: float) -> Fits:
    """Minimises |couplings(pose) - x|^2 of each row (N, 9), all with equal weights, from start poses (N, 3), (N, 4), or one for all (3,), (4,)."""
    count = len(x)
    state = [np.array(np.broadcast_to(position_m, (count, 3)), float), np.array(np.broadcast_to(quaternion_wxyz, (count, 4)), float)]
    state += _linearised(coils, x, *state)
    damping, is_done, live = np.zeros(count), np.zeros(count, bool), np.arange(count)
    for _ in range(MOST_STEPS):
        if not live.size:
            break
        position, quaternion, cost, information, gradient, range_m = (value[live] for value in state)
        step = -_limited(_solved(information * (1 + damping[live, None, None] * np.eye(6)), gradient))
        is_finite = np.isfinite(step).all(axis=1)  # not after a singular matrix
        step[~is_finite] = 0
        trial = [position + range_m[:, None] * step[:, :3], turned(quaternion, step[:, 3:])]
        trial += _linearised(coils, x[live], *trial)
        is_tiny = abs(step).max(axis=1) < STEP_TOLERANCE
        is_good = is_finite & np.isfinite(trial[2]) & (is_tiny | (trial[2] <= cost))  # rounding may increase the cost after a tiny step
        for kept, new in zip(state, trial):
            kept[live[is_good]] = new[is_good]
        used = damping[live]
        damping[live] = np.where(is_good, np.where(used > 1e-4, used / 10, 0), np.maximum(8 * used, 1e-2))
        is_last = is_good & is_tiny & (used < 1e-2)
        is_done[live[is_last]] = True
        live = live[~is_last]
    misfit = np.sqrt(state[2] / np.sum(x**2, axis=1))
    return Fits(state[0], state[1], misfit, is_done & (misfit <= most_misfit) & (np.linalg.cond(state[3], 1) <= MOST_CONDITION))


def _svd(matrices):
    return np.linalg.svd(np.where(np.isfinite(matrices).all(axis=(1, 2), keepdims=True), matrices, np.eye(3)))


def _direct(ideal):
    """Range, direction (N, 3) and attitude O (N, 3, 3) of ideal concentric triads with X = O D(u) / range^3 (N, 3, 3), equation (6) of the paper, by
    singular values: X = U diag(s) V^T, range^-3 = (2 s1 + s2 + s3) / 3, u = +-v1, O = U diag(1, -1, -1) V^T."""
    u, s, vt = _svd(ideal)
    return np.cbrt(3 / (2 * s[:, 0] + s[:, 1] + s[:, 2])), vt[:, 0], (u * (1, -1, -1)) @ vt


def _dipole(direction):
    """D(u) = 3/2 u u^T - 1/2 I, (N, 3, 3)."""
    return 1.5 * direction[:, :, None] * direction[:, None] - 0.5 * np.eye(3)


class _Search:
    """One cold start; keeps the best fit so far. Attitudes are matrices O, source components to sensor components, until they are refined."""

    def __init__(self, coils, x, hemisphere, most_misfit):
        self.coils, self.x, self.hemisphere, self.most_misfit = coils, x, hemisphere, most_misfit
        self.small = most_misfit**2 * np.sum(x**2)
        self.before, self.after = np.linalg.inv(coils.sensitivity), np.linalg.inv(coils.moment.T)
        self.ideal = self.undone(x[None])
        self.best = None

    def undone(self, x):
        """Couplings (N, 9) without the gains of the coils, (N, sensor coil, source coil)."""
        return self.before @ x.reshape(-1, 3, 3).swapaxes(1, 2) @ self.after

    def rated(self, position_m, o):
        modelled, _ = self.coils.centred.couplings(position_m, o.swapaxes(1, 2))
        cost = np.sum((modelled - self.x) ** 2, axis=1)
        return modelled, np.where(np.isfinite(cost), cost, np.finfo(float).max)

    def passes(self, position_m, o, count):
        """The best of up to `count` direct solutions of couplings that are corrected, at the last solution, for what distinguishes the coils from ideal
        triads."""
        modelled, cost = self.rated(position_m, o)
        best = [position_m.copy(), o.copy(), cost]
        is_live = np.full(len(o), True)
        for _ in range(count):
            range_m = np.linalg.norm(position_m, axis=1)
            ideal = o @ _dipole(position_m / range_m[:, None]) / range_m[:, None, None] ** 3
            distance_m, direction, o = _direct(self.undone(self.x - modelled) + ideal)
            sign = np.where(np.sum(direction * position_m, axis=1) < 0, -1, 1)
            position_m = (sign * distance_m)[:, None] * direction
            modelled, cost = self.rated(position_m, o)
            is_settled = (cost < self.small) & (cost > HARDLY * best[2])
            is_better = is_live & (cost < best[2])
            for kept, new in zip(best, (position_m, o, cost)):
                kept[is_better] = new[is_better]
            is_live &= ~is_settled
        return best

    def is_clear(self, fit):
        return fit.converged and fit.misfit_share < CLEAR_SHARE * self.most_misfit

    def try_starts(self, position_m, o, cost, most):
        """Refines starts, that of the smallest cost first, until one is clear."""
        order = np.argsort(cost, kind="stable")[:most]
        turn = o[order].swapaxes(1, 2)
        turn = turn * np.sign(np.linalg.det(turn))[:, None, None]
        source, sensor = self.coils.centres_m
        fits = refine(self.coils, np.tile(self.x, (len(order), 1)), position_m[order] + source - turn @ sensor, wxyz(Rotation.from_matrix(turn)), self.most_misfit)
        for fit in map(fits.__getitem__, range(len(order))):
            if self.best is None or (not fit.converged, fit.misfit_share) < (not self.best.converged, self.best.misfit_share):
                self.best = fit
            if self.is_clear(self.best):
                break

    def is_near(self):
        """There are minima then that are not mirror images of each other."""
        size = sum(np.linalg.norm(offsets, axis=1).max() for offsets in (self.coils.centred.source_m, self.coils.centred.sensor_m))
        return np.linalg.norm(self.best.position_m) < NEARNESS * size

    def try_directions(self, range_m):
        """Starts in all directions, each with the attitude that is best there: the polar factor of X D(u)."""
        directions = DIRECTIONS[DIRECTIONS @ self.hemisphere >= 0]
        u, _, vt = _svd(self.ideal @ _dipole(directions))
        self.try_starts(*self.passes(range_m * directions, u @ vt, 1), DIRECTION_STARTS)

    def run(self):
        range_m, direction, o = _direct(self.ideal)
        sides = np.array([1.0] if self.hemisphere.any() else [1.0, -1.0]) * (-1 if direction[0] @ self.hemisphere < 0 else 1)
        near = sides[:, None] * range_m * direction
        self.try_starts(*self.passes(near, np.repeat(o, len(sides), axis=0), PASSES), len(sides))
        if not self.best.converged or (not self.is_clear(self.best) and self.is_near()):
            self.try_directions(range_m)
        return self.best


@np.errstate(all="ignore")
def solve_cold(coils: Coils, x: NDArray, hemisphere: NDArray, most_misfit: float) -> Fits:
    """Pose of couplings (9) without a previous pose, one row of Fits. hemisphere (3): direction to the half space of the sensor, source frame; zero: unknown,
    then coil offsets distinguish both. Starts from the direct solutions of both hemispheres, and near the coils from other directions."""
    return _Search(coils, x, np.asarray(hemisphere, float), most_misfit).run()
