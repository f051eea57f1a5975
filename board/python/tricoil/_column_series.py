"""The measured columns of each source coil as series of time."""

import numpy as np
from numpy.typing import NDArray

from ._pose_path import Curve
from ._timing import COLUMNS

DIFFERENCE = 8  # order of the differences that separate noise from motion; below a quarter of the rate motion adds less than 1 %
DIFFERENCE_FACTOR = 12870  # variance of an eighth difference of white noise: binomial(16, 8)
SEEN = 6 / 9  # share of the noise of nine couplings that a pose of six numbers shows
FIT_STEPS = 8
NOISE_TERMS = 4
OUTLYING = 16.0  # limit of squares over their expectation


class ColumnSeries:
    """Columns of one coil at their own times. A column that several poses contain is their mean.

    time_s: (N,) of the column in each pose. values: (N, 3). slot_s: columns closer than half a slot are the same measurement.
    """

    def __init__(self, time_s: NDArray, values: NDArray, slot_s: float):
        first = np.append(True, np.diff(time_s) > slot_s / 2) if slot_s else np.ones(len(time_s), bool)
        group = np.cumsum(first) - 1
        count = np.bincount(group)
        self.time_s = np.bincount(group, time_s) / count
        self.values = np.stack([np.bincount(group, column) / count for column in values.T], axis=1)

    def at(self, time_s: NDArray) -> NDArray:
        return Curve(self.time_s, self.values)(time_s)

    def noise(self):
        """Times, variance of the noise of a coupling by squared high differences, and squared rate of the columns, each (M,); empty if too short."""
        if len(self.time_s) <= 2 * DIFFERENCE:
            return np.zeros((3, 0))
        squares = np.mean(np.diff(self.values, DIFFERENCE, axis=0) ** 2, axis=1) / (SEEN * DIFFERENCE_FACTOR)
        half = DIFFERENCE // 2
        return np.stack((self.time_s[half:-half], squares, self.squared_rate()[half:-half]))

    def squared_rate(self):
        """Mean square of the rates of the couplings, (N,)."""
        return np.mean(np.gradient(self.values, self.time_s, axis=0) ** 2, axis=1)


def series_of(column_time_s: NDArray, matrices: NDArray, slot_s: float) -> list[ColumnSeries]:
    """One series for each source coil. column_time_s: (N, 3). matrices: (N, 3, 3)."""
    result = []
    for coil in range(COLUMNS):
        order = np.argsort(column_time_s[:, coil], kind="stable")
        result.append(ColumnSeries(column_time_s[order, coil], matrices[order, :, coil], slot_s))
    return result


def column_deviation(series: list[ColumnSeries]) -> list[NDArray]:
    """Standard deviation of the couplings of each series at its times: constant noise, and noise that grows with their rate as by jitter of the time.

    These parts, and powers of the second that cover what the differences leave of fast motion, are fitted to the high differences by weighted
    least squares.
    """
    from scipy.optimize import nnls

    _, squares, rates = np.hstack([one.noise() for one in series])
    scale = max(float(np.median(rates)), 1e-300)

    def terms_of(squared_rate):
        return (squared_rate[:, None] / scale) ** np.arange(NOISE_TERMS)

    terms = terms_of(rates)
    expected = np.full(len(squares), float(np.median(squares)))
    for _ in range(FIT_STEPS):
        expected = np.maximum(expected, 1e-6 * float(np.max(expected)))
        limited = np.minimum(squares, OUTLYING * expected)
        parts, _ = nnls(terms / expected[:, None], limited / expected)
        expected = terms @ parts
    return [np.sqrt(terms_of(one.squared_rate()) @ parts) for one in series]
