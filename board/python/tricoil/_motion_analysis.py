"""The motion behind the poses of a tracker: columns at their own times, the path without motion error, its rates and its noise."""

import dataclasses
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from . import _tricoil
from ._column_series import column_deviation, series_of
from ._frame_solver import FrameSolver, direct, matrices
from ._model import COUPLING_CONSTANT
from ._pose_path import Curve, PosePath, difference
from ._poses import PoseError, Poses
from ._timing import COLUMNS, Timing

LEAST_POSES = 20  # of a stretch without gap: its noise needs 17 poses
PIECE = 20_000  # poses that are analysed at once
AROUND = 500  # poses beside a piece; the smoother looks back and ahead less than 0.5 s
GAP = 1.5  # of the median interval
PASSES = 3  # path -> measured columns -> path; without noise each divides the error by ten or more
GRID = 45  # poses of a stretch on which the weights of the splines are computed; they decay by a factor of two each pose
SIGMA_FLOOR = 1e-7  # of the median coupling: time stamps have a resolution of 1 us
SMOOTHER_MISFIT = 3.0  # mean over MISFIT_POSES poses above which the smoothed path is not used
MISFIT_POSES = 11
SMOOTHED_SHARE = 0.87  # squared errors over the covariance of the smoother, over recorded hands: 0.83 at 240, 0.87 at 120 poses/s (motion_table.py)
CAUSES = ("skew", "blur", "linearization", "latency")
MOST_FOR_PHASE = 2000  # poses
RATE_FACTOR = 2.0  # variance of a rate from two poses, without smoother
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


def _weight_products(time_s, column_time_s, timing):
    """Products of the weights with which the splines take the noise of the columns of two coils to each time stamp, (N, 3, 3).

    Noise of the columns of one pose is correlated, since a pose shows six of nine numbers. If each column is in several poses, it is taken as
    independent.
    """
    count = min(len(time_s), GRID)
    half = count // 2
    if timing.has_phases(time_s):
        series = series_of(column_time_s[:count], np.zeros((count, 1, COLUMNS)), timing.slot_s)
        weights = [Curve(one.time_s, np.eye(len(one.time_s)))(time_s[:count]) for one in series]
        products = np.stack([np.sum(one**2, axis=1)[:, None] * np.eye(COLUMNS)[coil] for coil, one in enumerate(weights)], axis=1)
    else:
        weights = np.stack([Curve(column_time_s[:count, coil], np.eye(count))(time_s[:count]) for coil in range(COLUMNS)], axis=1)
        products = np.einsum("njk,nlk->njl", weights, weights)
    n = np.arange(len(time_s))
    inside = half + (n - half) % COLUMNS  # the same newest column
    return products[np.where(n < half, n, np.where(n >= len(time_s) - half, n - len(time_s) + count, inside))]


def _by_pose(pose):
    """Derivatives of the nine couplings by position and rotation, (N, 9, 6), by central differences."""
    from scipy.spatial.transform import Rotation

    step = 1e-5
    turn = Rotation.from_quat(pose[1][:, [1, 2, 3, 0]])
    result = np.empty((len(pose[0]), 9, 6))
    for axis in range(3):
        shift = step * np.eye(3)[axis]
        for column, (first, second) in ((axis, ((pose[0] + shift, pose[1]), (pose[0] - shift, pose[1]))),
                                        (axis + 3, [(pose[0], (Rotation.from_rotvec(sign * shift) * turn).as_quat()[:, [3, 0, 1, 2]]) for sign in (1, -1)])):
            result[:, :, column] = (matrices(first) - matrices(second)).reshape(-1, 9) / (2 * step)
    return result


