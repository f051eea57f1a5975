"""Tip of a pointer."""

import json
import os

import numpy as np
from numpy.typing import NDArray

from . import _tricoil
from ._command import command


def pivot(poses: NDArray | str | os.PathLike, *, sensor: int | None = None, out: str | os.PathLike | None = None) -> dict:
    """Tip offset of a pointer that was tilted to all sides while its tip rested at one point.

    poses: Run.poses, load(), or another structured array with their fields position_m, quaternion_wxyz, covariance, and optionally
    valid and sensor, in order of time; or the file or folder that `tricoil calibrate pivot` reads. sensor: needed if there are several.
    out: TOML file for `tricoil run --tip` and `tricoil serve --tip`.

    Returns a dictionary: tip_m (sensor frame) with tip_std_m and tip_covariance_m2, pivot_m (source frame) with pivot_std_m,
    residual_rms_m (3D), residual_sigmas, covariance_inflation, tilt_deg, poses, invalid, outliers, warnings. Raises ValueError if the motion
    does not determine the tip.

    >>> tip = tricoil.pivot(tricoil.load("take1"))
    >>> source.set_tip(tip["tip_m"], covariance_m2=tip["tip_covariance_m2"])
    """
    target = None if out is None else os.fspath(out)
    if isinstance(poses, (str, os.PathLike)):
        return command("calibrate pivot", poses, sensor=sensor, out=target)
    rows = np.asarray(poses)
    names = rows.dtype.names or ()
    for name, shape in (("position_m", (3,)), ("quaternion_wxyz", (4,)), ("covariance", (6, 6))):
        if rows.ndim != 1 or name not in names or rows.dtype[name].shape != shape:
            raise ValueError(f"poses: must be a structured array of one dimension with a field {name} of shape {shape}")
    sensors = np.unique(rows["sensor"]) if "sensor" in names else np.array([sensor or 0])
    if sensor is None and len(sensors) > 1:
        raise ValueError(f"sensor: poses of sensors {', '.join(map(str, sensors))}; select that of the pointer")
    chosen = int(sensors[0]) if sensor is None and len(sensors) else int(sensor or 0)
    if not 0 <= chosen < 4:
        raise ValueError(f"sensor: must be 0 to 3; is {chosen}")
    if "sensor" in names:
        rows = rows[rows["sensor"] == chosen]
    usable = rows["valid"].astype(bool) if "valid" in names else np.ones(len(rows), bool)
    fields = [rows[name][usable] for name in ("position_m", "quaternion_wxyz", "covariance")]
    for name, values in zip(("position_m", "quaternion_wxyz", "covariance"), fields):
        if not np.all(np.isfinite(values)):
            raise ValueError(f"{name}: a valid pose has a number that is not finite")
    return json.loads(_tricoil.pivot(*fields, chosen, int(np.sum(~usable)), target or ""))
