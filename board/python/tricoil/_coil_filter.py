"""Filter for sensors of one coil, or bodies with two or three, whose couplings to the coils of a generator are measured in turn."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _tricoil
from ._generator import Generator
from ._model import _finite, _numbers
from ._single_coil import GAIN_DEVIATION

MOST_BODY_COILS = 3
LEAST_MISFIT = 1e-6
COUNTERS = ("outliers", "starts", "losses")
_NUMBERS = [("time_s", "f8"), ("flags", "f8"), ("position_m", "f8", 3), ("quaternion_wxyz", "f8", 4), ("covariance", "f8", (6, 6)),
            ("velocity_m_s", "f8", 3), ("rate_rad_s", "f8", 3), ("gain", "f8"), ("gain_deviation", "f8"), ("snr_db", "f8")]
_FOUND = np.dtype(_NUMBERS)  # of the binding
POSE = np.dtype([*_NUMBERS[:1], ("flags", "u4"), ("valid", "?"), *_NUMBERS[2:], ("axis", "f8", 3)])


def _turned(wxyz, vector):
    """Vectors (M, 3): one of the body in the generator frame."""
    w, v = wxyz[:, :1], wxyz[:, 1:]
    t = 2 * np.cross(v, vector)
    return vector + w * t + np.cross(v, t)


class CoilFilter:
    """Extended Kalman filter of pose, velocity and angular rate, with one update for the couplings to each generator coil at their own time.

    sensors: numbers of the coils on one body, which generator.sensors describe (gain, offset_m, axis): six degrees of freedom. None: a sensor of one
    coil, with x along its axis: five degrees, flag ROLL_UNDEFINED. gain: of that coil; None: it is estimated. frame_s: time in which each generator
    coil is measured once. side, gain_deviation: as of solve_5dof(). used: (N,), False for coils to leave out. Raises ValueError for bad shapes, for
    fewer equations than unknowns, and for coils that do not determine a body.
    """

    def __init__(self, generator: Generator, frame_s: float, *, gain: float | None = None, sensors: Sequence[int] | None = None,
                 gain_deviation: float = GAIN_DEVIATION, side: ArrayLike | None = None, used: ArrayLike | None = None):
        self.generator, self.coils = generator, 1 if sensors is None else len(sensors)
        self.used = np.ones(len(generator), bool) if used is None else np.asarray(used)
        towards = np.zeros(3) if side is None else _finite("side", _numbers("side", side))
        if self.used.shape != (len(generator),) or self.used.dtype != bool:
            raise ValueError(f"used: give True or False for each of the {len(generator)} coils")
        if towards.shape != (3,) or (side is not None and not towards.any()):
            raise ValueError("side: must be three numbers, not all zero")
        if not 0 < frame_s < 10 or not 0 < gain_deviation < 1:
            raise ValueError(f"frame_s and gain_deviation: must be positive, below 10 s and 1; are {frame_s} and {gain_deviation}")
        if gain is not None and not 0 < gain < np.inf:
            raise ValueError(f"gain: must be positive; is {gain}; without it the gain is estimated")
        if sensors is None:
            mounts = np.array([[0, 0, 0, 1, 0, 0, gain or 0]], float)
        elif self.coils > MOST_BODY_COILS:
            raise ValueError(f"a body has at most {MOST_BODY_COILS} coils in the filter; there are {self.coils}")
        else:
            from ._body_solve import mounts_of

            mounts = np.column_stack(mounts_of(generator, sensors))
        if self.used.sum() < (5 if mounts[0, 6] else 6):
            raise ValueError("fewer equations than unknowns: 6 source coils are needed, or 5 and a known gain")
        self._mounts = [(row[:3], row[3:6], row[6]) for row in mounts]
        self._tracks = _tricoil.CoilTracks(generator.coils()[self.used], generator.misfit[self.used], mounts, gain_deviation, towards, frame_s)
        self._newest_s = -np.inf

    def update(self, times_s: ArrayLike, couplings: ArrayLike, sigma: ArrayLike, progress=None) -> NDArray:
        """Poses of the columns of M frames, which continue those of the last call: a structured array, at most (M N,), without the columns from which
        no pose follows. times_s: (M, N), increasing, of the couplings. couplings: (M, N), as measured, of a body (K, M, N). sigma: noise of a coupling, a
        number, or of that shape; NaN couplings are lost. Fields: time_s, flags (tricoil.Flag), valid, position_m, quaternion_wxyz, covariance of
        position (m) and small rotation (rad), velocity_m_s, rate_rad_s, gain and gain_deviation (one coil), snr_db, axis (of the first coil).
        Raises ValueError for bad shapes and times."""
        times, values = _finite("times_s", _numbers("times_s", times_s)), _numbers("couplings", couplings)
        values = values[np.newaxis] if values.ndim == 2 else values
        if times.ndim != 2 or times.shape[1] != len(self.generator) or values.shape != (self.coils, *times.shape):
            raise ValueError(f"times_s, couplings: have shapes {times.shape} and {np.shape(couplings)}; the generator has {len(self.generator)} coils, the body {self.coils}")
        noise = np.broadcast_to(_finite("sigma", _numbers("sigma", sigma)), values.shape)
        alone = np.stack([self.generator.of_coils(np.nan_to_num(one, posinf=0, neginf=0)) for one in values], axis=-1)
        alone = np.where(np.isfinite(np.moveaxis(values, 0, -1)), alone, np.nan)[:, self.used].reshape(-1, self.coils)
        when = times[:, self.used].ravel()
        if (np.diff(when, prepend=self._newest_s) < 0).any():
            raise ValueError("times_s: must not decrease, in the order of the coils")
        self._newest_s = when[-1] if when.size else self._newest_s
        if not (noise >= 0).all() or not (noise + self.generator.misfit > 0)[..., self.used].all():
            raise ValueError("sigma: must be positive; the generator states no misfit")
        columns = np.zeros((len(when), 8))
        columns[:, 0], columns[:, 1] = when, np.tile(np.arange(self.used.sum()), len(times))
        columns[:, 2:2 + self.coils] = alone
        columns[:, 5:5 + self.coils] = np.moveaxis(noise, 0, -1)[:, self.used].reshape(-1, self.coils)
        rows = self._tracks.update(columns, progress).view(_FOUND)[:, 0]
        rows = rows[np.isfinite(rows["flags"])]
        poses = np.empty(len(rows), POSE)
        for name in _FOUND.names:
            poses[name] = rows[name]
        poses["valid"] = (poses["flags"] & _tricoil.INVALIDATING_FLAGS) == 0
        poses["axis"] = _turned(rows["quaternion_wxyz"], self._mounts[0][1])
        found = np.isfinite(rows["position_m"]).all(axis=1)
        if self.generator.misfit.any() and found.any():
            poses["covariance"][found] += self._of_misfit(poses[found])
        return poses

    def _of_misfit(self, poses):
        """Covariance of poses by errors of the generator's calibration, which stay from frame to frame: (M, 6, 6)."""
        information = np.zeros((len(poses), 6, 6))
        for offset, axis, gain in self._mounts:
            turned = [_turned(poses["quaternion_wxyz"], v) for v in (offset, axis)]
            strength = poses["gain"][:, None] if self.coils == 1 else gain
            x = self.generator.field(poses["position_m"] + turned[0], turned[1] * strength)[:, self.used]
            by_rotation = np.cross((turned[1] * strength)[:, None], x[..., 4:]) + np.cross(turned[0][:, None], x[..., 1:4])
            if self.coils == 1:
                by_rotation += x[..., :1] * turned[1][:, None]  # the gain, in place of the rotation about the axis
                information[:, 3:, 3:] += turned[1][:, :, None] * turned[1][:, None] / poses["gain_deviation"][:, None, None] ** 2
            jacobian = np.concatenate((x[..., 1:4], by_rotation), axis=2)
            weight = 1 / (np.maximum(self.generator.misfit[self.used], LEAST_MISFIT) * np.linalg.norm(x[..., 0], axis=1, keepdims=True))
            weighted = jacobian * weight[..., None]
            information += weighted.transpose(0, 2, 1) @ weighted
        unit = np.array([0.1, 0.1, 0.1, 1, 1, 1])  # of the unknowns, so that all are of one size
        return np.linalg.pinv(information * unit * unit[:, None], rcond=1e-9, hermitian=True) * unit * unit[:, None]

    @property
    def counters(self) -> dict[str, int]:
        """outliers (refused couplings), starts, losses."""
        return dict(zip(COUNTERS, self._tracks.counters()))
