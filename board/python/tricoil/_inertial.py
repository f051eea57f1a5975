"""Recorded accelerations and angular rates of a sensor: table, units, and the first alignment with optical poses."""

import os
import re

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from ._align import correlation, peak, proper
from ._fusion import State
from ._pose_columns import SECONDS, split_unit
from ._pose_text import table
from ._poses import PoseError, content_of

STANDARD_GRAVITY = 9.80665
ACC = re.compile(r"(?:acc|accel|acceleration|accelerometer|a|f|linear_acceleration)[._ ]?([xyz])")
GYRO = re.compile(r"(?:gyr|gyro|gyroscope|rate|angular_rate|angular_velocity|omega|w|g)[._ ]?([xyz])")
TIME = re.compile(r"time|t|timestamp")
UNITS = {"m_s2": 1.0, "m/s2": 1.0, "m/s^2": 1.0, "m/s²": 1.0, "g": STANDARD_GRAVITY, "mg": 1e-3 * STANDARD_GRAVITY, "rad_s": 1.0, "rad/s": 1.0,
         "deg_s": np.pi / 180, "deg/s": np.pi / 180, "dps": np.pi / 180, "°/s": np.pi / 180}
UNIT = re.compile(r"(.+?)[\s_.\[(]*(" + "|".join(sorted(map(re.escape, UNITS), key=len, reverse=True)) + r")[\])]?")
FEWEST = 50
STEADY = 0.3  # standard deviation of the accelerations over the usual one: those of a slow motion are gravity
GRID_HZ = 200.0
SPAN = 10  # samples of that grid: half the width of the mean acceleration
ACCELERATING_M_S2 = 0.5  # a slower motion does not show mirrored axes
LOWEST_CORRELATION = 0.6
MOST_LEFT = 0.3  # share of the squared angular rates that a mounting does not explain
TURNING_RAD_S = 0.1
SLOWEST_S = 0.2  # usual interval of the rows
GAP = 4.0  # a longer pause is a gap, in median intervals


class Inertial:
    """time_s: (N,), s. acc, gyro: (N, 3) in m/s^2 and rad/s, or None. name; notes."""

    def __init__(self, time_s, acc, gyro, name, notes=()):
        self.time_s, self.acc, self.gyro, self.name, self.notes = time_s, acc, gyro, name, tuple(notes)


def read(path, time_unit=None) -> Inertial:
    """A table with time and acc_x to acc_z, gyr_x to gyr_z, or one of both. Rows with empty fields are left out. Raises PoseError."""
    name = os.fspath(path)
    data = content_of(name)
    content = table(data, name)
    columns, factors = {}, {}
    for n, column in enumerate(content.columns):
        text = column.strip().lower()
        found = UNIT.fullmatch(text)
        plain, unit = (found[1], UNITS[found[2]]) if found else (text, 1.0)
        for kind, pattern in (("acc", ACC), ("gyro", GYRO)):
            if role := pattern.fullmatch(plain):
                columns[kind, "xyz".index(role[1])], factors[kind] = n, unit
        plain, unit = split_unit(text)
        if TIME.fullmatch(plain) and "time" not in columns:
            columns["time"], factors["time"] = n, SECONDS[unit or time_unit or "s"]
    kinds = [kind for kind in ("acc", "gyro") if all((kind, axis) in columns for axis in range(3))]
    if "time" not in columns or not kinds:
        raise PoseError(f"{name}: has no columns of an inertial sensor; name them time_s, acc_x_m_s2 to acc_z_m_s2, gyr_x_rad_s to gyr_z_rad_s")
    used = [columns["time"], *(columns[kind, axis] for kind in kinds for axis in range(3))]
    _, some = content.empty(used)
    notes = [f"{some.sum()} rows with empty fields are left out"] if some.any() else []
    content = content.taken(np.flatnonzero(~some))
    values = {n: content.numbers(n) for n in used}
    broken = ~np.isfinite(np.column_stack([values[n] for n in used])).all(axis=1)
    if broken.any():
        raise PoseError(f"{content.where(int(np.argmax(broken)))}: is not finite; leave the field empty, or remove the line")
    time_s = values[columns["time"]] * factors["time"]
    if len(time_s) < FEWEST:
        raise PoseError(f"{name}: {len(time_s)} row{'s' if len(time_s) != 1 else ''}; at least {FEWEST} are needed")
    falls = np.flatnonzero(np.diff(time_s) <= 0)
    if len(falls):
        raise PoseError(f"{content.where(int(falls[0]) + 1)}: time does not increase")
    if (usual := float(np.median(np.diff(time_s)))) > SLOWEST_S:
        raise PoseError(f"{name}: its rows are {usual:.4g} s apart; if the time is in ms or us, name the column time_ms or time_us")
    both = {kind: factors[kind] * np.column_stack([values[columns[kind, axis]] for axis in range(3)]) for kind in kinds}
    if "acc" in both:
        check_gravity(both["acc"], name)
    return Inertial(time_s, both.get("acc"), both.get("gyro"), name, notes)


