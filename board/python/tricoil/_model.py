"""Forward model of concentric coils and closed-form solver, on arrays."""

import os

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _tricoil
from ._progress import bar

#: Coupling constant C of the simulated coils and of uncalibrated devices, coupling units times m^3; equation (3) of the paper.
COUPLING_CONSTANT = 6.75e-3


def _finite(name, array):
    if not np.all(np.isfinite(array)):
        raise ValueError(f"{name}: contains NaN or infinity")
    return array


def _numbers(name, value):
    try:
        array = np.asarray(value)
    except ValueError as error:  # rows of different lengths
        raise ValueError(f"{name}: not an array of numbers: {error}") from None
    if array.dtype.kind not in "fiu":
        raise TypeError(f"{name}: must be real numbers; has dtype {array.dtype}")
    return np.asarray(array, dtype=np.float64, order="C")


def _three(name, value):
    """Three numbers as a list; they need not be finite."""
    array = _numbers(name, value)
    if array.shape != (3,):
        raise ValueError(f"{name}: has shape {array.shape}; give three numbers")
    return array.tolist()


def _rows(name, value, shape):
    """The array as (N, *shape), and True if it had one more dimension than `shape`."""
    array = _numbers(name, value)
    if array.shape == shape:
        return array[np.newaxis], False
    if array.ndim == len(shape) + 1 and array.shape[1:] == shape:
        return array, True
    wanted = ", ".join(str(n) for n in shape)
    raise ValueError(f"{name}: has shape {array.shape}; give ({wanted}) or (N, {wanted})")


def _file(path):
    """Path as text; empty: none."""
    return "" if path is None else os.fspath(path)


def _positive(name, value):
    number = float(value)
    if not (number > 0 and np.isfinite(number)):
        raise ValueError(f"{name}: must be a positive number; is {value}")
    return number


def solve(
    X: ArrayLike,
    sigma: ArrayLike,
    *,
    coupling_constant: float = COUPLING_CONSTANT,
    calibration: str | os.PathLike | None = None,
    hemisphere: ArrayLike | None = None,
    progress: bool | None = None,
) -> NDArray:
    """Poses of signal matrices, maximum likelihood for equal noise on the nine couplings: closed form, or refined with a calibration.

    X: couplings, shape (3, 3) or (N, 3, 3). sigma: standard deviation of one coupling, one number or shape (N,). calibration: file of
    tricoil calibrate with the coils, instead of coupling_constant. hemisphere: direction from the source to the half space of the
    sensor, source frame; None: that of the calibration, else (1, 0, 0).
    progress: bar on standard error; None: if it is a terminal. The GIL is released; Ctrl-C raises KeyboardInterrupt.

    Returns a structured array of shape (N,), or one record, with position_m (3), quaternion_wxyz (4), covariance (6, 6), chi_square
    (misfit to a dipole, 3 degrees of freedom) and solved. Rows that have no solution (NaN, zero, rank one or two, or a coil that is
    reversed) are NaN with solved = False.
    """
    matrices, many = _rows("X", X, (3, 3))
    sigmas = _numbers("sigma", sigma)
    if sigmas.ndim > 1 or (sigmas.ndim == 1 and len(sigmas) != len(matrices)):
        raise ValueError(f"sigma: has shape {sigmas.shape}; give one number or ({len(matrices)},)")
    if not np.all((sigmas > 0) & (sigmas < np.inf)):
        raise ValueError("sigma: must be positive and finite")
    file = _file(calibration)
    if hemisphere is None:
        hemisphere = (0, 0, 0) if file else (1, 0, 0)  # zero: that of the calibration
    elif not np.any(hemisphere):
        raise ValueError("hemisphere: must be three numbers, not all zero")
    towards = _finite("hemisphere", _numbers("hemisphere", hemisphere))
    if towards.shape != (3,):
        raise ValueError("hemisphere: must be three numbers, not all zero")
    sigmas = np.ascontiguousarray(np.broadcast_to(sigmas, len(matrices)))
    with bar("solve", progress) as show:
        rows = _tricoil.solve(matrices, sigmas, _positive("coupling_constant", coupling_constant), towards, file, show)
    return rows if many else rows[0]


def couplings(
    position_m: ArrayLike,
    quaternion_wxyz: ArrayLike = (1, 0, 0, 0),
    *,
    coupling_constant: float = COUPLING_CONSTANT,
    calibration: str | os.PathLike | None = None,
) -> NDArray:
    """Signal matrices of poses: X = (C / rho^3) O D(u), equation (6) of the paper, or those of the coils in the file `calibration`.

    position_m: shape (3,) or (N, 3), not zero. quaternion_wxyz: shape (4,) or (N, 4), any length. Returns shape (3, 3) or (N, 3, 3).
    """
    positions, many = _rows("position_m", position_m, (3,))
    quaternions, several = _rows("quaternion_wxyz", quaternion_wxyz, (4,))
    if not (len(positions) == len(quaternions) or len(positions) == 1 or len(quaternions) == 1):
        raise ValueError(f"{len(positions)} positions and {len(quaternions)} quaternions: give equal numbers of both, or one position or one quaternion")
    count = max(len(positions), len(quaternions)) if len(positions) and len(quaternions) else 0
    _finite("position_m", positions)
    _finite("quaternion_wxyz", quaternions)
    if not np.all(positions.any(axis=1)):
        raise ValueError("position_m: must not be zero")
    if not np.all(quaternions.any(axis=1)):
        raise ValueError("quaternion_wxyz: must not be zero")
    x = _tricoil.couplings(
        np.ascontiguousarray(np.broadcast_to(positions, (count, 3))),
        np.ascontiguousarray(np.broadcast_to(quaternions, (count, 4))),
        _positive("coupling_constant", coupling_constant),
        _file(calibration),
    )
    return x if many or several else x[0]
