"""Poses of a body with sensor coils: starts from the poses of the coils, then one fit of all couplings."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ._generator import Generator
from ._rotation import crosses, with_x_along, wxyz
from ._single_coil import ENDS, MISFIT_GATE

ROW = np.dtype([("position_m", "f8", 3), ("quaternion_wxyz", "f8", 4), ("covariance", "f8", (6, 6)), ("chi_square", "f8"), ("end", "u1")])
END = {name: n for n, name in enumerate(ENDS)}
STEPS, LAST_STEP = 40, 1e-6  # m, relative to 0.1 m, and rad
LONGEST_STEP = 0.3
REACH_M = 0.1  # unit of positions beside rotations
LEAST_SPREAD = 1e-3  # of the axes of the body that the coils show
ROLLS = 12  # starts about the axis of a coil, if it alone has a pose
DEVIATION_M, DEVIATION_RAD = 0.05, 0.5  # above which a pose is undetermined
GATE = 5.0  # standard deviations of a chi-square, beside MISFIT_GATE


def mounts_of(generator: Generator, sensors: Sequence[int]):
    """Offsets (K, 3), axes (K, 3) and gains (K,) of the coils in the body. Raises ValueError if they do not determine a body."""
    if len(sensors) < 2 or len(set(sensors)) < len(sensors):
        raise ValueError("sensors: a body needs two sensor coils or more, each once")
    for number in sensors:
        if number not in generator.sensors or generator.sensors[number].offset_m is None:
            raise ValueError(f"the generator has no mount of sensor coil {number}: its [[sensor]] needs gain, offset_m and axis; tricoil generator calibrate finds them from poses of the body")
    offset, axis, gain = (np.array([getattr(generator.sensors[n], name) for n in sensors]) for name in ("offset_m", "axis", "gain"))
    axis = axis / np.linalg.norm(axis, axis=1, keepdims=True)
    arms = np.vstack(((offset - offset.mean(axis=0)) / REACH_M, axis))
    if np.linalg.svd(arms, compute_uv=False)[1] < LEAST_SPREAD:
        raise ValueError(f"sensor coils {', '.join(map(str, sensors))} lie on one line along which their axes point: their couplings do not show the rotation about it")
    return offset, axis, gain


def _rotation_to(body: NDArray, seen: NDArray) -> Rotation:
    """Rotations that turn vectors (V, 3) of the body into seen ones (M, V, 3), least squares (Kabsch 1976)."""
    u, _, v = np.linalg.svd(np.einsum("mvi,vj->mij", seen, body))
    u[:, :, 2] *= np.linalg.det(u @ v)[:, None]
    return Rotation.from_matrix(u @ v)


def _first(five, offset, axis):
    """Starts: positions (M, 3) and rotations, from the coils' own poses (K, M): of all together, or of one that is good, in ROLLS attitudes."""
    p, n, good = five["position_m"], five["axis"], five["end"] == 0
    middle, body = offset.mean(axis=0), np.vstack(((offset - offset.mean(axis=0)) / REACH_M, axis))
    together = _rotation_to(body, np.concatenate(((p - p.mean(axis=0)) / REACH_M, n)).transpose(1, 0, 2))
    starts = [(p.mean(axis=0) - together.apply(middle), together)]
    if not good.all():
        one, rows = np.argmax(good, axis=0), np.arange(p.shape[1])
        for roll in 2 * np.pi * np.arange(ROLLS) / ROLLS:
            turn = with_x_along(n[one, rows]) * Rotation.from_rotvec([roll, 0, 0]) * with_x_along(axis[one]).inv()
            starts.append((p[one, rows] - turn.apply(offset[one]), turn))
    return starts


