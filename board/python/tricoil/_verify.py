"""Verification of a tracker in motion against a reference: each error is predicted from the reference's motion by the error model."""

import dataclasses

import numpy as np
from scipy.ndimage import median_filter
from scipy.spatial.transform import Rotation

from . import _align, _naive
from ._align import UNKNOWNS
from ._fit import is_better, modelled, with_true_attitude
from ._match import FEWEST, fitted, with_even_times
from ._poses import LARGEST_S, METRES, Poses, PoseError

OUTLIER = 8.0
MOST_OUTLIERS = 0.05
LEAST_OUTLIER_M = 1e-4
DISTINCT_M = 1e-3  # a smaller motion error is not distinguished from noise
BLOCK_S = 0.5
FEWEST_BLOCKS = 24
RESAMPLES = 400
SPEED_EDGES, RATE_EDGES, RANGE_EDGES = (0, 0.1, 0.25, 0.5, 1, 2, np.inf), (0, 0.5, 1, 2, 5, 10, np.inf), (0, 0.3, 0.5, 0.75, 1, 1.5, np.inf)
EDGES = {"speed_m_s": SPEED_EDGES, "rate_rad_s": RATE_EDGES, "range_m": RANGE_EDGES}
MOST_SCALE = 1.1  # of a tracker with a wrong coupling constant; beyond it a unit is wrong
REST_M_S, REST_RAD_S = 0.02, 0.05


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
    """95 % interval of a bootstrap; None twice if the poses are in too few blocks for it: resamples without any of them are NaN."""
    known = ratio[np.isfinite(ratio)]
    return [float(v) for v in np.percentile(known, (2.5, 97.5))] if len(known) > 0.95 * len(ratio) else [None, None]


def of_blocks(squares, counts):
    """RMS of each resample; NaN where it has no pose."""
    return np.sqrt(np.divide(squares, counts, out=np.full(len(counts), np.nan), where=counts > 0))


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


def reference_m2(reference, time_s, path):
    """Variance (3D) of the reference at these times: of the spline through it, and the part of its own deviations that is no noise from pose to pose."""
    if reference.deviation is None:
        return np.full(len(time_s), path.spline_m2)
    stated_m2 = np.sum(reference.deviation[:, :3] ** 2, axis=1)
    return path.spline_m2 + np.maximum(np.interp(time_s, reference.time_s, stated_m2) - path.noise_m2, 0)


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
    known = _naive.is_known(predicted)
    ok[rows[~known]] = False
    rows, t, predicted, turn_error = rows[known], t[known], predicted[known], turn_error[known]
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
                    "left_interval_m": interval(of_blocks(squares, counts)),
                    "orientation_rms_deg": None if e.orientation_rad is None else float(np.degrees(rms(e.orientation_rad[rows])))}
            out[name].append(band)
    out["direction"] = []
    across = np.cross(e.along, e.sight)
    for name, unit in (("along the velocity", e.along), ("along the line of sight", e.sight), ("across both", across)):
        one = np.where(ok, np.sum(e.left_m * unit, axis=1), 0)
        full = np.where(ok, np.sum(e.measured_m * unit, axis=1), 0)
        squares, counts = resampled(e.time_s, one**2, ok.astype(float))
        out["direction"].append({"name": name, "position_rms_m": rms(full[ok]), "left_rms_m": rms(one[ok]), "left_interval_m": interval(of_blocks(squares, counts))})
    return out


def summary(values):
    return {"rms": rms(values), "p95": float(np.percentile(values, 95)), "max": float(values.max())}


def r_squared(e, ok, noise2):
    """R2 = 1 - sum |measured - predicted|^2 / sum |measured|^2 without the noise, and its interval."""
    left, measured = np.sum(e.left_m**2, axis=1) - noise2, np.sum(e.measured_m**2, axis=1) - noise2
    a, b = resampled(e.time_s, np.where(ok, left, 0), np.where(ok, measured, 0))
    total = measured[ok].sum()
    if total <= noise2[ok].sum():
        return None, None
    return float(min(1, 1 - left[ok].sum() / total)), interval(np.minimum(1, 1 - a / np.where(b > 0, b, 1))) if np.all(b > 0) else None