def _covariance(pose, sigma, products):
    """Covariance of poses from columns whose noise lies in the six visible directions, moved by the splines; (N, 6, 6)."""
    by_pose = _by_pose(pose)
    gain = np.linalg.pinv(by_pose)  # of the maximum-likelihood solver: (6, 9)
    visible = by_pose @ gain
    each = [gain.reshape(-1, 6, 3, 3)[:, :, :, coil] @ visible.reshape(-1, 3, 3, 9)[:, :, coil] for coil in range(COLUMNS)]
    total = sum(products[:, j, k, None, None] * (each[j] @ each[k].transpose(0, 2, 1)) for j in range(COLUMNS) for k in range(COLUMNS))
    return sigma[:, None, None] ** 2 * total


class _Stretch:
    """Analysis of poses without a gap."""

    def __init__(self, time_s, pose, age_s, timing):
        self.time_s, self.given, self.timing = time_s, pose, timing
        self.solver = FrameSolver(time_s, pose, age_s, timing)
        self.path = PosePath(self.solver.middle_s, *pose)
        for _ in range(PASSES if timing.is_sequential else 0):
            self.take_columns()
            self.path = PosePath(self.solver.middle_s, *self.moved_to(self.solver.middle_s))

    def finish(self):
        time_s, pose, timing = self.time_s, self.given, self.timing
        self.take_columns()
        self.corrected = self.moved_to(time_s) if timing.is_sequential else pose
        self.smooth()
        deviation = np.interp(time_s, self.series[0].time_s, self.deviation[0])
        products = _weight_products(time_s, self.solver.column_time_s, timing) if timing.is_sequential else np.ones((len(time_s), COLUMNS, COLUMNS))
        self.covariance = _covariance(pose, deviation, products) + self.blur_covariance()

    def take_columns(self):
        self.matrices = self.solver.recovered(self.path)
        self.series = series_of(self.solver.column_time_s, self.matrices, self.timing.slot_s)

    def moved_to(self, time_s):
        """Poses from all columns at these times."""
        return direct(np.stack([one.at(time_s) for one in self.series], axis=2), self.given[0])

    def smooth(self):
        """Smooths the columns; the smoothed path then tells better what the poses lost of them."""
        strength = float(np.median(np.linalg.norm(matrices(self.given), axis=(1, 2))))
        self.deviation = [np.maximum(one, SIGMA_FLOOR * strength) for one in column_deviation(self.series)]
        self.hidden = self.hidden_noise()
        self.rows = None
        for _ in range(PASSES if self.timing.is_sequential else 1):
            rows = self.smoothed_rows()
            path = PosePath(rows["time_s"], rows["position_m"], rows["quaternion_wxyz"])
            if np.median(self.misfit(path)) > SMOOTHER_MISFIT:
                break
            self.rows, self.path = rows, path
            self.take_columns()

    def hidden_noise(self):
        """White noise in the three directions of the couplings that a pose does not show, (N, 3, 3).

        The smoother estimates from its innovations how the sensor moves, and expects the noise of a measurement in all nine couplings.
        """
        noise = np.random.default_rng(1).normal(size=(len(self.time_s), 9, 1))
        by_pose = _by_pose(self.given)
        noise -= by_pose @ np.linalg.pinv(by_pose) @ noise
        return noise.reshape(-1, COLUMNS, COLUMNS) * np.interp(self.time_s, self.series[0].time_s, self.deviation[0])[:, None, None]

    def smoothed_rows(self):
        series = series_of(self.solver.column_time_s, self.matrices + self.hidden, self.timing.slot_s)
        time_s = np.concatenate([one.time_s for one in series])
        coil = np.repeat(np.arange(COLUMNS), [len(one.time_s) for one in series])
        order = np.lexsort((coil, np.round(1e6 * time_s)))
        values = np.concatenate([one.values for one in series])[order]
        sigma = np.repeat(np.concatenate(self.deviation)[order, None], COLUMNS, axis=1)
        span_s = (COLUMNS - 0.5) * self.timing.slot_s
        start = self.given[0][0] / np.linalg.norm(self.given[0][0])
        tracker = _tricoil.Tracker("scaat", COUPLING_CONSTANT, start.tolist(), False, span_s, 0.0)
        rows = tracker.smooth(time_s[order] - time_s.min(), coil[order], np.ascontiguousarray(values), np.ascontiguousarray(sigma))
        rows["time_s"] += time_s.min()
        near = np.stack([np.interp(rows["time_s"], self.time_s, axis) for axis in self.given[0].T], axis=1)
        rows["position_m"][np.sum(near * rows["position_m"], axis=1) < 0] *= -1
        return rows[np.append(np.diff(rows["time_s"]) > 0, True)]

    def unexplained(self, path):
        """Squared difference of the couplings of the given poses and of those that the tracker would make along this path, (N,)."""
        return np.sum((matrices(self.given) - matrices(self.solver.solved(self.solver.measured(path), path))) ** 2, axis=(1, 2))

    def misfit(self, path):
        """Mean of unexplained() over its expectation, over MISFIT_POSES poses, (N,)."""
        variance = np.interp(self.time_s, self.series[0].time_s, self.deviation[0] ** 2)
        return np.convolve(self.unexplained(path) / (6 * variance), np.full(MISFIT_POSES, 1 / MISFIT_POSES), "same")

    def causes(self):
        """Errors of the given poses by cause, true minus given."""
        newest_s = self.time_s - self.timing.latency_s
        slots, measured = self.solver.at_slots(self.path), self.solver.measured(self.path)
        newest, sequential, blurred = self.path(newest_s), direct(slots, self.given[0]), direct(measured, self.given[0])
        return {
            "skew": difference(newest, sequential),
            "blur": difference(sequential, blurred),
            "linearization": difference(blurred, self.solver.solved(measured, self.path)),
            "latency": difference(self.path(self.time_s), newest),
        }

    def blur_covariance(self):
        """Blur that stays, because the window is not known exactly: in all directions, (N, 6, 6)."""
        blur = difference(direct(self.solver.at_slots(self.path), self.given[0]), direct(self.solver.measured(self.path), self.given[0]))
        squares = np.repeat([np.sum(blur[:, :3] ** 2, axis=1) / 3, np.sum(blur[:, 3:] ** 2, axis=1) / 3], 3, axis=0).T
        return squares[:, :, None] * np.eye(6)

    def smoothed(self):
        """Poses and rates of the smoother at the time stamps. Where it has none that is valid and better: the corrected pose."""
        pose = tuple(part.copy() for part in self.path(self.time_s))
        covariance = self.covariance.copy()
        step_s = 1e-4
        before, after = self.path(self.time_s - step_s), self.path(self.time_s + step_s)
        rates = difference(after, before) / (2 * step_s)
        rate_covariance = RATE_FACTOR * covariance / float(np.median(np.diff(self.time_s))) ** 2
        if self.rows is None:
            return self.corrected, covariance, rates, rate_covariance
        nearest = np.clip(np.searchsorted(self.rows["time_s"], self.time_s - 1e-6), 0, len(self.rows) - 1)
        rows = self.rows[nearest]
        variance = np.trace(rows["covariance"][:, :3, :3], axis1=1, axis2=2)
        used = rows["valid"] & (variance < np.trace(covariance[:, :3, :3], axis1=1, axis2=2)) & (self.misfit(self.path) < SMOOTHER_MISFIT)
        covariance[used], rate_covariance[used] = SMOOTHED_SHARE * rows["covariance"][used], rows["rate_covariance"][used]
        for part, corrected in zip(pose, self.corrected):
            part[~used] = corrected[~used]
        return pose, covariance, rates, rate_covariance


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
        one = _Stretch(poses.time_s[part], (poses.position_m[part], poses.quaternion_wxyz[part]), age_s, timing)
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
        one = _Stretch(poses.time_s[outer], tuple(array[outer] for array in given), age_s[outer], timing)
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