class _Fit:
    """Weighted couplings of K coils on a body, M rows at once: residuals and their derivatives by pose, in units of REACH_M and rad, and gains."""

    def __init__(self, generator, alone, weights, mounts, gain_deviation):
        self.generator, self.alone, self.weights = generator, alone, weights  # (K, M, N)
        self.offset, self.axis, self.gain = mounts
        self.gain_deviation = gain_deviation

    def residual(self, position, turn, gains, rows):
        """Of some rows: (M, K N + K) and (M, K N + K, 6 + K). gains: (M, K), relative to the calibration, less 1."""
        parts, jacobians, count = [], [], len(self.offset)
        for k in range(count):
            arm, n = turn.apply(self.offset[k]), turn.apply(self.axis[k])
            gain = self.gain[k] * (1 + gains[:, k])
            field = self.generator.field(position + arm, n * gain[:, None])
            w = self.weights[k][rows]
            jacobian = np.zeros((*w.shape, 6 + count))
            jacobian[:, :, :3] = REACH_M * field[:, :, 1:4]
            jacobian[:, :, 3:6] = -field[:, :, 1:4] @ crosses(arm) - field[:, :, 4:7] @ crosses(n) * gain[:, None, None]
            jacobian[:, :, 6 + k] = field[:, :, 0] / (1 + gains[:, k])[:, None]
            parts.append(w * (field[:, :, 0] - self.alone[k][rows]))
            jacobians.append(w[:, :, None] * jacobian)
        prior = np.zeros((len(position), count, 6 + count))
        prior[:, :, 6:] = np.eye(count) / self.gain_deviation
        return np.hstack((*parts, gains / self.gain_deviation)), np.concatenate((*jacobians, prior), axis=1)

    def run(self, position, turn):
        """Gauss-Newton: positions, attitudes (w, x, y, z), chi-squares, inverse normal matrices (units of the steps) and whether the steps became small."""
        count, coils = len(position), len(self.offset)
        position, turn, gains, chi_square = position.copy(), turn.as_quat(), np.zeros((count, coils)), np.zeros(count)
        inverse, small, rows = np.zeros((count, 6 + coils, 6 + coils)), np.zeros(count, bool), np.arange(count)
        for n in range(STEPS + 1):
            at = Rotation.from_quat(turn[rows])
            r, jacobian = self.residual(position[rows], at, gains[rows], rows)
            chi_square[rows], transposed = np.sum(r**2, axis=1), jacobian.swapaxes(1, 2)
            inverse[rows] = np.linalg.pinv(transposed @ jacobian, rcond=1e-14, hermitian=True)
            if n == STEPS:
                break
            step = -(inverse[rows] @ (transposed @ r[:, :, None]))[:, :, 0]
            size = np.abs(step[:, :6]).max(axis=1)
            small[rows] = size < LAST_STEP
            step *= np.minimum(1, LONGEST_STEP / np.maximum(size, 1e-300))[:, None]
            rows, step, at = rows[size >= LAST_STEP], step[size >= LAST_STEP], at[size >= LAST_STEP]
            if not len(rows):
                break
            position[rows] += REACH_M * step[:, :3]
            turn[rows] = (Rotation.from_rotvec(step[:, 3:6]) * at).as_quat()
            gains[rows] = np.clip(gains[rows] + step[:, 6:], -0.5, 0.5)
        return position, wxyz(Rotation.from_quat(turn)), chi_square, inverse, small


def _ends(five, chi_square, freedom, gate_square, covariance, small):
    """What became of each row."""
    ends = np.full(len(chi_square), END["converged"])
    deviation = np.sqrt(np.maximum(np.diagonal(covariance, axis1=1, axis2=2), 0)).reshape(-1, 2, 3).max(axis=2)
    ends[(deviation[:, 0] > DEVIATION_M) | (deviation[:, 1] > DEVIATION_RAD) | ~np.isfinite(deviation).all(axis=1)] = END["undetermined"]
    ends[chi_square > freedom + GATE * np.sqrt(2 * freedom) + gate_square] = END["misfit"]
    ends[~small] = END["not_converged"]
    lost = (five["end"] != 0).all(axis=0)  # a body of coils that are on either side, each, is so too
    ends[lost] = five["end"].max(axis=0)[lost]
    return ends


def solved(five, generator, values, weights, mounts, gain_deviation, freedom) -> NDArray:
    """Rows of solve_6dof() for couplings (K, M, N) with weights 1 / sigma; five: the coils' own poses, (K, M). freedom: of the chi-square."""
    alone = np.array([generator.of_coils(one) for one in values])
    fit = _Fit(generator, alone, weights, mounts, gain_deviation)
    found = [fit.run(*start) for start in _first(five, *mounts[:2])]
    best = np.argmin([np.nan_to_num(one[2], nan=np.inf) for one in found], axis=0)
    position, quaternion, chi_square, inverse, small = (np.array(part)[best, np.arange(len(best))] for part in zip(*found))
    unit = np.repeat([REACH_M, 1.0], 3)
    share = MISFIT_GATE * float(np.sqrt(np.mean(generator.misfit**2)))
    rows = np.empty(len(best), ROW)
    rows["position_m"], rows["quaternion_wxyz"], rows["covariance"] = position, quaternion, inverse[:, :6, :6] * unit * unit[:, None]
    rows["chi_square"] = chi_square
    rows["end"] = _ends(five, chi_square, freedom, np.sum((share * weights * alone) ** 2, axis=(0, 2)), rows["covariance"], small)
    return rows
