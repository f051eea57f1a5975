"""Motion error of recorded poses: predicted from the poses alone, and removed."""

import dataclasses
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import _tricoil
from ._motion_analysis import CAUSES, MotionAnalysis, analyse
from ._poses import PoseError, Poses, checked
from ._timing import Timing, parse_timing

TERMS = {"linearization": 0, "skew": 2, "blur": 3, "latency": 4}  # rows of the core's error model


#: Squared errors of the rates of the smoother over their variance: over recorded hands, 0.25 to 0.40 (tests/python/motion_table.py). The
#: accelerations of its model are white, those of a hand are not.
RATE_SHARE = 0.32


@dataclasses.dataclass(frozen=True)
class MotionError:
    """Predicted motion error of poses.

    rows: structured array, one row a pose: time_s, range_m, speed_m_s, angular_rate_rad_s, is_predicted, and for each of skew, blur,
    linearization, latency and total the error (6) and its standard deviation, for example total and total_deviation (6). Errors are true minus
    given: position (m), then small rotation (rad), both in the source frame. Rows outside a stretch without gap are NaN.
    corrected: the poses without that error, with covariance (N, 6, 6). smoothed: the same, smoothed. timing: what was assumed; it cannot be seen
    in the poses.
    """

    timing: Timing
    rows: NDArray
    corrected: "CorrectedPoses"
    smoothed: "CorrectedPoses"

    def rms_mm(self, name: str = "total") -> float:
        """RMS of the position error by a cause, mm."""
        return 1e3 * _rms(self.rows[name][self.rows["is_predicted"], :3])


@dataclasses.dataclass(frozen=True)
class CorrectedPoses(Poses):
    """Poses without motion error. covariance: (N, 6, 6), position (m), then small rotation (rad). is_corrected: (N,)."""

    covariance: NDArray | None = None
    is_corrected: NDArray | None = None


def _rms(vectors):
    return float(np.sqrt(np.mean(np.sum(vectors**2, axis=1)))) if len(vectors) else float("nan")


def as_poses(poses: Any) -> Poses:
    """Poses of read_poses(), of a run, or of a structured array with time_s, position_m, quaternion_wxyz and perhaps valid. Raises PoseError."""
    if isinstance(poses, Poses):
        return poses
    if isinstance(poses, tuple) and len(poses) == 3:
        return checked(*poses, "poses", "poses: pose {}".format)
    poses = getattr(poses, "poses", poses)
    names = getattr(getattr(poses, "dtype", None), "names", None) or ()
    if not {"time_s", "position_m", "quaternion_wxyz"} <= set(names):
        raise TypeError("poses: give the result of read_poses() or run(), or an array with time_s, position_m and quaternion_wxyz")
    if "valid" in names:
        poses = poses[poses["valid"]]
    return checked(poses["time_s"], poses["position_m"], poses["quaternion_wxyz"], "poses", "poses: pose {}".format)


def _deviations(analysis: MotionAnalysis):
    """Standard deviation of each cause and of their sum, from the covariance of the rates: (N, 6) by name."""
    poses, timing, known = analysis.poses, analysis.timing, analysis.is_analysed
    motion = np.zeros((int(np.sum(known)), 19))
    motion[:, :7] = np.hstack((analysis.smoothed[0], analysis.smoothed[1]))[known]
    motion[:, 7:10], motion[:, 10:13] = analysis.velocity_m_s[known], analysis.angular_rate_rad_s[known]
    age_s = np.ascontiguousarray(analysis.age_s[known]) - timing.latency_s
    update_s = max(timing.slots * timing.slot_s, float(np.median(np.diff(poses.time_s))))
    solver = timing.solver.partition("-")[0]

    def errors(rows):
        return _tricoil.systematic_errors(rows, age_s, update_s, timing.window_s, timing.latency_s, solver)

    by_rate = np.empty((len(motion), 5, 6, 6))
    step = 1e-2  # all terms are linear or quadratic in the rates: central differences are exact
    for rate in range(6):
        shift = step * np.eye(19)[7 + rate]
        by_rate[..., rate] = (errors(motion + shift) - errors(motion - shift)) / (2 * step)
    covariance = RATE_SHARE * analysis.rate_covariance[known]
    jacobians = {name: by_rate[:, row] for name, row in TERMS.items()}
    jacobians["total"] = sum(jacobians.values())
    result = {}
    for name, jacobian in jacobians.items():
        result[name] = np.full((len(poses), 6), np.nan)
        result[name][known] = np.sqrt(np.einsum("nij,njk,nik->ni", jacobian, covariance, jacobian))
    return result


