"""The paper's formulas (19)-(37) along a recorded path."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _tricoil
from ._model import _finite, _three
from ._motion_error import as_poses
from ._pose_path import Curve
from ._poses import LARGEST_M, PoseError, Poses

MOST_UPDATES = 2_000_000
LEAST_POSES = 8


def spherical(position_m: NDArray):
    """Range, azimuth (continuous) and elevation of positions; a positive elevation is towards -z."""
    range_m = np.linalg.norm(position_m, axis=1)
    return range_m, np.unwrap(np.arctan2(position_m[:, 1], position_m[:, 0])), -np.arcsin(np.clip(position_m[:, 2] / range_m, -1, 1))


def moving(poses: Poses) -> Poses:
    """The poses without those that repeat the one before, which recorders write if they have no new one."""
    if not len(poses):
        return poses
    is_new = np.append(True, np.any(np.diff(poses.position_m, axis=0) != 0, axis=1))
    return Poses(poses.time_s[is_new], poses.position_m[is_new], None, poses.name, poses.notes)


def along(poses: Poses, kappa: str, loop: str, rate_hz: float, place_m: ArrayLike | None) -> NDArray:
    """As motion_along(); raises PoseError."""
    path = moving(poses)
    if len(path) < LEAST_POSES:
        raise PoseError(f"{poses.name}: fewer than {LEAST_POSES} positions differ; the sensor was not moved, or the file repeats itself")
    duration_s = float(path.time_s[-1] - path.time_s[0])
    if not (np.isfinite(rate_hz) and 1 <= duration_s * rate_hz < MOST_UPDATES):
        raise PoseError(f"--rate-hz must be positive and give 1 to {MOST_UPDATES} updates in {duration_s:.4g} s; is {rate_hz}")
    if place_m is not None and np.abs(place_m).max() > LARGEST_M:
        raise PoseError(f"--place must be at most {LARGEST_M:g} m away; is {max(map(abs, place_m)):g} m")
    time_s = path.time_s[0] + np.arange(int(duration_s * rate_hz) + 1) / rate_hz
    shift_m = 0.0 if place_m is None else np.array(place_m) - path.position_m.mean(axis=0)
    position_m = Curve(path.time_s, path.position_m)(time_s) + shift_m
    if not np.all(np.linalg.norm(position_m, axis=1) > 0):
        raise PoseError(f"{poses.name}: the path meets the source; give --place")
    error_m = _tricoil.accumulated_error(np.ascontiguousarray(position_m), kappa, loop)
    true, measured = spherical(position_m), spherical(position_m - error_m)
    rows = np.empty(len(time_s), [("time_s", float), ("position_m", float, 3), ("speed_m_s", float), ("range_m", float), ("azimuth_rad", float),
                                  ("elevation_rad", float), ("e_rho_m", float), ("e_alpha_rad", float), ("e_beta_rad", float), ("position_error_m", float, 3)])
    rows["time_s"], rows["position_m"], rows["position_error_m"] = time_s, position_m, error_m
    rows["speed_m_s"] = np.linalg.norm(np.gradient(position_m, time_s, axis=0), axis=1)
    rows["range_m"], rows["azimuth_rad"], rows["elevation_rad"] = true
    rows["e_rho_m"], rows["e_beta_rad"] = true[0] - measured[0], true[2] - measured[2]
    rows["e_alpha_rad"] = np.angle(np.exp(1j * (true[1] - measured[1])))
    return rows


def motion_along(
    poses: Any,
    *,
    kappa: str = "exact",
    loop: str = "open",
    rate_hz: float = 240.0,
    place_m: ArrayLike | None = None,
) -> NDArray:
    """Errors of the previous-measurement technique along a recorded path, by the paper's formulas (19)-(37).

    poses: of read_poses() or run(), or a structured array; their positions are the true path. kappa: exact, paper (29) or two. loop: open (as in
    the paper) or closed (as in a device). rate_hz: updates per second; the path between the poses is a spline. place_m: new mean of the path;
    None: it stays where it was recorded. The formulas assume the dipole's near field: (r k)^2 / 2 is 3.9e-7 at 3 m and 14 kHz.

    Returns a structured array of the updates: time_s, position_m (3), speed_m_s, range_m, azimuth_rad, elevation_rad (true), e_rho_m, e_alpha_rad
    (without whole turns), e_beta_rad and position_error_m (3, Cartesian); errors are true minus measured.
    """
    place = None if place_m is None else _finite("place_m", _three("place_m", place_m))
    try:
        return along(as_poses(poses), kappa, loop, float(rate_hz), place)
    except PoseError as error:
        from ._command import own_names

        raise ValueError(own_names(str(error), {"--place": "place_m"})) from None
