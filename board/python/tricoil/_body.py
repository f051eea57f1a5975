"""Pose of a body that carries two or more sensor coils, in the field of a generator: six degrees of freedom."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._generator import Generator
from ._model import _finite, _numbers
from ._single_coil import GAIN_DEVIATION, deviations, solve_5dof


def solve_6dof(
    couplings: ArrayLike,
    generator: Generator,
    sensors: Sequence[int],
    sigma: ArrayLike = 0.0,
    *,
    gain_deviation: float = GAIN_DEVIATION,
    side: ArrayLike | None = None,
    used: ArrayLike | None = None,
    follow: bool = False,
    progress: bool | None = None,
) -> NDArray:
    """Pose of a body that carries sensor coils, which generator.sensors describe (gain, offset_m and axis in the body).

    couplings: (K, N) or (K, M, N), as measured, by sensor coil in the order of `sensors` (their numbers). sigma: noise of one coupling, a number,
    (M,), or (K, M) by coil. Other arguments: as of solve_5dof(), with which each coil is solved first.

    Returns a structured array (M,), or one record: position_m (3) and quaternion_wxyz (4) of the body, v_generator = q v_body, covariance (6, 6) of
    position (m) and small rotation (rad, generator frame), chi_square, and end, an index into tricoil.ENDS_5DOF; poses with end = 0 are good.
    Raises ValueError for bad shapes, and for coils that do not determine a body.
    """
    from . import _body_solve

    mounts = _body_solve.mounts_of(generator, sensors)
    values = _finite("couplings", _numbers("couplings", couplings))
    many = values.ndim == 3
    values = values if many else values[:, np.newaxis] if values.ndim == 2 else values
    if values.ndim != 3 or len(values) != len(sensors) or values.shape[2] != len(generator):
        raise ValueError(f"couplings: has shape {np.shape(couplings)}; give ({len(sensors)}, {len(generator)}) or ({len(sensors)}, M, {len(generator)}): coils of the body, rows, coils of the generator")
    noise = _numbers("sigma", sigma)
    noises = noise if noise.ndim == 2 else [noise] * len(sensors)
    if len(noises) != len(sensors):
        raise ValueError(f"sigma: has shape {noise.shape}; give a number, ({values.shape[1]},) or ({len(sensors)}, {values.shape[1]})")
    five = np.array([solve_5dof(one, generator, s, gain=gain, gain_deviation=gain_deviation, side=side, used=used, follow=follow, progress=progress)
                     for one, s, gain in zip(values, noises, mounts[2])])
    chosen = np.ones(len(generator), bool) if used is None else np.asarray(used)
    weights = np.array([np.where(chosen, 1 / deviations(generator, one, s), 0) for one, s in zip(values, noises)])
    rows = _body_solve.solved(five, generator, values, weights, mounts, gain_deviation, len(sensors) * int(chosen.sum()) - 6)
    return rows if many else rows[0]
