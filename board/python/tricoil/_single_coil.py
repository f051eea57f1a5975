"""Poses of sensors of one coil: five degrees of freedom."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _tricoil
from ._generator import GAIN_DEVIATION, Generator
from ._model import _finite, _numbers
from ._progress import bar

#: Field `end` of a row.
ENDS = ("converged", "not_converged", "misfit", "undetermined", "ambiguous")
ROW = np.dtype([("position_m", "f8", 3), ("axis", "f8", 3), ("gain", "f8"), ("gain_deviation", "f8"), ("covariance", "f8", (6, 6)), ("chi_square", "f8"),
                ("end", "u1")])
LARGEST = 1e100  # sigma whose square is a number
MISFIT_GATE = 4.0  # misfit beyond noise that is allowed, in units of the calibration's misfit


def deviations(generator: Generator, couplings: NDArray, sigma: ArrayLike) -> NDArray:
    """Standard deviation of each coupling, (M, N): noise, and what the calibration does not explain."""
    noise = np.asarray(sigma, float)
    if noise.shape not in ((), (len(couplings),), couplings.shape):
        raise ValueError(f"sigma: has shape {noise.shape}; give a number, ({len(couplings)},) or {couplings.shape}")
    if not np.all(noise >= 0) or np.any(np.isfinite(noise) & (noise > LARGEST)):
        raise ValueError(f"sigma: must be from 0 to {LARGEST:g}")
    noise = np.broadcast_to(noise[:, None] if noise.ndim == 1 else noise, couplings.shape)
    return np.sqrt(noise**2 + (np.linalg.norm(couplings, axis=1, keepdims=True) * generator.misfit) ** 2)


def _records(found):
    """Of the binding's (M, 45): position, sensitivity, deviation of the gain, chi-square, end, covariance."""
    rows = np.empty(len(found), ROW)
    gain = np.linalg.norm(found[:, 3:6], axis=1)
    rows["position_m"], rows["gain"], rows["axis"] = found[:, :3], gain, found[:, 3:6] / np.where(gain > 0, gain, 1)[:, None]
    rows["gain_deviation"], rows["chi_square"], rows["end"] = found[:, 6], found[:, 7], found[:, 8]
    rows["covariance"] = found[:, 9:].reshape(-1, 6, 6)
    return rows


def solve_5dof(
    couplings: ArrayLike,
    generator: Generator,
    sigma: ArrayLike = 0.0,
    *,
    gain: float | None = None,
    gain_deviation: float = GAIN_DEVIATION,
    side: ArrayLike | None = None,
    used: ArrayLike | None = None,
    follow: bool = False,
    progress: bool | None = None,
) -> NDArray:
    """Position and axis of one sensor coil in the field of a generator; its rotation about the axis has no effect and stays unknown.

    couplings: (N,) or (M, N), as measured, in the order of the generator's coils. sigma: noise of one coupling, a number, (M,) or (M, N); the
    misfit of the generator's calibration is added. gain: of the sensor coil; None: it is estimated too. gain_deviation: its standard
    deviation, relative. side: direction from the generator to the half space of the sensor; None: unknown. used: (N,), False for coils to leave
    out. follow: the rows are successive poses, each search begins at the last pose.
    progress: bar on standard error; None: if it is a terminal.

    Returns a structured array (M,), or one record: position_m (3), axis (3), gain, gain_deviation (relative), covariance (6, 6) of position (m)
    and axis (unit vector), chi_square, and end, an index into tricoil.ENDS_5DOF; poses with end = 0 are good. Raises ValueError for bad
    shapes and for fewer equations than unknowns (6 coils, or 5 and a known gain).
    """
    values = _finite("couplings", _numbers("couplings", couplings))
    many = values.ndim == 2
    values = values if many else values[np.newaxis]
    if values.ndim != 2 or values.shape[1] != len(generator):
        raise ValueError(f"couplings: has shape {values.shape}; the generator has {len(generator)} coils: give ({len(generator)},) or (M, {len(generator)})")
    if gain is not None and not 0 < gain < np.inf:
        raise ValueError(f"gain: must be positive; is {gain}; without it the gain is estimated")
    if not 0 < gain_deviation < 1:
        raise ValueError(f"gain_deviation: must be between 0 and 1; is {gain_deviation}")
    spread = deviations(generator, values, _finite("sigma", _numbers("sigma", sigma)))
    if not np.all(spread > 0):
        raise ValueError("sigma: must be positive; the generator states no misfit and a coupling has no noise, or all couplings of a row are zero")
    towards = np.zeros(3) if side is None else _finite("side", _numbers("side", side))
    if towards.shape != (3,) or (side is not None and not towards.any()):
        raise ValueError("side: must be three numbers, not all zero")
    chosen = np.ones(len(generator), bool) if used is None else np.asarray(used)
    if chosen.shape != (len(generator),) or chosen.dtype != bool:
        raise ValueError(f"used: has shape {chosen.shape} and type {chosen.dtype}; give True or False for each of the {len(generator)} coils")
    weights = np.where(chosen, 1 / spread, 0.0)
    share = MISFIT_GATE * float(np.sqrt(np.mean(generator.misfit**2)))
    with bar("solve", progress) as show:
        found = _tricoil.solve_single_coil(generator.coils(), np.ascontiguousarray(generator.of_coils(values)), np.ascontiguousarray(weights),
                                          gain or 0.0, gain_deviation, towards, share, follow, show)
    rows = _records(found)
    return rows if many else rows[0]
