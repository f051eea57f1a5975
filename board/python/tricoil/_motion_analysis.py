"""The motion behind the poses of a tracker: columns at their own times, the path without motion error, its rates and its noise."""

import dataclasses
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from ._poses import PoseError, Poses
from ._stretch import Stretch
from ._timing import COLUMNS, Timing

LEAST_POSES = 20  # of a stretch without gap: its noise needs 17 poses
PIECE = 20_000  # poses that are analysed at once
AROUND = 500  # poses beside a piece; the smoother looks back and ahead less than 0.5 s
GAP = 1.5  # of the median interval
CAUSES = ("skew", "blur", "linearization", "latency")
MOST_FOR_PHASE = 2000  # poses
MOST_HELD = 0.05  # share of poses that equal the one before; a tracker at rest with rounded numbers has some
LARGEST_JUMP_M_S = 60.0  # speed between two poses above which the tracker has changed the hemisphere or started again

Pose = tuple[NDArray, NDArray]  # position_m (N, 3), quaternion_wxyz (N, 4)


@dataclasses.dataclass(frozen=True)
class MotionAnalysis:
    """Result for N poses. `is_analysed` marks those in a stretch without gap; the others keep the given pose, and NaN for the rest.

    corrected: each pose from columns that were moved to its time stamp. smoothed: by the smoother of this package, from all columns before
    and after. covariance, smoothed_covariance: (N, 6, 6). causes: errors of the given poses by the motion of the smoothed path, true minus
    given, (N, 6) each: skew, blur, linearization and latency. velocity_m_s, angular_rate_rad_s: (N, 3), source frame, with rate_covariance
    (N, 6, 6). age_s: of the columns, (N, 3).
    """

    poses: Poses
    timing: Timing
    is_analysed: NDArray
    corrected: Pose
    covariance: NDArray
    smoothed: Pose
    smoothed_covariance: NDArray
    causes: dict[str, NDArray]
    velocity_m_s: NDArray
    angular_rate_rad_s: NDArray
    rate_covariance: NDArray
    age_s: NDArray


def stretches(poses: Poses) -> list[slice]:
    """Parts of the poses without a gap or a jump."""
    interval = np.diff(poses.time_s)
    distance = np.linalg.norm(np.diff(poses.position_m, axis=0), axis=1)
    is_cut = (interval > GAP * np.median(interval)) | (distance > LARGEST_JUMP_M_S * interval)
    cuts = [0, *(np.flatnonzero(is_cut) + 1), len(poses)]
    return [slice(begin, end) for begin, end in zip(cuts[:-1], cuts[1:])]


def pieces(poses: Poses) -> Iterator[tuple[slice, slice]]:
    """Stretches that are long enough, the longest in pieces, each with the poses around it that it needs: memory is bounded."""
    for stretch in stretches(poses):
        if stretch.stop - stretch.start < LEAST_POSES:
            continue
        for begin in range(stretch.start, stretch.stop, PIECE):
            end = min(begin + PIECE, stretch.stop)
            yield slice(begin, end), slice(max(stretch.start, begin - AROUND), min(stretch.stop, end + AROUND))


def check_motion(poses: Poses) -> None:
    """Raises PoseError for poses that tell no motion."""
    if poses.quaternion_wxyz is None:
        raise PoseError(f"{poses.name}: has positions only; the motion error of a pose needs its attitude too")
    if len(poses) < LEAST_POSES:
        raise PoseError(f"{poses.name}: has {len(poses)} pose{'s' if len(poses) != 1 else ''}; give at least {LEAST_POSES}")
    if not poses.position_m.any(axis=1).all():
        raise PoseError(f"{poses.name}: has a position of zero; positions must be those of the sensor in the frame of the source")
    parts = np.hstack((poses.position_m, poses.quaternion_wxyz))
    is_held = (parts[1:] == parts[:-1]).all(axis=1)
    if np.mean(is_held) > MOST_HELD:
        raise PoseError(f"{poses.name}: {np.sum(is_held)} of {len(poses)} poses repeat the one before (the first at {poses.time_s[1:][is_held][0]:.6f} s): "
                        "the tracker held its pose; remove the repeated rows, or record at the rate of the tracker")


def find_phase(poses: Poses, timing: Timing) -> int:
    """The phase of Timing.column_age_s() with which one path explains the poses best. Each column is then in several poses, which must agree."""
    if not timing.is_sequential or not timing.has_phases(poses.time_s):
        return 0
    longest = max(stretches(poses), key=lambda part: part.stop - part.start)
    part = slice(longest.start, min(longest.stop, longest.start + MOST_FOR_PHASE))
    if part.stop - part.start < LEAST_POSES:
        return 0
    left = []
    for phase in range(COLUMNS):
        age_s = timing.column_age_s(poses.time_s, phase)[part]
        one = Stretch(poses.time_s[part], (poses.position_m[part], poses.quaternion_wxyz[part]), age_s, timing)
        left.append(float(np.median(one.unexplained(one.path))))
    return int(np.argmin(left))


def analyse(poses: Poses, timing: Timing) -> MotionAnalysis:
    """The motion behind the poses of a tracker with this timing.

    Poses must be those of the sensor itself in the frame of the source, whose axes are its coils. Raises PoseError if they cannot have this
    timing, or if no stretch is long enough.
    """
    check_motion(poses)
    count, given = len(poses), (poses.position_m, poses.quaternion_wxyz)
    age_s = timing.column_age_s(poses.time_s, find_phase(poses, timing))
    blank = [np.full((count, *shape), np.nan) for shape in ((6, 6), (6, 6), (6,), (6, 6))]
    covariance, smoothed_covariance, rates, rate_covariance = blank
    corrected, smoothed = (tuple(part.copy() for part in given) for _ in range(2))
    causes = {name: np.full((count, 6), np.nan) for name in CAUSES}
    is_analysed = np.zeros(count, bool)
    for part, outer in pieces(poses):
        one = Stretch(poses.time_s[outer], tuple(array[outer] for array in given), age_s[outer], timing)
        one.finish()
        inner = slice(part.start - outer.start, part.stop - outer.start)
        is_analysed[part] = True
        covariance[part] = one.covariance[inner]
        pose, *more = one.smoothed()
        for target, values in zip((smoothed_covariance, rates, rate_covariance), more):
            target[part] = values[inner]
        for target, of_corrected, target_smoothed, of_smoothed in zip(corrected, one.corrected, smoothed, pose):
            target[part], target_smoothed[part] = of_corrected[inner], of_smoothed[inner]
        for name, error in one.causes().items():
            causes[name][part] = error[inner]
    if not is_analysed.any():
        raise PoseError(f"{poses.name}: no {LEAST_POSES} poses follow each other without a gap or a jump")
    return MotionAnalysis(poses, timing, is_analysed, corrected, covariance, smoothed, smoothed_covariance, causes, rates[:, :3], rates[:, 3:],
                          rate_covariance, age_s)
