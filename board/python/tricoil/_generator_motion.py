"""Motion error of a tracker with sensors of one coil, whose couplings are measured at different times."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._generator import Generator
from ._single_coil import GAIN_DEVIATION, deviations


def generator_motion_error(
    generator: Generator, position_m: ArrayLike, axis: ArrayLike, velocity_m_s: ArrayLike, axis_rate_1_s: ArrayLike, times_s: ArrayLike,
    *, gain: float = 1.0, known_gain: bool = True, gain_deviation: float = GAIN_DEVIATION, sigma: ArrayLike | None = None,
) -> tuple[NDArray, NDArray]:
    """Errors of position (M, 3), m, and axis (M, 3), measured minus true, to first order: the pseudo-inverse of the couplings' Jacobian times
    dc_i = (dB_i/dp v . n + B_i . dn/dt) (t_i - t), with the weights of the solver.

    position_m, axis, velocity_m_s, axis_rate_1_s: (M, 3), generator frame; the last one is the angular rate times the axis (cross product).
    times_s: (N,), of the couplings relative to that of the pose. sigma: noise of the couplings, as in solve_5dof; None: equal.
    """
    p, n, v, rate = (np.atleast_2d(np.asarray(one, float)) for one in (position_m, axis, velocity_m_s, axis_rate_1_s))
    x = generator.field(p, n * gain)
    moved = (np.einsum("mni,mi->mn", x[:, :, 1:4], v) + gain * np.einsum("mni,mi->mn", x[:, :, 4:], rate)) * np.asarray(times_s, float)
    spread = deviations(generator, x[:, :, 0], np.sqrt(np.mean(x[:, :, 0] ** 2, axis=1)) * 1e-6 if sigma is None else sigma)
    jacobian, right = x[:, :, 1:] / spread[:, :, None], moved / spread
    if known_gain:
        row = np.concatenate((np.zeros_like(n), n / (gain * gain_deviation)), axis=1)
        jacobian, right = np.concatenate((jacobian, row[:, None]), axis=1), np.column_stack((right, np.zeros(len(right))))
    unit = np.array([0.1] * 3 + [gain] * 3)  # of the unknowns, so that all are of one size
    error = np.einsum("mij,mj->mi", np.linalg.pinv(jacobian * unit), right) * unit
    along = np.sum(error[:, 3:] * n, axis=1, keepdims=True)
    return error[:, :3], (error[:, 3:] - along * n) / gain
