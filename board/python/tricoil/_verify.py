"""Verification of a tracker in motion against a reference: each error is predicted from the reference's motion by the error model."""

import dataclasses

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.ndimage import median_filter
from scipy.spatial.transform import Rotation

from . import _align, _naive
from ._align import UNKNOWNS, Alignment, Pair
from ._path import Path
from ._poses import Poses, PoseError

FEWEST = 20
MOST_FITTED = 4000  # poses that the fit uses
HUBER = 4.0  # residuals beyond this many deviations have less weight
OUTLIER = 8.0
MOST_OUTLIERS = 0.05
LEAST_OUTLIER_M = 1e-4
FIRST_SLOT_S = 1e-3
SHORTEST_SLOT_S, LONGEST_SLOT_S = 1e-4, 20e-3
SAME = 0.85  # correlation of the speeds of one motion, in frames that do not fit
DISTINCT_M = 1e-3  # a smaller motion error is not distinguished from noise
BLOCK_S = 0.5
FEWEST_BLOCKS = 24
RESAMPLES = 400
SURE = 40.0  # twice the logarithm of the likelihood ratio, for a choice among eighteen patterns
EDGES = {"speed_m_s": (0, 0.1, 0.25, 0.5, 1, 2, np.inf), "rate_rad_s": (0, 0.5, 1, 2, 5, 10, np.inf), "range_m": (0, 0.3, 0.5, 0.75, 1, 1.5, np.inf)}
# Standard deviations of what is known before the fit.
PRIORS = {_align.RATE: 1e-4, _align.SCALE: 0.05}
REST_M_S, REST_RAD_S = 0.02, 0.05


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
        error, turn = _naive.AgedCouplings(pair, a, t, slot).error(pattern) if pattern else _naive.no_error(len(t))
        r, r_turn = _align.residuals(pair, a, rows, error if extra is None else error + extra, turn)
        of_p, of_turn = _align.jacobian(pair, a, rows)
        if pattern:
            more = slot + max(0.02 * slot, 2e-5)
            error_2, turn_2 = _naive.AgedCouplings(pair, a, t, more).error(pattern)
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


def step(a, r, r_turn, of_p, of_turn):
    """One step of the unknowns, their deviations, limited squares of the positions, and the deviation of one axis."""
    count = of_p.shape[2]
    sigma = deviation(r)
    weight, square = huber(np.linalg.norm(r, axis=1) / sigma)
    normal = np.einsum("n,nij,nik->jk", weight, of_p, of_p, optimize=True) / sigma**2
    right = np.einsum("n,nij,ni->j", weight, of_p, r, optimize=True) / sigma**2
    if r_turn is not None:
        sigma_turn = deviation(r_turn)
        w = huber(np.linalg.norm(r_turn, axis=1) / sigma_turn)[0]
        normal += np.einsum("n,nij,nik->jk", w, of_turn, of_turn, optimize=True) / sigma_turn**2
        right += np.einsum("n,nij,ni->j", w, of_turn, r_turn, optimize=True) / sigma_turn**2
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
    r, r_turn = _align.residuals(pair, a, rows, *_naive.no_error(len(t)))
    of_p, of_turn = _align.jacobian(pair, a, rows)
    aged = _naive.AgedCouplings(pair, a, t, FIRST_SLOT_S)
    found = []
    for pattern in all_patterns:
        error, turn = aged.error(pattern)
        p = np.concatenate((of_p, (error / FIRST_SLOT_S)[:, :, None]), axis=2)
        q = None if of_turn is None else np.concatenate((of_turn, (turn.as_rotvec() / FIRST_SLOT_S)[:, :, None]), axis=2)
        x = step(a, r, r_turn, p, q)[0]
        left = r - p @ x
        score = np.sum(huber(np.linalg.norm(left, axis=1) / fit.sigma_m)[1])
        if q is not None:
            left = r_turn - q @ x
            score += np.sum(huber(np.linalg.norm(left, axis=1) / deviation(r_turn))[1])
        found.append((score if 0 < x[UNKNOWNS] < LONGEST_SLOT_S else np.inf, len(found), x[UNKNOWNS]))
    return [(all_patterns[n], slot) for score, n, slot in sorted(found) if np.isfinite(score)]


