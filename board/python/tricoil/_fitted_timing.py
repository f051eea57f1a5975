"""Timing of a tracker, found with a reference."""

import re

import numpy as np

from ._poses import PoseError, Poses
from ._timing import COLUMNS, Timing, parse_timing

WHOLE = 0.02  # of the interval: slots that fill it are taken as a whole number


def timing_text(result: dict, interval_s: float) -> str:
    """Words of --timing for the result of verify(): multiplexing, order of the coils and slot."""
    coils = re.search(r"S([123]) S([123]) S([123])", result["multiplexing"])
    if result["slot_s"] is None or coils is None:
        return "fdm"
    slot_s = result["slot_s"]
    count = round(interval_s / slot_s)
    if abs(count * slot_s - interval_s) < WHOLE * interval_s:
        slot_s = interval_s / count
    return f"tdm:{COLUMNS}/{1 / slot_s:.6g},order={''.join(coils.groups())}"


def fitted_timing(poses: Poses, reference: Poses) -> tuple[Timing, dict]:
    """Timing that explains the motion errors of the poses best, and the result of the verification. Raises PoseError.

    FDM, or a tracker that moves its columns to one time itself, has no error by skew: the timing is then fdm, and the poses are left alone.
    """
    from . import _verify

    if poses.quaternion_wxyz is None:
        raise PoseError(f"{poses.name}: has positions only; the motion error of a pose needs its attitude too")
    result, _ = _verify.verified(poses, reference)
    return parse_timing(timing_text(result, float(np.median(np.diff(poses.time_s))))), result


def rms_by_reference(poses: Poses, reference: Poses) -> float:
    """RMS position error of poses against a reference, m, after a fit of clock and frames."""
    from . import _verify

    return _verify.verified(Poses(poses.time_s, poses.position_m, poses.quaternion_wxyz, poses.name), reference)[0]["position_rms_m"]
