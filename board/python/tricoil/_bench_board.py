"""Distances on a board of known holes, and the scale or shear that explains their errors."""

import dataclasses

import numpy as np
from numpy.typing import NDArray

from . import _bench_pivot
from ._bench_match import distances, rigid
from ._bench_segments import matrices
from ._poses import PoseError, Poses

AXES = "xyz"
SHARES = {  # symmetric strains of the frame; the other part of an affine map is a rotation
    "scale": np.eye(3),
    **{f"scale {axis}": np.diag(np.eye(3)[n]) for n, axis in enumerate(AXES)},
    **{f"shear {AXES[a]}{AXES[b]}": np.outer(np.eye(3)[a], np.eye(3)[b]) + np.outer(np.eye(3)[b], np.eye(3)[a]) for a, b in ((0, 1), (0, 2), (1, 2))},
}
SIX = tuple(name for name in SHARES if name != "scale")
LIKELIHOOD = 0.01  # of a smaller residual by chance
SAME_AXIS_RAD = 0.1
PASSES = 5
LEAST_DETERMINED = 1e-3
LESS = 0.99  # residual of the poses in the divots, over that with the strain
LEAST_M = 1e-6  # RMS that needs no explanation


@dataclasses.dataclass
class Fit:
    """A rigid motion of the holes, with strains and, for `tip`, a shift of the tip. values and std by name; rms_m, 3D; squares: their sum."""

    values: dict
    std: dict
    squares: float
    free: int
    residual_m: NDArray
    turn: NDArray
    tip_m: NDArray | None = None

    @property
    def rms_m(self):
        return float(np.sqrt(self.squares / len(self.residual_m)))


def fit(points: NDArray, holes: NDArray, names: tuple = (), mean_turn: NDArray | None = None) -> Fit | None:
    """Least squares: point = (1 + strain) (turn hole + shift) [- mean_turn tip]. None if these points do not determine it."""
    turn, shift = rigid(holes, points)
    count = 6 + len(names) + (3 if mean_turn is not None else 0)
    if 3 * len(points) <= count:
        return None
    for _ in range(PASSES):
        moved = (holes - holes.mean(axis=0)) @ turn.T
        columns = [np.tile(np.eye(3)[n], (len(points), 1)) for n in range(3)]
        columns += [np.cross(np.eye(3)[n], moved) for n in range(3)]
        columns += [moved @ SHARES[name].T for name in names]
        columns += [-mean_turn[:, :, n] for n in range(3)] if mean_turn is not None else []
        design = np.stack([column.ravel() for column in columns], axis=1)
        lengths = np.linalg.norm(design, axis=0)
        if lengths.min() == 0 or np.linalg.svd(design / lengths, compute_uv=False)[-1] < 1e-3:
            return None
        x = np.linalg.lstsq(design, (points - points.mean(axis=0) - moved).ravel(), rcond=None)[0]
        size = np.linalg.norm(x[3:6])
        if size > 0:
            from scipy.spatial.transform import Rotation

            turn = Rotation.from_rotvec(x[3:6]).as_matrix() @ turn
    moved = (holes - holes.mean(axis=0)) @ turn.T
    design_values = x.copy()
    design_values[3:6] = 0
    left = ((points - points.mean(axis=0) - moved).ravel() - design @ design_values).reshape(-1, 3)
    squares, free = float(np.sum(left**2)), left.size - count
    std = np.sqrt(np.diag(np.linalg.inv(design.T @ design)) * squares / free)
    ends = 6 + len(names)
    return Fit(dict(zip(names, x[6:ends])), dict(zip(names, std[6:ends])), squares, free, left, turn, x[ends:] if mean_turn is not None else None)


def is_better(one: Fit, than: Fit, tried: int) -> bool:
    """F test, with Bonferroni's correction for the number of tried models."""
    from scipy.stats import f

    more = than.free - one.free
    ratio = (than.squares - one.squares) / more / max(one.squares / one.free, 1e-30)
    return bool(f.sf(ratio, more, one.free) * tried < LIKELIHOOD)


def explained(points: NDArray, holes: NDArray) -> tuple[Fit, Fit]:
    """The rigid fit, and the one with the fewest strains, added one by one, that leaves nothing significant."""
    plain = best = fit(points, holes)
    if plain is None:
        raise PoseError("the points are in fewer than three holes, or in one line; measure holes that are not in one line")
    while best.rms_m > LEAST_M:
        tried = [one for name in SHARES if name not in best.values and (one := fit(points, holes, (*best.values, name))) is not None]
        better = min(tried, key=lambda one: one.squares, default=None)
        if better is None or not is_better(better, best, len(tried)):
            break
        best = better
    return plain, best