def verified(poses: Poses, reference: Poses, *, time_offset: float | None = None, same_clock: bool = False):
    """Result as a dictionary, and the errors of all poses. Throws PoseError."""
    begin_t, begin_r = poses.time_s[0] if len(poses) else 0.0, reference.time_s[0] if len(reference) else 0.0
    apart = begin_r - begin_t  # times are counted from the first pose of each recording: Unix times lose digits
    poses = with_even_times(dataclasses.replace(poses, time_s=poses.time_s - begin_t))
    reference = with_even_times(dataclasses.replace(reference, time_s=reference.time_s - begin_r))
    option = "--time-offset"  # the one that messages name
    if same_clock and time_offset is None:
        option, time_offset = "--same-clock", 0.0
    if time_offset is not None and not abs(time_offset) <= LARGEST_S:
        raise PoseError(f"--time-offset must be a finite number of seconds, at most {LARGEST_S:g}")
    start_s = None if time_offset is None else time_offset - apart
    pair, rows, base = fitted(poses, reference, start_s, same_clock, option)
    every = rows
    rows, name, fits = modelled(pair, every, base)
    if pair.has_attitude and not pair.reference.has_attitude and fits[name].pattern:
        pair, fit = with_true_attitude(pair, fits[name], rows)
        rows, name, fits = modelled(pair, every, fit)
    chosen = fits[name]
    a = chosen.alignment
    refuse_units(a.scale, poses.name, reference.name)
    e, in_gaps = errors_of(pair, chosen, start_s if same_clock else None)
    ok = ~e.is_outlier
    reference2 = reference_m2(reference, a.reference_time(e.time_s), pair.reference)
    noise2 = noise_m2(e.left_m, ok) + reference2
    length = np.linalg.norm(e.measured_m, axis=1)
    motion2 = np.mean((np.sum(e.measured_m**2, axis=1) - noise2)[ok])
    r2, r2_interval = r_squared(e, ok, noise2)
    position = summary(length[ok])
    rest = ok & (e.speed_m_s < REST_M_S) & (e.rate_rad_s < REST_RAD_S)
    slot_s, slot_deviation = (a.slot_s, chosen.deviations[UNKNOWNS]) if chosen.pattern else (None, None)
    result = {
        "poses": int(ok.sum()), "poses_in_gaps": in_gaps, "outliers": int(e.is_outlier.sum()),
        "outlier_times_s": [float(v) for v in (e.time_s[e.is_outlier] + begin_t)[:100]],
        "position_rms_m": position["rms"], "position_p95_m": position["p95"], "position_max_m": position["max"],
        "orientation_rms_deg": None, "orientation_p95_deg": None, "orientation_max_deg": None,
        "poses_at_rest": int(rest.sum()), "rest_rms_m": rms(e.measured_m[rest]) if rest.sum() >= FEWEST else None, "noise_m": float(np.sqrt(noise2[ok].mean())),
        "reference_deviation_m": float(np.sqrt(reference2[ok].mean())),
        "time_offset_s": float(a.offset_s + apart), "time_offset_at_s": float(a.middle_s + begin_t), "clock_rate_ppm": float(1e6 * a.rate),
        "clock_rate_std_ppm": float(1e6 * chosen.deviations[_align.RATE]),
        "lag_s": float(start_s - a.offset_s + a.rate * a.middle_s) if same_clock else None, "lag_std_s": float(np.hypot(chosen.deviations[_align.OFFSET], a.middle_s * chosen.deviations[_align.RATE])) if same_clock else None,
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


def refuse_units(scale, name, reference):
    """Raises PoseError for a scale that no tracker has: lengths that were read in a wrong unit."""
    if MOST_SCALE > scale > 1 / MOST_SCALE:
        return
    wrong = [f"; as if lengths in {true} were read in {read}" for read in METRES for true in METRES if abs(scale * METRES[true] / METRES[read] - 1) < 0.05]
    raise PoseError(f"{name}: its motion is {scale:.4g} times that of {reference}{wrong[0] if wrong else ''}; give each file its --unit")


def quaternion(turn):
    x, y, z, w = turn.as_quat()
    return [float(w), float(x), float(y), float(z)]


def multiplexing(fits, name):
    """Text of the multiplexing: TDM with its coils, none, or not determined."""
    if name != "no skew":
        return name
    best = min((fit for fit in fits.values() if fit.pattern is not None), key=lambda fit: fit.square.mean() * fit.sigma_m**2, default=None)
    if best is None or best.alignment.slot_s + 3 * best.deviations[UNKNOWNS] < 3e-4:
        return "none (FDM, or the tracker corrects it)"
    return "not determined by this motion"


def alternatives(fits, name):
    """Other models: residual relative to the chosen model's, and whether the recording rejects them."""
    chosen = fits[name]
    total = chosen.square.mean() * chosen.sigma_m**2
    return [{"name": other, "residual_ratio": float(np.sqrt(fit.square.mean() * fit.sigma_m**2 / total)), "rejected": is_better(chosen, fit)}
            for other, fit in fits.items() if other != name]