def blocks(time_s):
    """Index of the block of each pose, for the bootstrap."""
    length = min(BLOCK_S, (time_s[-1] - time_s[0]) / FEWEST_BLOCKS)
    return np.unique(((time_s - time_s[0]) / length).astype(int), return_inverse=True)[1]


def resampled(time_s, *values):
    """Sums of the values over blocks drawn with replacement, each (RESAMPLES,)."""
    block = blocks(time_s)
    count = block.max() + 1
    drawn = np.random.default_rng(1).integers(0, count, (RESAMPLES, count))
    return [np.bincount(block, value, count)[drawn].sum(axis=1) for value in values]


def interval(ratio):
    """95 % interval of a bootstrap."""
    return [float(v) for v in np.percentile(ratio, (2.5, 97.5))]


def is_better(fit, other):
    """True if the likelihood of `fit` is higher beyond doubt. Residuals that are alike from pose to pose count as one."""
    ratio = other.square.sum() * other.sigma_m**2 / (fit.square.sum() * fit.sigma_m**2)
    r = fit.residual / np.maximum(np.linalg.norm(fit.residual, axis=1) / (HUBER * fit.sigma_m), 1)[:, None]
    lags = range(1, min(len(r) // 4, 200))
    alike = [np.mean(np.sum(r[k:] * r[:-k], axis=1)) / np.mean(np.sum(r * r, axis=1)) for k in lags]
    until = next((k for k, value in enumerate(alike) if value < 0.1), len(alike))
    independent = 3 * len(r) / (1 + 2 * sum(alike[:until]))
    return bool(independent * np.log(ratio) > SURE)


def aligned(pair, start_s, range_s, rows):
    """The best fit without motion error. Throws PoseError with the reason if there is none."""
    found = _align.candidates(pair, start_s, range_s)
    if pair.tracker.has_attitude and not pair.reference.has_attitude and (not found or found[0][0] < SAME):
        found = sorted(found + _align.lever_candidates(pair, start_s, range_s), reverse=True)
    fits = []
    for r, offset in found:
        if r < _align.LOWEST_CORRELATION:
            continue
        a = _align.first_frames(pair, offset, rows[:: max(1, len(rows) // 1000)])
        if a is None:
            continue
        usable = rows[pair.covered(a, pair.poses.time_s[rows], 0.05)]
        if len(usable) < FEWEST:
            continue
        fits.append(refine(pair, a, usable, steps=6))
    lowest = min((fit.sigma_m for fit in fits), default=None)
    # A periodic motion fits at several offsets: the one with the longest overlap is used.
    best = max((fit for fit in fits if fit.sigma_m < 1.1 * lowest), key=lambda fit: len(fit.square), default=None)
    return best, (found[0] if found else (0.0, 0.0))


def explained(pair, fit, rows):
    """Share of the tracker's motion that the aligned reference explains, of positions and of attitudes (None without)."""
    a = fit.alignment
    rows = rows[pair.covered(a, pair.poses.time_s[rows])]
    r, r_turn = _align.residuals(pair, a, rows, *_naive.no_error(len(rows)))
    p = pair.poses.position_m[rows]
    spread = np.linalg.norm(p - np.median(p, axis=0), axis=1)
    share = 1 - np.median(np.linalg.norm(r, axis=1)) / max(np.median(spread), 1e-9)
    if r_turn is None:
        return share, None
    if np.median(spread) < 5 * np.sqrt(pair.tracker.noise_m2) or np.median(spread) < 1e-3:
        share = None  # it turns in place
    turn = Rotation.from_quat(pair.poses.quaternion_wxyz[rows][:, [1, 2, 3, 0]])
    away = (turn * turn.mean().inv()).magnitude()
    return share, 1 - np.median(np.linalg.norm(r_turn, axis=1)) / max(np.median(away), 1e-9)


def fits_well(pair, fit, rows):
    return fit is not None and min(share for share in explained(pair, fit, rows) if share is not None) > 0.6


def check_motion(poses, path, what):
    if len(poses) < FEWEST:
        raise PoseError(f"{poses.name}: {len(poses)} pose{'s' if len(poses) != 1 else ''}; at least {FEWEST} are needed")
    still = np.linalg.norm(poses.position_m - np.median(poses.position_m, axis=0), axis=1)
    turned = 0.0
    if poses.quaternion_wxyz is not None:
        turn = Rotation.from_quat(poses.quaternion_wxyz[:, [1, 2, 3, 0]])
        turned = np.percentile((turn * turn[len(turn) // 2].inv()).magnitude(), 98)
    if np.percentile(still, 98) < 1e-3 and turned < 0.02:
        raise PoseError(f"{poses.name}: {what} does not move; a held pose shows neither clock nor motion error")
    if path.coverage() < 1:
        raise PoseError(f"{poses.name}: {path.coverage():.2f} s of motion without a gap; at least 1 s is needed")


def between_samples_m(pair):
    """RMS error of a curve through samples of the tracker's path at the rate of the reference: what the reference cannot follow."""
    interval_s = pair.reference.interval_s
    t = np.arange(pair.tracker.time_s[0], pair.tracker.time_s[-1], interval_s)
    if len(t) < FEWEST:
        return float("inf")
    middle = t[2:-3] + interval_s / 2
    middle = middle[pair.tracker.covers(middle, 2 * interval_s) & pair.tracker.covers(middle + 2 * interval_s)]
    error = CubicSpline(t, pair.tracker.p(t))(middle) - pair.tracker.p(middle)
    return rms(error) or 0.0


def why_not(pair, offset_s, reference, rows):
    """The reason why the reference does not explain the motion at this offset, at which the speeds agree."""
    a = Alignment(offset_s, 0.5 * (pair.poses.time_s[0] + pair.poses.time_s[-1]))
    t = pair.poses.time_s[rows]
    t = t[pair.covered(a, t) & pair.tracker.covers(t)]
    v, u = pair.tracker.p(t, 1), pair.reference.p(a.reference_time(t), 1)
    affine, *_ = np.linalg.lstsq(u, v, rcond=None)
    left = np.sum((v - u @ affine) ** 2) / max(np.sum(v**2), 1e-12)
    if left < 0.3 and np.linalg.det(affine) < 0:
        return f"{reference.name}: is mirrored relative to the tracker: one of the two has left-handed axes; change the sign of one axis in its positions and attitudes"
    size = np.cbrt(abs(np.linalg.det(affine)))
    if left < 0.3 and not 0.8 < size < 1.25:
        return f"{reference.name}: its motion is {1 / max(size, 1e-9):.4g} times as large as the tracker's; are the units right? Give them with --unit"
    if pair.compares_attitude:
        q = reference.quaternion_wxyz * np.array([1, -1, -1, -1])
        other = Pair(pair.poses, pair.tracker, Path(reference.time_s, reference.position_m, q))
        first = _align.first_frames(other, a.offset_s, rows)
        if first is not None and fits_well(other, refine(other, first, rows[other.covered(first, pair.poses.time_s[rows], 0.05)], steps=6), rows):
            return f"{reference.name}: its quaternions turn the other way than the tracker's; change the sign of qx, qy and qz"
    return None


def fitted(poses, reference, start_s, same_clock):
    """Pair, rows that are compared, the fits by name, and the offset that the common clock gives (None without)."""
    for one, what in ((reference, "the reference"), (poses, "the tracker")):
        if len(one) < FEWEST:
            raise PoseError(f"{one.name}: {len(one)} pose{'s' if len(one) != 1 else ''}; at least {FEWEST} are needed")
    tracker_path = Path(poses.time_s, poses.position_m, poses.quaternion_wxyz)
    reference_path = Path(reference.time_s, reference.position_m, reference.quaternion_wxyz)
    check_motion(poses, tracker_path, "the tracker")
    check_motion(reference, reference_path, "the reference")
    pair = Pair(poses, tracker_path, reference_path)
    if start_s is not None:
        begin = max(poses.time_s[0], reference.time_s[0] - start_s)
        end = min(poses.time_s[-1], reference.time_s[-1] - start_s)
        if end - begin < 1:
            raise PoseError(f"--time-offset: with this offset the reference ends {begin - end:.3f} s before the tracker begins, or the reverse; leave it out, and it is searched"
                            if end < begin else "--time-offset: with this offset the recordings overlap for less than a second; leave it out, and it is searched")
    stride = max(1, len(poses) // MOST_FITTED)
    stride += stride % 3 == 0
    rows = np.arange(0, len(poses), stride)
    range_s = _align.SAME_CLOCK_RANGE_S if same_clock else _align.START_RANGE_S
    fit, (highest, at) = aligned(pair, start_s, range_s, rows)
    good = fits_well(pair, fit, rows)
    if not good and start_s is not None:
        wide, _ = aligned(pair, None, range_s, rows)
        if fits_well(pair, wide, rows):
            raise PoseError(f"--time-offset: cannot be right; the motions agree at {wide.alignment.offset_s - start_s:+.3f} s from it. Leave it out, and it is searched")
    between_m = between_samples_m(pair)
    slow = f"{reference.name}: is slower than the motion: between its samples it is wrong by {1e3 * between_m:.1f} mm; record the reference at a higher rate"
    if not good:
        reason = slow if between_m > 5e-3 else why_not(pair, at, reference, rows) if fit is not None and highest > SAME else None
        raise PoseError(reason or f"{poses.name} and {reference.name} do not hold the same motion: the highest correlation of their speeds is {max(highest, 0):.2f}"
                        + (", and the positions do not agree there" if fit is not None else ""))
    if between_m > max(1e-3, 0.8 * fit.sigma_m, 3 * np.sqrt(pair.tracker.noise_m2)):
        raise PoseError(slow)
    return pair, rows, fit


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
    best = min(fits, key=lambda name: fits[name].square.sum() * fits[name].sigma_m**2)
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
    measured = Rotation.from_quat(poses.quaternion_wxyz[:, [1, 2, 3, 0]])
    for _ in range(10):
        error = _naive.AgedCouplings(pair, fit.alignment, poses.time_s, fit.alignment.slot_s).error(fit.pattern)[1]
        pair = Pair(poses, Path(poses.time_s, poses.position_m, _naive.wxyz(error.inv() * measured)), pair.reference)
        before_s = fit.alignment.slot_s
        fit = refine(pair, fit.alignment, rows, fit.pattern, steps=4)
        if abs(fit.alignment.slot_s - before_s) < 1e-4 * before_s:
            break
    return pair, fit


def outliers(r, predicted, sigma):
    """Poses whose residual is far from those of their neighbours. If they are many, they are no outliers."""
    if len(r) < 9:
        return np.zeros(len(r), bool)
    padded = np.pad(r, ((3, 3), (0, 0)), mode="edge")
    middle = np.median(np.stack([padded[k:k + len(r)] for k in range(7)]), axis=0)
    away = np.linalg.norm(r - middle, axis=1)
    nearby = median_filter(away, 101, mode="nearest") / 1.538  # the noise of a tracker grows with the range
    far = (away > np.maximum(OUTLIER * np.maximum(nearby, 0.5 * sigma), LEAST_OUTLIER_M)) & (away > 0.3 * np.linalg.norm(predicted, axis=1))
    return far if far.mean() < MOST_OUTLIERS else np.zeros(len(r), bool)


def noise_m2(r, ok):
    """Variance (3D) of the noise from pose to pose, by second differences."""
    three = ok[:-2] & ok[1:-1] & ok[2:]
    second = r[:-2] - 2 * r[1:-1] + r[2:]
    return float(np.mean(np.sum(second[three] ** 2, axis=1)) / 6) if three.any() else 0.0


@dataclasses.dataclass
class Errors:
    """Errors of every compared pose. Vectors are measured minus true, source frame, m; left: measured minus predicted."""

    time_s: np.ndarray
    speed_m_s: np.ndarray
    rate_rad_s: np.ndarray
    range_m: np.ndarray
    measured_m: np.ndarray
    predicted_m: np.ndarray
    orientation_rad: np.ndarray | None
    along: np.ndarray  # unit vectors of the velocity and of the line of sight
    sight: np.ndarray
    is_outlier: np.ndarray

    @property
    def left_m(self):
        return self.measured_m - self.predicted_m


def errors_of(pair, fit, same_offset_s):
    """Errors of all poses that the reference covers, and the number of those in its gaps."""
    a = fit.alignment
    t = pair.poses.time_s
    tau = a.reference_time(t)
    edge = 1.01 * pair.reference.interval_s + 2 * a.slot_s
    inside = (tau >= pair.reference.begin[0] + edge) & (tau <= pair.reference.end[-1] - edge)
    ok = pair.covered(a, t, 2 * a.slot_s)
    rows = np.flatnonzero(ok)
    t = t[rows]
    predicted, turn_error = _naive.AgedCouplings(pair, a, t, a.slot_s).error(fit.pattern) if fit.pattern else _naive.no_error(len(t))
    r, r_turn = _align.residuals(pair, a, rows, predicted, turn_error)
    measured = r + predicted
    if same_offset_s is not None:  # the error at the time stamp contains the latency
        exact = dataclasses.replace(a, offset_s=same_offset_s + a.rate * a.middle_s)
        late = a.scale * (pair.expected(a, t)[0] - pair.expected(exact, t)[0])
        measured, predicted = measured + late, predicted + late
    v, rate = pair.motion(a, t)
    p, _ = pair.expected(a, t)
    speed = np.linalg.norm(v, axis=1)
    full = None
    if r_turn is not None:
        full = _align.residuals(pair, a, rows, predicted, Rotation.identity(len(t)))[1]
    return Errors(t, speed, np.linalg.norm(rate, axis=1), np.linalg.norm(p, axis=1), measured, predicted,
                  None if full is None else np.linalg.norm(full, axis=1), v / np.maximum(speed, 1e-9)[:, None],
                  p / np.linalg.norm(p, axis=1)[:, None], outliers(r, predicted, fit.sigma_m)), int(np.sum(inside & ~ok))


def rms(v):
    return float(np.sqrt(np.mean(np.sum(v * v, axis=-1) if v.ndim > 1 else v * v))) if len(v) else None


def bands(e, ok):
    """What is left in each band of speed, angular rate and range, and in each direction."""
    left, measured, predicted = (np.sum(v**2, axis=1) for v in (e.left_m, e.measured_m, e.predicted_m))
    out = {}
    for name, edges in EDGES.items():
        values, out[name] = getattr(e, name), []
        for low, high in zip(edges, edges[1:]):
            rows = ok & (values >= low) & (values < high)
            if rows.sum() < FEWEST:
                continue
            squares, counts = resampled(e.time_s, np.where(rows, left, 0), rows.astype(float))
            band = {"from": low, "to": None if np.isinf(high) else high, "poses": int(rows.sum()), "position_rms_m": rms(e.measured_m[rows]),
                    "predicted_rms_m": float(np.sqrt(predicted[rows].mean())), "left_rms_m": float(np.sqrt(left[rows].mean())),
                    "left_interval_m": interval(np.sqrt(squares / np.maximum(counts, 1))),
                    "orientation_rms_deg": None if e.orientation_rad is None else float(np.degrees(rms(e.orientation_rad[rows])))}
            out[name].append(band)
    out["direction"] = []
    across = np.cross(e.along, e.sight)
    for name, unit in (("along the velocity", e.along), ("along the line of sight", e.sight), ("across both", across)):
        one = np.where(ok, np.sum(e.left_m * unit, axis=1), 0)
        full = np.where(ok, np.sum(e.measured_m * unit, axis=1), 0)
        squares, counts = resampled(e.time_s, one**2, ok.astype(float))
        out["direction"].append({"name": name, "position_rms_m": rms(full[ok]), "left_rms_m": rms(one[ok]), "left_interval_m": interval(np.sqrt(squares / counts))})
    return out


def summary(values):
    return {"rms": rms(values), "p95": float(np.percentile(values, 95)), "max": float(values.max())}


def r_squared(e, ok, noise2):
    """R2 = 1 - sum |measured - predicted|^2 / sum |measured|^2 without the noise, and its interval."""
    left, measured = np.sum(e.left_m**2, axis=1) - noise2, np.sum(e.measured_m**2, axis=1) - noise2
    a, b = resampled(e.time_s, np.where(ok, left, 0), np.where(ok, measured, 0))
    total = measured[ok].sum()
    if total <= noise2 * ok.sum():
        return None, None
    return float(min(1, 1 - left[ok].sum() / total)), interval(np.minimum(1, 1 - a / np.where(b > 0, b, 1))) if np.all(b > 0) else None


def with_even_times(poses: Poses) -> Poses:
    """The poses with the times of an even clock, if theirs are rounded to 1 or 10 ms and no more than that apart from it."""
    for unit in (1e-2, 1e-3):
        counts = np.rint(poses.time_s / unit)
        if len(poses) < FEWEST or np.abs(poses.time_s / unit - counts).max() > 1e-2 or np.ptp(np.diff(counts)) == 0:
            continue
        row = _naive.Counter(poses.time_s).row
        even = np.polyval(np.polyfit(row, poses.time_s, 1), row)
        if np.abs(even - poses.time_s).max() <= unit:
            note = f"times are rounded to {1e3 * unit:g} ms; those of an even clock are used"
            return dataclasses.replace(poses, time_s=even, notes=(*poses.notes, note))
    return poses


def verified(poses: Poses, reference: Poses, *, time_offset: float | None = None, same_clock: bool = False):
    """Result as a dictionary, and the errors of all poses. Throws PoseError."""
    begin_t, begin_r = poses.time_s[0] if len(poses) else 0.0, reference.time_s[0] if len(reference) else 0.0
    apart = begin_r - begin_t  # times are counted from the first pose of each recording: Unix times lose digits
    poses = with_even_times(dataclasses.replace(poses, time_s=poses.time_s - begin_t))
    reference = with_even_times(dataclasses.replace(reference, time_s=reference.time_s - begin_r))
    if same_clock and time_offset is None:
        time_offset = 0.0
    if time_offset is not None and not np.isfinite(time_offset):
        raise PoseError("--time-offset must be a finite number of seconds")
    start_s = None if time_offset is None else time_offset - apart
    pair, rows, base = fitted(poses, reference, start_s, same_clock)
    every = rows
    rows, name, fits = modelled(pair, every, base)
    if pair.has_attitude and not pair.reference.has_attitude and fits[name].pattern:
        pair, fit = with_true_attitude(pair, fits[name], rows)
        rows, name, fits = modelled(pair, every, fit)
    chosen = fits[name]
    a = chosen.alignment
    e, in_gaps = errors_of(pair, chosen, start_s if same_clock else None)
    ok = ~e.is_outlier
    noise2 = noise_m2(e.left_m, ok) + pair.reference.spline_m2
    length = np.linalg.norm(e.measured_m, axis=1)
    motion2 = np.mean(np.sum(e.measured_m[ok] ** 2, axis=1)) - noise2
    r2, r2_interval = r_squared(e, ok, noise2)
    position = summary(length[ok])
    rest = ok & (e.speed_m_s < REST_M_S) & (e.rate_rad_s < REST_RAD_S)
    slot_s, slot_deviation = (a.slot_s, chosen.deviations[UNKNOWNS]) if chosen.pattern else (None, None)
    result = {
        "poses": int(ok.sum()), "poses_in_gaps": in_gaps, "outliers": int(e.is_outlier.sum()),
        "outlier_times_s": [float(v) for v in (e.time_s[e.is_outlier] + begin_t)[:100]],
        "position_rms_m": position["rms"], "position_p95_m": position["p95"], "position_max_m": position["max"],
        "orientation_rms_deg": None, "orientation_p95_deg": None, "orientation_max_deg": None,
        "poses_at_rest": int(rest.sum()), "rest_rms_m": rms(e.measured_m[rest]) if rest.sum() >= FEWEST else None, "noise_m": float(np.sqrt(noise2)),
        "time_offset_s": float(a.offset_s + apart), "time_offset_at_s": float(a.middle_s + begin_t), "clock_rate_ppm": float(1e6 * a.rate),
        "clock_rate_std_ppm": float(1e6 * chosen.deviations[_align.RATE]),
        "lag_s": float(start_s - a.offset_s + a.rate * a.middle_s) if same_clock else None, "lag_std_s": float(chosen.deviations[_align.OFFSET]) if same_clock else None,
        "multiplexing": multiplexing(fits, name), "slot_s": slot_s, "slot_std_s": None if slot_deviation is None else float(slot_deviation),
        "scale_factor": float(a.scale), "scale_factor_std": float(chosen.deviations[_align.SCALE]),
        "motion_error_m": float(np.sqrt(max(motion2, 0))), "predicted_rms_m": rms(e.predicted_m[ok]), "left_rms_m": rms(e.left_m[ok]),
        "r2": r2, "r2_interval": r2_interval, "distinguishable": bool(motion2 > DISTINCT_M**2),
        "alternatives": alternatives(fits, name),
        "q_world": quaternion(a.world), "world_m": a.world_m.tolist(), "q_mount": quaternion(a.mount), "mount_m": a.mount_m.tolist(),
        "bands": [], "by": bands(e, ok), "notes": [f"{one.name}: {note}" for one in (reference, poses) for note in one.notes],
    }
    if e.orientation_rad is not None:
        result.update({f"orientation_{key}_deg": float(np.degrees(value)) for key, value in summary(e.orientation_rad[ok]).items()})
    result["bands"] = [{"from_m_s": band["from"], "to_m_s": band["to"], **band} for band in result["by"]["speed_m_s"]]
    return result, dataclasses.replace(e, time_s=e.time_s + begin_t)


def quaternion(turn):
    x, y, z, w = turn.as_quat()
    return [float(w), float(x), float(y), float(z)]


def multiplexing(fits, name):
    """Text of the multiplexing: TDM with its coils, none, or not determined."""
    if name != "no skew":
        return name
    best = min((fit for fit in fits.values() if fit.pattern is not None), key=lambda fit: fit.square.sum() * fit.sigma_m**2, default=None)
    if best is None or best.alignment.slot_s + 3 * best.deviations[UNKNOWNS] < 3e-4:
        return "none (FDM, or the tracker corrects it)"
    return "not determined by this motion"


def alternatives(fits, name):
    """Other models: residual relative to the chosen model's, and whether the recording rejects them."""
    chosen = fits[name]
    total = chosen.square.sum() * chosen.sigma_m**2
    return [{"name": other, "residual_ratio": float(np.sqrt(fit.square.sum() * fit.sigma_m**2 / total)), "rejected": is_better(chosen, fit)}
            for other, fit in fits.items() if other != name]
