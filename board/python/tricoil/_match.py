"""Two recordings of one motion: their alignment, or the reason why there is none."""

import dataclasses

import numpy as np
from scipy.interpolate import CubicSpline

from . import _align, _naive
from ._align import Alignment, Pair
from ._fit import refine
from ._path import Path
from ._poses import Poses, PoseError
from ._rotation import rotations

FEWEST = 20
MOST_FITTED = 4000  # poses that the fit uses
MOST_COMPARED = 1000  # of them, those that choose between clock offsets
SKEW_S = 6e-3  # between the first and the last column of a slow tracker
SLOWEST_M = 3e-4  # error between samples that a reference may have
SAME = 0.85  # correlation of the speeds of one motion, in frames that do not fit


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


def aligned(pair, start_s, range_s, rows):
    """The best fit without motion error. Throws PoseError with the reason if there is none."""
    found = _align.candidates(pair, start_s, range_s)
    if pair.tracker.has_attitude and not pair.reference.has_attitude and (not found or found[0][0] < SAME):
        found = sorted(found + _align.lever_candidates(pair, start_s, range_s), reverse=True)
    fits = []
    stride = max(1, len(rows) // MOST_COMPARED)
    some = rows[:: stride + (stride % 3 == 0)]
    for r, offset in found:
        if r < _align.LOWEST_CORRELATION:
            continue
        a = _align.first_frames(pair, offset, some)
        if a is None:
            continue
        usable = rows[pair.covered(a, pair.poses.time_s[rows], 0.05)]
        if len(usable) < FEWEST:
            continue
        compared = np.intersect1d(usable, some)
        fits.append((len(usable), refine(pair, a, compared if len(compared) >= FEWEST else usable, steps=6)))
    lowest = min((fit.sigma_m for _, fit in fits), default=None)
    # A periodic motion fits at several offsets: the one with the longest overlap is used.
    _, best = max((fit for fit in fits if fit[1].sigma_m < 1.1 * lowest), key=lambda fit: fit[0], default=(0, None))
    if best is not None and len(some) < len(rows):
        best = refine(pair, best.alignment, rows[pair.covered(best.alignment, pair.poses.time_s[rows], 0.05)], steps=6)
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
    rate_rad_s = np.linalg.norm(pair.motion(a, pair.poses.time_s[rows])[1], axis=1)
    turning_m = np.median(rate_rad_s * np.linalg.norm(p, axis=1)) * SKEW_S
    if np.median(spread) < max(5 * np.sqrt(pair.tracker.noise_m2), 1e-3, turning_m):
        share = None  # it turns in place: the positions are noise and motion error
    turn = rotations(pair.poses.quaternion_wxyz[rows])
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
        turn = rotations(poses.quaternion_wxyz)
        turned = np.percentile((turn * turn[len(turn) // 2].inv()).magnitude(), 98)
    if np.percentile(still, 98) < 1e-3 and turned < 0.02:
        raise PoseError(f"{poses.name}: {what} does not move; a held pose shows neither clock nor motion error")
    if path.coverage() < 1:
        raise PoseError(f"{poses.name}: {path.coverage():.2f} s of motion without a gap; at least 1 s is needed")


def between_samples_m(pair, a=None):
    """RMS error of a curve through samples of the tracker's path at the rate of the reference: what the reference cannot follow.

    a: an alignment, with which the path is that of the body that the reference follows.
    """
    lever_m = np.zeros(3) if a is None or not pair.tracker.has_attitude else a.mount.inv().apply(a.mount_m)

    def path(time_s):
        p = pair.tracker.p(time_s)
        return p - pair.tracker.turn(time_s).apply(lever_m) if lever_m.any() else p

    interval_s = pair.reference.interval_s
    t = np.arange(pair.tracker.time_s[0], pair.tracker.time_s[-1], interval_s)
    if len(t) < FEWEST:
        return float("inf")
    middle = t[2:-3] + interval_s / 2
    middle = middle[pair.tracker.covers(middle, 2 * interval_s) & pair.tracker.covers(middle + 2 * interval_s)]
    error = CubicSpline(t, path(t))(middle) - path(middle)
    return float(np.sqrt(np.mean(np.sum(error**2, axis=1)))) if len(middle) else 0.0


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
        return f"{reference.name}: its motion is {1 / max(size, 1e-9):.4g} times as large as the tracker's; are the units right? Correct them in the file, or give them with --unit if it has none"
    if pair.compares_attitude:
        q = reference.quaternion_wxyz * np.array([1, -1, -1, -1])
        other = Pair(pair.poses, pair.tracker, Path(reference.time_s, reference.position_m, q))
        first = _align.first_frames(other, a.offset_s, rows)
        if first is not None and fits_well(other, refine(other, first, rows[other.covered(first, pair.poses.time_s[rows], 0.05)], steps=6), rows):
            return f"{reference.name}: its quaternions turn the other way than the tracker's; change the sign of qx, qy and qz"
    return None


def fitted(poses, reference, start_s, same_clock, option):
    """Pair, rows that are compared, the fits by name, and the offset that the common clock gives (None without). option: that gave start_s."""
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
            raise PoseError(f"{option}: with this clock the reference ends {begin - end:.3f} s before the tracker begins, or the reverse; leave it out, and the offset is searched"
                            if end < begin else f"{option}: with this clock the recordings overlap for less than a second; leave it out, and the offset is searched")
    stride = max(1, len(poses) // MOST_FITTED)
    stride += stride % 3 == 0
    rows = np.arange(0, len(poses), stride)
    range_s = _align.SAME_CLOCK_RANGE_S if same_clock else _align.START_RANGE_S
    fit, (highest, at) = aligned(pair, start_s, range_s, rows)
    good = fits_well(pair, fit, rows)
    if not good and start_s is not None:
        wide, _ = aligned(pair, None, range_s, rows)
        if fits_well(pair, wide, rows):
            raise PoseError(f"{option}: cannot be right; the motions agree at {wide.alignment.offset_s - start_s:+.3f} s from it. Leave it out, and the offset is searched")
    between_m = between_samples_m(pair, None if fit is None else fit.alignment)
    slow = f"{reference.name}: is slower than the motion: between its samples it is wrong by {1e3 * between_m:.1f} mm; record the reference at a higher rate"
    if not good:
        reason = slow if between_m > 5e-3 else why_not(pair, at, reference, rows) if fit is not None and highest > SAME else None
        raise PoseError(reason or f"{poses.name} and {reference.name} do not hold the same motion: the highest correlation of their speeds is {max(highest, 0):.2f}"
                        + (", and the positions do not agree there" if fit is not None else ""))
    if between_m > max(SLOWEST_M, 0.8 * fit.sigma_m, 3 * np.sqrt(pair.tracker.noise_m2)):
        raise PoseError(slow)
    return pair, rows, fit
