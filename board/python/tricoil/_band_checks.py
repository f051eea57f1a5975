"""Checks of recorded couplings of two bands before they are used."""

import numpy as np
from numpy.typing import NDArray

from ._coil_model import Coils
from ._coil_solver import refine, solve_cold
from ._rotation import rotations

MOST_MISFIT = 0.05  # calibrated coils leave 0.01, an aluminium sheet near them 0.03
MOST_POSITION = 0.15  # relative to the range
MOST_ROTATION_RAD = 0.2
SOLVED = 200  # lines that are solved for the checks, evenly spaced
MOST_SHIFT = 2  # lines
LEAST_LINES = 40  # for the check of the alignment
CLEARER = 2  # ratio of the unexplained powers at which another alignment is better
RIDGE = 1e-9


def median(values) -> float:
    """The lower one of two middle values; zero without values."""
    return float(np.sort(values)[(len(values) - 1) // 2]) if len(values) else 0.0


def _solved(coils, x, start, hemisphere):
    """Pose of one line, couplings (9), or None. Tries the pose `start` first, then a cold start."""
    if start is not None:
        fit = refine(coils, x[None], start.position_m, start.quaternion_wxyz, 1)[0]
        if fit.converged:
            return fit
    fit = solve_cold(coils, x, hemisphere, 1)
    return fit if fit.converged else None


def _check_poses(files, coils, bands, ratio, hemisphere):
    misfits, position, rotation, last = ([], []), [], [], None
    for line in range(0, len(bands[1]), len(bands[1]) // SOLVED + 1):
        high = _solved(coils[0], bands[0][line * ratio], last, hemisphere)
        low = None if high is None else _solved(coils[1], bands[1][line], high, hemisphere)
        for misfit, fit in zip(misfits, (high, low)):
            misfit.append(1 if fit is None else fit.misfit_share)
        if low is not None:
            last = high
            position.append(np.linalg.norm(high.position_m - low.position_m) / np.linalg.norm(high.position_m))
            one, other = rotations([high.quaternion_wxyz, low.quaternion_wxyz])
            rotation.append((one.inv() * other).magnitude())
    for path, misfit in zip(files, misfits):
        if median(misfit) > MOST_MISFIT:
            raise ValueError(f"{path}: the calibration does not fit these couplings (median misfit {100 * median(misfit):.0f} %); was it made for other coils, "
                             "or are columns swapped?")
    if median(position) > MOST_POSITION or median(rotation) > MOST_ROTATION_RAD:
        raise ValueError(f"{files[1]}: its poses differ from those of {files[0]} by {100 * median(position):.0f} % of the range and {median(rotation):.2f} rad; is "
                         "the file from another recording, or is its calibration for other coils?")


def _unexplained(high, low, shift):
    """Power of the low band's changes that a linear function of the high band's changes, `shift` lines later, does not explain."""
    end = len(low) - MOST_SHIFT
    h, y = high[MOST_SHIFT + shift:end + shift], low[MOST_SHIFT:end]
    squares, products, power = h.T @ h, h.T @ y, np.sum(y**2)
    squares += RIDGE * np.trace(squares) * np.eye(9)
    try:
        np.linalg.cholesky(squares)
        return power - np.sum(np.linalg.solve(squares, products) * products)
    except np.linalg.LinAlgError:  # the high band is constant
        return power


def _check_alignment(files, bands, ratio):
    """A low-band line is the mean over the 2 * ratio high-band lines before it."""
    lines = min(len(bands[0]) // ratio, len(bands[1]) - 1)
    sums = bands[0][:lines * ratio].reshape(lines, ratio, 9).sum(axis=1)
    high, low = np.diff(sums[1:] + sums[:-1], axis=0), np.diff(bands[1], axis=0)[2:lines]
    if len(low) < LEAST_LINES:
        return
    unexplained = {shift: _unexplained(high, low, shift) for shift in (0, -2, -1, 1, 2)}
    best = min(unexplained, key=unexplained.get)
    if unexplained[0] > CLEARER * unexplained[best]:
        raise ValueError(f"{files[1]}: is shifted by {abs(best)} line{'s' if abs(best) != 1 else ''} against {files[0]}: its line k must be the mean over the "
                         f"{2 * ratio} lines before line k x {ratio}")


@np.errstate(all="ignore")
def check_bands(files: tuple[str, str], coils: tuple[Coils, Coils], bands: tuple[NDArray, NDArray], ratio: int, hemisphere: NDArray) -> None:
    """files, coils, bands: of the high and the low band, as read_coils() and read_bands() give them. hemisphere (3): of the first pose, zero: unknown. Raises
    ValueError, naming the file, if

    - one band's couplings do not fit the calibration: the median misfit is above 5 % of the couplings;
    - the bands do not belong together: their poses differ, in the median, by more than 15 % of the range or 0.2 rad;
    - the low band is shifted by one or two lines: its changes follow the changes of the high band at another line much better."""
    _check_poses(files, coils, bands, ratio, hemisphere)
    _check_alignment(files, bands, ratio)
