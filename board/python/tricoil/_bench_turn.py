"""Hinge: a motion about one fixed axis. Pendulum: a hinge that swings freely."""

import numpy as np

from ._bench_segments import Segment, matrices
from ._poses import Poses

LEAST_TURN_RAD = 0.17  # standard deviation of the angle; 10 deg
LARGEST_WOBBLE = 0.1  # of the axis, relative to the turn
LARGEST_WOBBLE_RAD = 0.05
LEAST_SWINGS = 3
LARGEST_LEFT = 0.2  # of the amplitude: error of a pendulum
BLOCKS = 20
LONGEST_S = 60.0  # of the swings that are fitted


def axis_of(turn):
    """Axis in the frame of the file and in that of the sensor, and the angle of each pose about it, rad."""
    u, _, v = np.linalg.svd(turn.mean(axis=0))
    axis, own = u[:, 0], v[0]
    across = np.linalg.svd(axis[None])[2][1]
    first = turn[0].T @ across
    first = first - own * (own @ first)
    swept = turn @ (first / np.linalg.norm(first))
    return axis, own, np.unwrap(np.arctan2(swept @ np.cross(axis, across), swept @ across))


def is_hinge(turn) -> bool:
    axis, own, angle = axis_of(turn)
    wobble = np.sqrt(np.mean(np.sum((turn @ own - axis) ** 2, axis=1)))
    return bool(angle.std() > LEAST_TURN_RAD and wobble < min(LARGEST_WOBBLE * angle.std(), LARGEST_WOBBLE_RAD))


def point_of(turn, position_m, axis, own):
    """Point of the axis that is next to the circle of the sensor."""
    rows = np.concatenate((turn, np.tile(-np.eye(3), (len(turn), 1, 1))), axis=2)
    normal = np.einsum("nij,nik->jk", rows, rows)
    side = -np.einsum("nij,ni->j", rows, position_m)
    x = np.linalg.lstsq(normal, side, rcond=1e-4)[0]
    return x[3:] - axis * (own @ x[:3])


def hinge(poses: Poses, segment: Segment) -> dict:
    """Axis (frame of the file), its wobble, and the position's deviation from the circle. Lengths in m, angles in rad."""
    turn, position_m = matrices(poses)[segment.rows], poses.position_m[segment.rows]
    axis, own, angle = axis_of(turn)
    point = point_of(turn, position_m, axis, own)
    tilt = turn @ own - axis
    means = np.array([(turn[block] @ own).mean(axis=0) for block in np.array_split(np.arange(len(turn)), min(BLOCKS, len(turn)))])
    arm = position_m - point
    axial = arm @ axis
    radius = np.linalg.norm(arm - axial[:, None] * axis, axis=1)
    return {
        "from_s": float(poses.time_s[segment.begin] - poses.time_s[0]),
        "to_s": float(poses.time_s[segment.end - 1] - poses.time_s[0]),
        "poses": len(segment),
        "turn_rad": float(np.ptp(angle)),
        "axis": axis.tolist(),
        "axis_std_rad": float(np.linalg.norm(means.std(axis=0, ddof=1)) / np.sqrt(len(means))),
        "wobble_rms_rad": float(np.sqrt(np.mean(np.sum(tilt**2, axis=1)))),
        "point_m": point.tolist(),
        "radius_m": float(radius.mean()),
        "axial_rms_m": float(axial.std()),
        "radial_rms_m": float(radius.std()),
    }


def swing(time_s, theta, omega, damping, start, rate, middle):
    """Angle of a pendulum with viscous friction: a'' = -omega^2 sin a - damping a'."""
    from scipy.integrate import solve_ivp

    done = solve_ivp(lambda _, a: (a[1], -omega**2 * np.sin(a[0]) - damping * a[1]), (time_s[0], time_s[-1]), (start, rate), t_eval=time_s, rtol=1e-7, atol=1e-9)
    return (done.y[0] if done.success else np.full(len(time_s), 1e3)) + middle - theta


def pendulum(poses: Poses, segment: Segment) -> dict | None:
    """Period, damping and residual of the angle of a hinge against a free pendulum, in its first LONGEST_S; None if it does not swing freely."""
    from scipy.optimize import least_squares

    time_s = poses.time_s[segment.rows] - poses.time_s[segment.begin]
    time_s = time_s[time_s <= LONGEST_S]
    theta = axis_of(matrices(poses)[segment.rows])[2][:len(time_s)]
    middle = (np.quantile(theta, 0.02) + np.quantile(theta, 0.98)) / 2
    crossings = time_s[1:][np.diff(np.sign(theta - middle)) != 0]
    if len(crossings) < 2 * LEAST_SWINGS:
        return None
    half_s = np.median(np.diff(crossings))
    rate = np.gradient(theta, time_s)[:3].mean()
    begin = (np.pi / half_s, 0.05, theta[0] - middle, rate, middle)
    found = least_squares(lambda x: swing(time_s, theta, *x), begin, x_scale=(1, 0.1, 0.1, 1, 0.1), max_nfev=60)
    left = found.fun
    amplitude = float(np.abs(theta - found.x[4]).max())
    rms = float(np.sqrt(np.mean(left**2)))
    if rms > LARGEST_LEFT * amplitude:
        return None
    means = np.array([block.mean() for block in np.array_split(left, min(BLOCKS, len(left)))])
    inflation = max(1.0, float(means.var(ddof=1) * len(left) / len(means) / max(left.var(), 1e-30)))
    covariance = np.linalg.pinv(found.jac.T @ found.jac) * rms**2 * inflation
    speed = np.abs(np.gradient(theta + left, time_s))  # of the pendulum, not of the noise
    fast = speed > np.quantile(speed, 0.75)
    return {
        "fitted_s": float(time_s[-1]),
        "period_s": float(2 * np.pi / found.x[0]),
        "period_std_s": float(2 * np.pi / found.x[0] ** 2 * np.sqrt(covariance[0, 0])),
        "damping_per_s": float(found.x[1]),
        "damping_std_per_s": float(np.sqrt(covariance[1, 1])),
        "amplitude_rad": amplitude,
        "residual_rms_rad": rms,
        "residual_fast_rad": float(np.sqrt(np.mean(left[fast] ** 2))),
        "residual_slow_rad": float(np.sqrt(np.mean(left[~fast] ** 2))),
        "angular_rate_max_rad_s": float(speed.max()),
    }
