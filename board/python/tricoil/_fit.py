"""Least-squares fit of an alignment and of a model of the motion error; choice between models."""

import dataclasses

import numpy as np

from . import _align, _naive
from ._align import UNKNOWNS, Alignment, Pair
from ._path import Path
from ._rotation import rotations, wxyz

HUBER = 4.0  # residuals beyond this many deviations have less weight
FIRST_SLOT_S = 1e-3
LEAST_KNOWN = 0.5  # share of the poses that a pattern must predict
SHORTEST_SLOT_S, LONGEST_SLOT_S = 1e-4, 20e-3
SURE = 40.0  # twice the logarithm of the likelihood ratio, for a choice among eighteen patterns
# Standard deviations of what is known before the fit.
PRIORS = {_align.RATE: 1e-4, _align.SCALE: 0.05}


@dataclasses.dataclass
class Fit:
    """An alignment with its model of the motion error. square: of each fitted pose's residual, in noise variances, limited (Huber)."""

    alignment: Alignment
    pattern: _naive.Pattern | None
    square: np.ndarray
    residual: np.ndarray
    deviations: np.ndarray  # of the 15 unknowns, then of the slot
    sigma_m: float


def deviation(r):
    """Deviation of one axis, of vectors (N, 3) of which a few may be outliers: without the longest twentieth."""
    square = np.sort(np.sum(r * r, axis=1))[: max(1, round(0.95 * len(r)))]
    return max(float(np.sqrt(np.mean(square) / 3)) / 0.932, 1e-9)


def huber(z):
    """Weights, and the limited squares, of normalised lengths."""
    weight = np.minimum(1, HUBER / np.maximum(z, 1e-12))
    return weight, np.where(z < HUBER, z * z, HUBER * (2 * z - HUBER))


def refine(pair, a, rows, pattern=None, extra=None, steps=10):
    """Least squares with limited weight of outliers. extra: a part of the predicted position error that does not change."""
    t = pair.poses.time_s[rows]
    slot = a.slot_s if pattern is not None else 0.0
    previous = np.inf
    for _ in range(steps):
        more = slot + max(0.02 * slot, 2e-5)
        error, turn = error_2, turn_2 = _naive.no_error(len(t))
        pose = pair.expected(a, t)
        if pattern:
            error, turn = _naive.AgedCouplings(pair, a, t, slot, pose).error(pattern)
            error_2, turn_2 = _naive.AgedCouplings(pair, a, t, more, pose).error(pattern)
        known = _naive.is_known(error) & _naive.is_known(error_2)
        if not known.all():
            rows, t, error, turn, error_2, turn_2 = (one[known] for one in (rows, t, error, turn, error_2, turn_2))
            extra = None if extra is None else extra[known]
            pose = tuple(one[known] for one in pose)
        r, r_turn = _align.residuals(pair, a, rows, error if extra is None else error + extra, turn, pose)
        of_p, of_turn = _align.jacobian(pair, a, rows, pose)
        if pattern:
            of_p = np.concatenate((of_p, ((error_2 - error) / (more - slot))[:, :, None]), axis=2)
            if of_turn is not None:
                of_turn = np.concatenate((of_turn, ((turn_2 * turn.inv()).as_rotvec() / (more - slot))[:, :, None]), axis=2)
        x, deviations, square, sigma = step(a, r, r_turn, of_p, of_turn)
        a = _align.moved(a, x)
        if pattern:
            slot = float(np.clip(slot + x[UNKNOWNS], 1e-6, LONGEST_SLOT_S))
            a.slot_s = slot
        if abs(previous - square.sum() * sigma**2) < 1e-5 * square.sum() * sigma**2:
            break
        previous = square.sum() * sigma**2
    return Fit(a, pattern, square, r, deviations, sigma)


def normal_equations(weight, of, r):
    """Matrix and right side of least squares. weight: (N,). of: derivatives, (N, 3, K). r: (N, 3)."""
    flat, weighted = of.reshape(-1, of.shape[2]), (weight[:, None, None] * of).reshape(-1, of.shape[2])
    return weighted.T @ flat, weighted.T @ r.ravel()


def step(a, r, r_turn, of_p, of_turn):
    """One step of the unknowns, their deviations, limited squares of the positions, and the deviation of one axis."""
    count = of_p.shape[2]
    sigma = deviation(r)
    weight, square = huber(np.linalg.norm(r, axis=1) / sigma)
    normal, right = normal_equations(weight / sigma**2, of_p, r)
    if r_turn is not None:
        sigma_turn = deviation(r_turn)
        w = huber(np.linalg.norm(r_turn, axis=1) / sigma_turn)[0]
        both = normal_equations(w / sigma_turn**2, of_turn, r_turn)
        normal, right = normal + both[0], right + both[1]
    for unknown, (prior, value) in {_align.RATE: (PRIORS[_align.RATE], a.rate), _align.SCALE: (PRIORS[_align.SCALE], a.scale - 1)}.items():
        normal[unknown, unknown] += 1 / prior**2
        right[unknown] -= value / prior**2
    scale = 1 / np.sqrt(np.maximum(np.diag(normal), 1e-30))
    scaled = scale[:, None] * normal * scale + 1e-9 * np.eye(count)  # unknowns that the motion does not show stay where they are
    x = scale * np.linalg.solve(scaled, scale * right)
    return x, scale * np.sqrt(np.diag(np.linalg.inv(scaled))), square, sigma


