"""Motions with an inertial sensor, for test_truth.py: generated ones, and those of TRICOIL_DATA_DIR/fast-motion."""

import os
import pathlib

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

RATE_HZ = 250.0
GRAVITY = np.array([0, 0, -9.81])
MOUNT = Rotation.from_rotvec([0.4, -0.7, 1.1])  # sensor to body
LEVER_M = np.array([0.03, -0.02, 0.05])  # of the sensor in the body
OFFSET_S = 0.0123  # its clock minus that of the poses
ACC_BIAS, GYRO_BIAS = np.array([0.08, -0.05, 0.03]), np.array([0.01, -0.02, 0.005])
NOISE_M, NOISE_RAD = 1e-4, 5e-4


def recorded():
    folder = os.environ.get("TRICOIL_DATA_DIR")
    return sorted(pathlib.Path(folder, "fast-motion").glob("*.csv")) if folder else []


def load(path):
    """time_s, position_m, quaternion_wxyz, acc, gyro."""
    values = np.genfromtxt(path, delimiter=",", skip_header=1)
    return values[:, 0], values[:, 1:4], values[:, 4:8], values[:, 8:11], values[:, 11:14]


class Motion:
    """Sums of sines of 0.3 to 3 Hz."""

    def __init__(self, seed=1):
        rng = np.random.default_rng(seed)
        self.f, self.phase = rng.uniform(0.3, 3, (6, 5)), rng.uniform(0, 2 * np.pi, (6, 5))
        self.size = rng.uniform(0.5, 1, (6, 5)) * np.array([0.04] * 3 + [0.25] * 3)[:, None] / self.f

    def __call__(self, time_s):
        values = np.sum(self.size * np.sin(2 * np.pi * self.f * time_s[:, None, None] + self.phase), axis=2)
        return values[:, :3] + [0.6, 0.1, 0.2], Rotation.from_rotvec(values[:, 3:])


def generated(duration_s=8.0, seed=1):
    """As load(), and the true path, a function of the time."""
    rng = np.random.default_rng(seed + 100)
    motion = Motion(seed)
    time_s = np.arange(0, duration_s, 1 / RATE_HZ)
    position, turn = motion(time_s)
    h = 1e-4
    (p0, r0), (p1, r1), (p2, r2) = (motion(time_s - OFFSET_S + shift) for shift in (-h, 0, h))
    rate = (r1.inv() * r2).as_rotvec() / (2 * h) + (r0.inv() * r1).as_rotvec() / (2 * h)
    place = [p + r.apply(LEVER_M) for p, r in ((p0, r0), (p1, r1), (p2, r2))]
    acceleration = (place[0] - 2 * place[1] + place[2]) / h**2
    acc = (r1 * MOUNT).inv().apply(acceleration - GRAVITY) + ACC_BIAS + rng.normal(0, 0.03, (len(time_s), 3))
    gyro = MOUNT.inv().apply(rate) + GYRO_BIAS + rng.normal(0, 0.003, (len(time_s), 3))
    measured = Rotation.from_rotvec(rng.normal(0, NOISE_RAD, (len(time_s), 3))) * turn
    return (time_s, position + rng.normal(0, NOISE_M, position.shape), measured.as_quat()[:, [3, 0, 1, 2]], acc, gyro), motion


def shown(time_s, known, gap_s, every_s=1.2):
    """Poses that are left: every second one (gap_s 0), or all but gaps of this length."""
    if not gap_s:
        return known & (np.arange(len(time_s)) % 2 == 0)
    within = (time_s - time_s[0]) % (gap_s + every_s)
    return known & ~((within >= every_s) & (time_s < time_s[-1] - every_s))


def turns(q):
    return Rotation.from_quat(q[:, [1, 2, 3, 0]])


def spline(time_s, position, q, at_s):
    """Errors are compared with those of a cubic spline through the poses."""
    sign = np.where(np.cumsum(np.append(0, np.sum(q[1:] * q[:-1], axis=1) < 0)) % 2, -1.0, 1.0)
    values = CubicSpline(time_s, np.hstack((position, q * sign[:, None])))(at_s)
    return values[:, :3], turns(values[:, 3:] / np.linalg.norm(values[:, 3:], axis=1)[:, None])


def errors(result, position, turn):
    """Measured minus true at some poses of the result, (N, 6)."""
    p, q = result
    return np.hstack((p - position, (turns(q) * turn.inv()).as_rotvec()))


def rms(vectors):
    return float(np.sqrt(np.mean(np.sum(vectors**2, axis=1))))


def nees(error, covariance):
    """Squared error over the covariance, mean per degree of freedom."""
    return float(np.einsum("ni,nij,nj->n", error, np.linalg.inv(covariance), error).mean() / error.shape[1])


def table(path, columns):
    """Writes a CSV file of {names: values}; a row with NaN has empty fields."""
    names = ",".join(columns)
    values = np.column_stack(list(columns.values()))
    path.write_text(names + "\n" + "\n".join(",".join("" if np.isnan(v) else f"{v:.9g}" for v in row) for row in values) + "\n")
    return str(path)


def files(folder, case, keep=None, acc_factor=1.0, gyro_factor=1.0):
    """Files of poses and of the inertial sensor."""
    time_s, position, q, acc, gyro = case
    keep = np.ones(len(time_s), bool) if keep is None else keep
    return (table(folder / "optics.csv", {"time_s": time_s[keep], "x_m,y_m,z_m": position[keep], "qw,qx,qy,qz": q[keep]}),
            table(folder / "imu.csv", {"time_s": time_s, "acc_x,acc_y,acc_z": acc_factor * acc, "gyr_x,gyr_y,gyr_z": gyro_factor * gyro}))