def _rows(analysis: MotionAnalysis):
    fields = [("time_s", float), ("range_m", float), ("speed_m_s", float), ("angular_rate_rad_s", float), ("is_predicted", bool)]
    fields += [(name + end, float, 6) for name in (*CAUSES, "total") for end in ("", "_deviation")]
    rows = np.empty(len(analysis.poses), fields)
    rows["time_s"] = analysis.poses.time_s
    rows["range_m"] = np.linalg.norm(analysis.poses.position_m, axis=1)
    rows["speed_m_s"] = np.linalg.norm(analysis.velocity_m_s, axis=1)
    rows["angular_rate_rad_s"] = np.linalg.norm(analysis.angular_rate_rad_s, axis=1)
    rows["is_predicted"] = analysis.is_analysed
    for name, error in (*analysis.causes.items(), ("total", sum(analysis.causes.values()))):
        rows[name] = error
    for name, deviation in _deviations(analysis).items():
        rows[name + "_deviation"] = deviation
    return rows


def chosen_timing(poses: Poses, text: str, reference: Poses | None) -> tuple[Timing, dict | None]:
    """The timing of a text, or for "fit" the one that a reference shows, with the result of the verification. Raises PoseError."""
    if not isinstance(text, str):
        raise TypeError(f"timing must be a text such as tdm:3/720; is {text!r}")
    if text != "fit":
        return parse_timing(text), None
    if reference is None:
        raise PoseError("--timing fit needs a reference: give --reference, or the timing itself, for example tdm:3/720")
    from ._fitted_timing import fitted_timing

    return fitted_timing(poses, reference)


def motion_error(poses: Any, timing: str | Timing, *, reference: Any = None) -> MotionError:
    """Motion error of the poses of any tracker with three source coils, from the poses alone, by cause; and the poses without it.

    poses: of the sensor in the frame of the source, whose axes are its coils: the result of read_poses() or run(), or a structured array.
    timing: tdm:SLOTS/RATE (coils in turn, slots a frame and a second), fdm, fdm:RATE or a name (tricoil.TIMINGS), with options after commas:
    order=231 (coils in the order of their slots, the newest last), latency=MS (from the middle of the newest slot to the time stamp),
    window=MS (of one measurement) and solver=previous (the paper's previous-measurement technique; otherwise maximum likelihood).

    The timing is an assumption: without a reference it cannot be checked. So is the dipole's near field, whose relative error (r k)^2 / 2 is
    3.9e-7 at 3 m and 14 kHz. With timing="fit" and a reference (as in verify()) it is found; FDM, and
    trackers that move their columns to one time, are then left alone. Raises ValueError for poses or a timing that cannot be right.
    """
    try:
        given = as_poses(poses)
        known = timing if isinstance(timing, Timing) else chosen_timing(given, timing, None if reference is None else as_poses(reference))[0]
        analysis = analyse(given, known)
    except PoseError as error:
        from ._command import own_names

        raise ValueError(own_names(str(error))) from None

    def with_covariance(pose, covariance):
        return CorrectedPoses(given.time_s, *pose, given.name, given.notes, covariance=covariance, is_corrected=analysis.is_analysed)

    return MotionError(known, _rows(analysis), with_covariance(analysis.corrected, analysis.covariance),
                       with_covariance(analysis.smoothed, analysis.smoothed_covariance))