def screened(pair, fit, rows, all_patterns):
    """Patterns, best first, by one linear step from the fit without skew."""
    t, a = pair.poses.time_s[rows], fit.alignment
    pose = pair.expected(a, t)
    r, r_turn = _align.residuals(pair, a, rows, *_naive.no_error(len(t)), pose)
    of_p, of_turn = _align.jacobian(pair, a, rows, pose)
    aged = _naive.AgedCouplings(pair, a, t, FIRST_SLOT_S, pose)
    found = []
    for number, pattern in enumerate(all_patterns):
        error, turn = aged.error(pattern)
        known = _naive.is_known(error)
        if known.mean() < LEAST_KNOWN:
            continue
        p = np.concatenate((of_p, (error / FIRST_SLOT_S)[:, :, None]), axis=2)[known]
        q = None if of_turn is None else np.concatenate((of_turn, (turn.as_rotvec() / FIRST_SLOT_S)[:, :, None]), axis=2)[known]
        of_known, turn_of_known = r[known], None if q is None else r_turn[known]
        x = step(a, of_known, turn_of_known, p, q)[0]
        left = of_known - p @ x
        score = np.mean(huber(np.linalg.norm(left, axis=1) / fit.sigma_m)[1])
        if q is not None:
            left = turn_of_known - q @ x
            score += np.mean(huber(np.linalg.norm(left, axis=1) / deviation(r_turn))[1])
        found.append((score if 0 < x[UNKNOWNS] < LONGEST_SLOT_S else np.inf, number, x[UNKNOWNS]))
    return [(all_patterns[n], slot) for score, n, slot in sorted(found) if np.isfinite(score)]


def is_better(fit, other):
    """True if the likelihood of `fit` is higher beyond doubt. Residuals that are alike from pose to pose count as one."""
    ratio = other.square.mean() * other.sigma_m**2 / (fit.square.mean() * fit.sigma_m**2)
    r = fit.residual / np.maximum(np.linalg.norm(fit.residual, axis=1) / (HUBER * fit.sigma_m), 1)[:, None]
    lags = range(1, min(len(r) // 4, 200))
    alike = [np.mean(np.sum(r[k:] * r[:-k], axis=1)) / np.mean(np.sum(r * r, axis=1)) for k in lags]
    until = next((k for k, value in enumerate(alike) if value < 0.1), len(alike))
    independent = 3 * len(r) / (1 + 2 * sum(alike[:until]))
    return bool(independent * np.log(ratio) > SURE)


def modelled(pair, rows, base):
    """The chosen fit, and every alternative by name."""
    before_s = 0.05
    rows = rows[pair.covered(base.alignment, pair.poses.time_s[rows], before_s)]
    t = pair.poses.time_s[rows]
    base = refine(pair, base.alignment, rows)
    interval_s = float(np.median(np.diff(pair.poses.time_s)))
    fits = {"no skew": base}
    for pattern, slot in screened(pair, base, rows, _naive.patterns(pair.poses.time_s))[:3]:
        a = dataclasses.replace(base.alignment, slot_s=float(slot))
        fits[f"TDM, {pattern}"] = refine(pair, a, rows, pattern)
    best = min(fits, key=lambda name: fits[name].square.mean() * fits[name].sigma_m**2)
    slot_s = fits[best].alignment.slot_s
    if best != "no skew" and not (is_better(fits[best], base) and slot_s > max(SHORTEST_SLOT_S, 5 * fits[best].deviations[UNKNOWNS])):
        best = "no skew"
    chosen = fits[best]
    direct = chosen
    for name, kappa, loop in (("previous measurement, closed loop", "exact", "closed"), ("open loop", "exact", "open"), ("kappa = 2", "two", "closed")):
        extra = _naive.previous_measurement(pair, direct.alignment, t, interval_s, kappa, loop)
        if np.all(np.isfinite(extra)) and np.sqrt(np.mean(np.sum(extra**2, axis=1))) > 1e-6:
            fits[name] = refine(pair, direct.alignment, rows, direct.pattern, extra, steps=3)
    return rows, best, fits


def with_true_attitude(pair, fit, rows):
    """Pair and fit with the tracker's attitude without its motion error: the reference has none that could replace it."""
    poses = pair.poses
    measured = rotations(poses.quaternion_wxyz)
    for _ in range(10):
        error, turn = _naive.AgedCouplings(pair, fit.alignment, poses.time_s, fit.alignment.slot_s).error(fit.pattern)
        known = _naive.is_known(error)
        true = wxyz(turn.inv() * measured)
        pair = Pair(poses, Path(poses.time_s[known], poses.position_m[known], true[known]), pair.reference)
        before_s = fit.alignment.slot_s
        fit = refine(pair, fit.alignment, rows, fit.pattern, steps=4)
        if abs(fit.alignment.slot_s - before_s) < 1e-4 * before_s:
            break
    return pair, fit
