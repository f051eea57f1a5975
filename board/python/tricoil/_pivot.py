"""Tip of a pointer."""

import os
import re

import numpy as np
from numpy.typing import NDArray

from . import _tricoil
from ._output_file import refuse_input_as_output
from ._pivot_fit import calibrate
from ._poses import PoseError, Poses, read

SENSORS = 4  # of a tracker; tracking::kMaxSensors


def pivot(poses: NDArray | Poses | str | os.PathLike, *, sensor: int | None = None, out: str | os.PathLike | None = None) -> dict:
    """Tip offset of a pointer that was tilted to all sides while its tip rested at one point.

    poses: Run.poses, load(), or another structured array with their fields position_m, quaternion_wxyz, covariance, and optionally
    valid and sensor, in order of time; or what read_poses() returns, a file that it reads, or the folder of a recording. Without standard deviations those of the
    tip are from the residuals. sensor: needed if there are several. out: TOML file for `tricoil run --tip` and `tricoil serve --tip`.

    Returns a dictionary: tip_m (sensor frame) with tip_std_m and tip_covariance_m2, pivot_m (source frame) with pivot_std_m,
    residual_rms_m (3D), residual_sigmas, covariance_inflation, tilt_deg, poses, invalid, outliers, warnings. Raises ValueError if the motion
    does not determine the tip.

    >>> tip = tricoil.pivot(tricoil.load("take1"))
    >>> source.set_tip(tip["tip_m"], covariance_m2=tip["tip_covariance_m2"])
    """
    target = "" if out is None else os.fspath(out)
    if isinstance(poses, (str, os.PathLike, Poses)):
        from ._command import own_names

        try:
            return of_poses(poses, poses.name, target) if isinstance(poses, Poses) else of_file(os.fspath(poses), sensor, target)
        except ValueError as error:
            raise ValueError(own_names(str(error))) from None
    return of_rows(np.asarray(poses), sensor, target)


def of_file(path: str, sensor: int | str | None, out: str) -> dict:
    """Of a file of poses of any tracker, or of the folder of a recording. Raises PoseError, OSError."""
    refuse_input_as_output({"--out": out}, [path])
    if os.path.isdir(path):
        from ._run import load

        if sensor is not None and str(sensor) not in map(str, range(SENSORS)):
            raise PoseError(f"--sensor must be 0 to {SENSORS - 1}; is {sensor}")
        return named(of_rows, path, load(path), None if sensor is None else int(sensor), out)
    return of_poses(read(path, sensor=sensor, rate_hz=1), path, out)  # a file without time is in order of time


def of_poses(poses: Poses, path: str, out: str) -> dict:
    """Of poses of any tracker. Raises PoseError."""
    if poses.quaternion_wxyz is None:
        raise PoseError(f"{path}: has positions only; attitudes are needed for the tip")
    number = int(poses.sensor) if poses.sensor in map(str, range(SENSORS)) else 0
    covariance = np.zeros((len(poses), 6, 6))
    if poses.deviation is not None and np.isfinite(poses.deviation).all():
        covariance[:, range(6), range(6)] = poses.deviation**2
    found = named(of_arrays, path, poses.position_m, poses.quaternion_wxyz, covariance, number, poses.left_out, out)
    if poses.sensor not in ("", str(number)):
        found["warnings"] = [*found["warnings"], f"sensor {poses.sensor} of the file is written as sensor {number}: tricoil has the sensors 0 to {SENSORS - 1}"]
    return found


def named(function, path, *arguments):
    """The result, or the refusal with the name of the file instead of `poses`."""
    try:
        return function(*arguments)
    except ValueError as error:
        raise PoseError(re.sub(r"^(poses:|sensor: poses)", lambda found: f"{path}:{found[0].removeprefix('poses:').removeprefix('sensor:')}", str(error))) from None


def of_arrays(position_m, quaternion_wxyz, covariance, sensor, invalid, out) -> dict:
    """What `tricoil calibrate pivot --json` prints; writes the file `out`."""
    found = calibrate(position_m, quaternion_wxyz, covariance, "poses")
    if out:
        _tricoil.write_tip(out, sensor, found["tip_m"], found["tip_covariance_m2"])
    option = f"{sensor}:" + ",".join(f"{x:.6f}" for x in found["tip_m"])
    return {"sensor": sensor, "poses": len(position_m), "invalid": invalid, **found, "option": option, "out": out}


def of_rows(rows, sensor, out) -> dict:
    """Of a structured array."""
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
    return of_arrays(*fields, chosen, int(np.sum(~usable)), out)


def _mm(values):
    return " ".join(f"{1e3 * value:.3f}" for value in values)


def text(r: dict) -> str:
    """The result as the program prints it."""
    lines = [f"{r['poses']} poses of sensor {r['sensor']}, {r['invalid']} invalid, {r['outliers']} outliers; every axis of the sensor tilts by "
             f"{r['tilt_deg']:.1f} deg RMS or more",
             f"  tip      {_mm(r['tip_m'])} mm in the sensor frame, +- {_mm(r['tip_std_m'])} mm",
             f"  pivot    {_mm(r['pivot_m'])} mm in the source frame, +- {_mm(r['pivot_std_m'])} mm",
             f"  residual {1e3 * r['residual_rms_m']:.3f} mm RMS, {r['residual_sigmas']:.2f} times the poses' standard deviations; covariance "
             f"enlarged by {r['covariance_inflation']:.2f}",
             *(f"  warning: {warning}" for warning in r["warnings"]),
             f"wrote {r['out']}; use it with --tip {r['out']}" if r["out"] not in ("", "-") else f"  use it with --tip {r['option']}"]
    return "\n".join(lines) + "\n"
