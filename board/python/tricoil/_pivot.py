"""Tip of a pointer."""

import os

import numpy as np
from numpy.typing import NDArray

from . import _tricoil
from ._command import own_names
from ._pivot_fit import calibrate


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
    if isinstance(poses, (str, os.PathLike)):
        try:
            return of_file(os.fspath(poses), sensor, out)
        except ValueError as error:
            raise ValueError(own_names(str(error))) from None
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
    return result("poses", chosen, int(np.sum(~usable)), fields, out)


def result(name, sensor, invalid, fields, out) -> dict:
    """What `tricoil calibrate pivot --json` prints; writes the file `out`. fields: position, quaternion and covariance of the valid poses."""
    found = calibrate(*fields, name)
    if out is not None:
        _tricoil.write_tip(os.fspath(out), sensor, found["tip_m"], found["tip_covariance_m2"])
    option = f"{sensor}:" + ",".join(f"{x:.6f}" for x in found["tip_m"])
    return {"sensor": sensor, "poses": len(fields[0]), "invalid": invalid, **found, "option": option, "out": os.fspath(out or "")}


def of_file(path, sensor=None, out=None) -> dict:
    """The same for a file or a recording. Raises ValueError with the names of the program's options."""
    if out is not None and os.path.exists(out) and os.path.exists(path) and os.path.samefile(out, path):
        raise ValueError(f"--out {os.fspath(out)}: is also an input file; choose another file")
    chosen, invalid, *fields = _tricoil.pivot_poses(path, None if sensor is None else int(sensor))
    return result(path, chosen, invalid, fields, out)


def text(found: dict) -> str:
    """The result as the program prints it."""
    def in_mm(name):
        return " ".join(f"{1e3 * x:.3f}" for x in found[name]) + " mm"

    lines = [f"{found['poses']} poses of sensor {found['sensor']}, {found['invalid']} invalid, {found['outliers']} outliers; every axis of the "
             f"sensor tilts by {found['tilt_deg']:.1f} deg RMS or more",
             f"  tip      {in_mm('tip_m')} in the sensor frame, +- {in_mm('tip_std_m')}",
             f"  pivot    {in_mm('pivot_m')} in the source frame, +- {in_mm('pivot_std_m')}",
             f"  residual {1e3 * found['residual_rms_m']:.3f} mm RMS, {found['residual_sigmas']:.2f} times the poses' standard deviations; "
             f"covariance enlarged by {found['covariance_inflation']:.2f}",
             *(f"warning: {warning}" for warning in found["warnings"]),
             f"wrote {found['out']}; use it with --tip {found['out']}" if found["out"] else f"  use it with --tip {found['option']}"]
    return "\n".join(lines) + "\n"