def of_sensor(poses: Poses, holes: NDArray, pivots) -> tuple[NDArray, NDArray, dict] | None:
    """Points, tip, and deviations of the strains by the noise of the poses, without the error of the lever, if the strain is that of the sensor's positions; None if the poses in the divots say otherwise.

    The lever from the sensor to the tip is not strained: poses at several tilts contradict each other, and tip and points are wrong. Least squares
    of (1 - strain) position + attitude tip = turn hole + shift, over all poses in divots.
    """
    p, turns, which = _in_divots(poses, pivots)
    board_turn = rigid(holes, pivots.center_m)[0]
    for _ in range(PASSES):
        moved = (holes - holes.mean(axis=0))[which] @ board_turn.T
        columns = [-p @ SHARES[name].T for name in SIX] + [turns[:, :, n] for n in range(3)]
        columns += [np.tile(-np.eye(3)[n], (len(p), 1)) for n in range(3)] + [-np.cross(np.eye(3)[n], moved) for n in range(3)]
        design = np.stack([column.ravel() for column in columns], axis=1)
        if np.linalg.svd(design / np.linalg.norm(design, axis=0), compute_uv=False)[-1] < LEAST_DETERMINED * np.sqrt(len(p)):
            return None
        x, squares, *_ = np.linalg.lstsq(design, (moved - p).ravel(), rcond=None)
        from scipy.spatial.transform import Rotation

        board_turn = Rotation.from_rotvec(x[-3:]).as_matrix() @ board_turn
    without = np.eye(3) - sum(value * SHARES[name] for value, name in zip(x, SIX))
    found = _bench_pivot.solve(dataclasses.replace(poses, position_m=poses.position_m @ without.T), pivots.segments)
    if found.residual_rms_m > LESS * pivots.residual_rms_m:
        return None
    std = np.sqrt(np.diag(np.linalg.inv(design.T @ design))[:len(SIX)] * squares[0] / (design.shape[0] - design.shape[1]))
    deviations = {**dict(zip(SIX, std)), "scale": float(np.linalg.norm(std[:3]) / 3)}
    return found.center_m @ np.linalg.inv(without).T, found.tip_m, deviations


def _in_divots(poses, pivots):
    """Positions about their mean, attitudes, and the divot, of the poses that pivots used."""
    rows = [np.arange(one.begin, one.end)[good] for one, good in zip(pivots.segments, pivots.used)]
    which = np.repeat(np.arange(len(rows)), list(map(len, rows)))
    rows = np.concatenate(rows)
    return poses.position_m[rows] - poses.position_m[rows].mean(axis=0), matrices(poses)[rows], which


def board_axis(name: str, turn: NDArray) -> str | None:
    """Axis of the board that is parallel to the axis of a scale; None: there is none."""
    if not name.startswith("scale "):
        return None
    along = np.abs(turn[AXES.index(name[-1])])
    n = int(np.argmax(along))
    return AXES[n] if np.arccos(min(1, along[n])) < SAME_AXIS_RAD else None


def spread(points, holes, which) -> dict:
    """Errors of all distances between points in different holes: trueness (mean), precision (standard deviation); ASTM F2554."""
    pairs = [(a, b) for a in range(len(points)) for b in range(a + 1, len(points)) if which[a] != which[b]]
    a, b = np.array(pairs).T
    nominal = distances(holes)[a, b]
    error = distances(points)[a, b] - nominal

    def without(n):
        keep = (a != n) & (b != n)
        return error[keep].mean() if keep.any() else error.mean()

    left_out = np.array([without(n) for n in range(len(points))])
    deviation = np.sqrt((len(points) - 1) / len(points) * np.sum((left_out - left_out.mean()) ** 2))  # jackknife: pairs share their points
    return {
        "pairs": len(pairs),
        "trueness_m": float(error.mean()),
        "trueness_std_m": float(deviation),
        "precision_m": float(error.std(ddof=1)) if len(error) > 1 else 0.0,
        "rms_m": float(np.sqrt(np.mean(error**2))),
        "max_m": float(np.abs(error).max()),
        "longest_m": float(nominal.max()),
    }


def repeatability(points, which) -> float | None:
    """Standard deviation of a point about the mean of its hole (3D), m; None if no hole was measured twice."""
    squares, free = 0.0, 0
    for hole in set(which):
        here = points[which == hole]
        squares += float(np.sum((here - here.mean(axis=0)) ** 2))
        free += len(here) - 1
    return float(np.sqrt(squares / free)) if free else None


def compare(points: NDArray, board, which: NDArray, pivots=None, poses: Poses | None = None) -> dict:
    """Points against their holes. Lengths in m; strains: measured over true length, minus 1. pivots: of poses, that gave the points."""
    holes = board.position_m[which]
    plain, best = explained(points, holes)
    seen = of_sensor(poses, holes, pivots) if pivots is not None and plain.rms_m > LEAST_M else None
    if seen is not None:
        best = explained(seen[0], holes)[1]
    every = fit(points if seen is None else seen[0], holes, SIX)
    strains = [{"name": name, "value": float(best.values[name]), "std": float(np.hypot(best.std[name], 0 if seen is None else seen[2][name])), "board_axis": board_axis(name, best.turn)} for name in best.values]
    result = {
        "board": board.name,
        "holes": [board.names[n] for n in which],
        "distances": spread(points, holes, which),
        "repeatability_m": repeatability(points, which),
        "rms_m": plain.rms_m,
        "residuals_m": np.linalg.norm(plain.residual_m, axis=1).tolist(),
        "strains": strains,
        "explained_rms_m": best.rms_m,
        "affine": None if every is None else {name: {"value": float(every.values[name]), "std": float(every.std[name])} for name in every.values},
        "tip_without_strain_m": seen[1].tolist() if seen is not None and strains else None,
        "tip_shift": None,
    }
    moved = fit(points, holes, (), pivots.turn) if pivots is not None else None
    if strains and moved is not None and is_better(moved, plain, 1):
        sigmas = float(np.sqrt(moved.tip_m @ np.linalg.pinv(pivots.tip_covariance_m2) @ moved.tip_m))
        result["tip_shift"] = {"tip_m": moved.tip_m.tolist(), "rms_m": moved.rms_m, "sigmas": sigmas}
    return result