def check_gravity(acc, name):
    size = float(np.median(np.linalg.norm(acc, axis=1)))
    for unit, factor in (("g", STANDARD_GRAVITY), ("mg", 1e-3 * STANDARD_GRAVITY)):
        if 0.8 < size * factor / STANDARD_GRAVITY < 1.25:
            raise PoseError(f"{name}: the usual acceleration is {size:.4g}, so its unit is {unit}, not m/s2; name the columns acc_x_{unit} to acc_z_{unit}")
    is_steady = np.std(np.linalg.norm(acc, axis=1)) < STEADY * size
    least, most = (0.7, 1.5) if is_steady else (0.3, 6.0)
    if not least < size / STANDARD_GRAVITY < most:
        raise PoseError(f"{name}: the usual acceleration is {size:.4g} m/s2, where gravity alone is 9.8; correct the unit, or the zero of the accelerometer")


def rates_of(time_s, turn):
    """Middle times and angular rates in the body's frame, between poses without a gap."""
    step = np.diff(time_s)
    near = step < GAP * np.median(step)
    return (0.5 * (time_s[1:] + time_s[:-1]))[near], ((turn[:-1].inv() * turn[1:]).as_rotvec() / step[:, None])[near]


def clock_offset(inertial, time_s, turn, given_s):
    """Clock of the sensor minus that of the poses, by the sizes of the angular rates, and their correlation there."""
    middle_s, rate = rates_of(time_s, turn)
    if np.sqrt(np.mean(np.sum(rate**2, axis=1))) < TURNING_RAD_S:
        return given_s or 0.0, None
    step = 1 / GRID_HZ
    t, u = (np.arange(one[0], one[-1], step) for one in (middle_s, inertial.time_s))
    known = np.abs(middle_s[np.clip(np.searchsorted(middle_s, t), 0, len(middle_s) - 1)] - t) < 0.05
    window = np.ones(5) / 5  # of noise
    size = np.convolve(np.interp(t, middle_s, np.linalg.norm(rate, axis=1)), window, "same")
    other = np.convolve(np.interp(u, inertial.time_s, np.linalg.norm(inertial.gyro, axis=1)), window, "same")
    r, n = correlation(size, known, other, np.ones(len(u), bool))
    offsets = u[0] - t[0] + (np.arange(len(r)) - len(t) + 1) * step
    allowed = n >= max(1.0 * GRID_HZ, 0.15 * n.max())
    if given_s is not None:
        allowed &= np.abs(offsets - given_s) < 0.25
    if not allowed.any():
        raise PoseError(f"{inertial.name}: does not overlap the poses by 1 s: it is from {inertial.time_s[0]:.3f} to {inertial.time_s[-1]:.3f} s, they are from "
                        f"{time_s[0]:.3f} to {time_s[-1]:.3f} s")
    best = int(np.argmax(np.where(allowed, r, -2)))
    return float(peak(offsets, r, best)), float(r[best])


def check_rates(inertial, name, rate, gyro, share):
    """Refuses units of the gyroscope, by the angular rates of both, and motions that differ."""
    size = np.sqrt(np.mean(np.sum(gyro**2, axis=1)) / np.mean(np.sum(rate**2, axis=1)))
    if share > LOWEST_CORRELATION and 45 < size < 72:
        raise PoseError(f"{inertial.name}: its angular rates are {size:.3g} times those of {name}, so their unit is deg/s, not rad/s; name the columns gyr_x_deg_s to gyr_z_deg_s")
    if share < LOWEST_CORRELATION:
        raise PoseError(f"{inertial.name} and {name} do not hold the same motion: the highest correlation of their angular rates is {max(share, 0):.2f}")
    if not 0.7 < size < 1.4:
        raise PoseError(f"{inertial.name}: its angular rates are {size:.3g} times those of {name}; correct their unit, or the times")


def fitted_mount(rate, gyro):
    """Rotation from rates in the body's to those in the sensor's frame (Wahba 1965), and the share of the squares that it leaves."""
    h = gyro.T @ rate
    mount, s = proper(h)
    total = np.sum(rate**2) + np.sum(gyro**2)
    return mount, 1 - 2 * (s[0] + s[1] + np.sign(np.linalg.det(h)) * s[2]) / total


