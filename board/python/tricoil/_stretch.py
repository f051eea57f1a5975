"""Poses of a stretch without gap: measured columns, corrected poses, smoothed path."""

import numpy as np

from . import _tricoil
from ._column_series import column_deviation, series_of
from ._frame_solver import FrameSolver, direct, matrices
from ._model import COUPLING_CONSTANT
from ._pose_covariance import covariance_of, derivatives, weight_products
from ._pose_path import PosePath, difference
from ._timing import COLUMNS

PASSES = 3  # path -> measured columns -> path; without noise each divides the error by ten or more
SIGMA_FLOOR = 1e-7  # of the median coupling: time stamps have a resolution of 1 us
SMOOTHER_MISFIT = 3.0  # mean over MISFIT_POSES poses above which the smoothed path is not used
MISFIT_POSES = 11
SMOOTHED_SHARE = 0.87  # squared errors over the covariance of the smoother, over recorded hands: 0.83 at 240, 0.87 at 120 poses/s (motion_table.py)
RATE_FACTOR = 2.0  # variance of a rate from two poses, without smoother


class Stretch:
    """Analysis of poses without a gap: their columns at their own times, the path that the splines or the smoother lay through them, and its errors."""

    def __init__(self, time_s, pose, age_s, timing):
        self.time_s, self.given, self.timing = time_s, pose, timing
        self.solver = FrameSolver(time_s, pose, age_s, timing)
        self.path = PosePath(self.solver.middle_s, *pose)
        for _ in range(PASSES if timing.is_sequential else 0):
            self.take_columns()
            self.path = PosePath(self.solver.middle_s, *self.moved_to(self.solver.middle_s))

    def finish(self):
        """Corrected poses with covariance, and the smoothed path."""
        time_s, pose, timing = self.time_s, self.given, self.timing
        self.take_columns()
        self.corrected = self.moved_to(time_s) if timing.is_sequential else pose
        self.smooth()
        deviation = np.interp(time_s, self.series[0].time_s, self.deviation[0])
        products = weight_products(time_s, self.solver.column_time_s, timing) if timing.is_sequential else np.ones((len(time_s), COLUMNS, COLUMNS))
        self.covariance = covariance_of(pose, deviation, products) + self.blur_covariance()

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
        by_pose = derivatives(self.given)
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
        tracker = _tricoil.Tracker("scaat", COUPLING_CONSTANT, start.tolist(), False, span_s, 0.0, "")
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