def first_mount(inertial, poses, turn, offset_s, share):
    """Rotation from the body's to the sensor's frame by the angular rates. Raises PoseError if there is none."""

    def rates(attitudes):
        middle_s, rate = rates_of(poses.time_s, attitudes)
        inside = (middle_s + offset_s >= inertial.time_s[0]) & (middle_s + offset_s <= inertial.time_s[-1])
        gyro = np.column_stack([np.interp(middle_s[inside] + offset_s, inertial.time_s, axis) for axis in inertial.gyro.T])
        return rate[inside], gyro

    rate, gyro = rates(turn)
    check_rates(inertial, poses.name, rate, gyro, share)
    mount, left = fitted_mount(rate, gyro)
    if left < MOST_LEFT:
        return mount
    if fitted_mount(*rates(turn.inv()))[1] < MOST_LEFT:
        raise PoseError(f"{poses.name}: its quaternions turn the other way than the gyroscope; change the sign of qx, qy and qz")
    raise PoseError(f"{inertial.name}: its angular rates are not those of {poses.name} in any mounting; are both on the same body?")


def check_accelerations(inertial, poses, turn, mount, offset_s):
    """Refuses mirrored positions and wrong lengths: second differences of the positions are means of the measured accelerations, weighted by a triangle."""
    step = 1 / GRID_HZ
    t = np.arange(poses.time_s[0], poses.time_s[-1], step)
    n = np.clip(np.searchsorted(poses.time_s, t), 1, len(poses.time_s) - 1)
    is_known = (poses.time_s[n] - poses.time_s[n - 1] < 2 * SPAN * step).astype(float)
    position = np.column_stack([np.interp(t, poses.time_s, axis) for axis in poses.position_m.T])
    acc = np.column_stack([np.interp(t + offset_s, inertial.time_s, axis) for axis in inertial.acc.T])
    acc = (Slerp(poses.time_s, turn)(t) * mount.inv()).apply(acc)
    if len(t) < 4 * SPAN:
        return
    moved = (position[2 * SPAN:] - 2 * position[SPAN:-SPAN] + position[:-2 * SPAN]) / (SPAN * step) ** 2
    triangle = (SPAN - np.abs(np.arange(-SPAN, SPAN + 1))) / SPAN**2
    mean = np.column_stack([np.convolve(axis, triangle, "valid") for axis in acc.T])
    whole = np.convolve(is_known, np.ones(2 * SPAN + 1), "valid") > 2 * SPAN + 0.5
    moved, mean = moved[whole], np.column_stack((mean[whole], np.ones(whole.sum())))
    if len(moved) < 100 or np.sqrt(np.mean(moved.var(axis=0))) < ACCELERATING_M_S2:
        return
    affine = np.linalg.lstsq(mean, moved, rcond=None)[0]
    left = np.mean((moved - mean @ affine) ** 2) / np.mean(moved.var(axis=0))
    size = np.cbrt(abs(np.linalg.det(affine[:3])))
    if left < 0.3 and np.linalg.det(affine[:3]) < 0:
        raise PoseError(f"{poses.name}: is mirrored relative to {inertial.name}: one of the two has left-handed axes; change the sign of one axis in its positions and attitudes")
    if left < 0.3 and not 0.7 < size < 1.4:
        raise PoseError(f"{poses.name}: its accelerations are {size:.3g} times those of {inertial.name}; are the units of the positions right? Give them with --unit")


def first_state(nodes_s, poses, turn, acc, gyro, mount, offset_s) -> State:
    """Attitudes between the poses, in gaps by the gyroscope; positions on straight lines; no bias. acc, gyro: Integral or None."""
    time_s, step = poses.time_s, np.diff(nodes_s)[:, None]
    n = np.clip(np.searchsorted(time_s, nodes_s, side="right") - 1, 0, len(time_s) - 2)
    in_gap = np.diff(time_s)[n] > GAP * np.median(np.diff(time_s))
    zero = np.zeros((len(nodes_s), 3))
    bias = zero
    attitude = Rotation.identity(len(nodes_s))
    if turn is not None:
        between = Slerp(time_s, turn)(np.clip(nodes_s, time_s[0], time_s[-1])) * mount.inv()
        matrices = between.as_matrix()
        if gyro is not None:
            moved = Rotation.from_rotvec(gyro.mean(nodes_s + offset_s) * step).as_matrix()
            for k in np.flatnonzero(in_gap):
                if k > 0:
                    matrices[k] = matrices[k - 1] @ moved[k - 1]
        attitude = Rotation.from_matrix(matrices)
        if gyro is None:
            bias = -(attitude[:-1].inv() * attitude[1:]).as_rotvec() / step
            bias = np.vstack((bias, bias[-1:]))
    position = np.column_stack([np.interp(nodes_s, time_s, axis) for axis in poses.position_m.T])
    gravity = np.zeros(3) if acc is None else -attitude[:-1].apply(acc.mean(nodes_s + offset_s)).mean(axis=0)
    return State(position, np.gradient(position, nodes_s, axis=0), attitude, zero, bias, np.zeros((len(nodes_s), 6)), np.zeros((len(nodes_s), 6)), gravity,
                 np.zeros(3), mount, offset_s)
