"""Kalman filter that splits the high band's pose into the sensor's motion and a bias."""

import dataclasses

import numpy as np
from numpy.typing import NDArray

SUM, SUM_RATE, BIAS, BIAS_RATE, THIS_LINE, LAST_LINE = range(6)  # this and last line: mean bias during it
#: Variance of second differences of means over two lines, per process noise and line period cubed: the integral of the squared second difference of a ramp's
#: means.
SECOND_DIFFERENCE = 0.3833
OF_BIAS = (np.arange(6) >= THIS_LINE) / 2  # what a low-band line measures
TINY = np.finfo(float).tiny


@dataclasses.dataclass(frozen=True)
class SplitParams:
    decay: float = 0.1  # weight of a new estimate, once a line, if it is smaller than the present process noise
    attack: float = 0.4  # weight if it is larger
    min_noise: float = 1e-8  # smallest process noise, unit^2/s^3: 3 um after 0.13 s


class SplitFilter:
    """Two filters of three axes, of position (m) and rotation (rad); each has one covariance for its axes.

    Motion and bias are double-integrated white noise. The high band measures their sum on every row, almost without noise. The low band measures the mean
    bias over the last two lines, once a line. Between two lines the filter separates the parts by their process noises, which are estimated from second
    differences of the low band's results. The sum, not the motion, is a state: its variance is small by itself, not as a difference of large ones."""

    def __init__(self, params: SplitParams, row_period_s: float, rows_per_line: int, units: NDArray, values: NDArray, bias_sigma: NDArray, rate_sigma: NDArray):
        """units (2): of the smallest process noises. values (2, 3): first sums. bias_sigma, rate_sigma (2): standard deviations of the bias and of both
        rates (unit/s) before the first row."""
        self._params, self._line_s = params, row_period_s * rows_per_line
        self._min_noise = params.min_noise * units**2
        self._motion_noise, self._bias_noise = self._min_noise.copy(), self._min_noise.copy()
        dt, share = row_period_s, 1 / rows_per_line
        self._forward = np.eye(6)
        self._forward[SUM, SUM_RATE] = self._forward[BIAS, BIAS_RATE] = dt
        self._forward[THIS_LINE, [BIAS, BIAS_RATE]] = share, share * dt
        self._walk = np.array([[dt**3 / 3, dt**2 / 2], [dt**2 / 2, dt]])  # integrated white noise of one row: value, rate
        self._means = np.zeros((2, 6, 3))
        self._means[:, SUM] = values
        self._covariance = np.zeros((2, 6, 6))
        self._covariance[:, BIAS, BIAS] = bias_sigma**2
        self._covariance[:, SUM_RATE, SUM_RATE] = self._covariance[:, BIAS_RATE, BIAS_RATE] = rate_sigma**2
        self._disagreements, self._sums = [], []  # of the last two lines, the older first

    def bias(self) -> NDArray:
        """(2, 3)."""
        return self._means[:, BIAS].copy()

    def rows(self, sums: NDArray, is_measured: NDArray, variance: NDArray) -> tuple[NDArray, NDArray, NDArray]:
        """Successive rows: sums (N, 2, 3), measured with variance (2). Returns after each row the sum and the bias (N, 2, 3), and the variance of the motion
        (N, 2), that of the bias, too, except for the high band's noise."""
        noise = np.zeros((2, 6, 6))
        noise[:, :4, :4] = np.kron(np.array([[1, 0], [0, 0]]), self._walk) * self._motion_noise[:, None, None]
        noise[:, :4, :4] += np.kron(np.ones((2, 2)), self._walk) * self._bias_noise[:, None, None]
        means, covariance, forward, backward = self._means, self._covariance, self._forward, self._forward.T.copy()
        of_sum = np.eye(6)[SUM]
        out_means, out_covariances = np.empty((len(sums), 2, 6, 3)), np.empty((len(sums), 2, 6, 6))
        for n, values in enumerate(sums):
            means, covariance = forward @ means, forward @ covariance @ backward + noise
            if is_measured[n]:
                means, covariance = _corrected(means, covariance, of_sum, values, variance)
            out_means[n], out_covariances[n] = means, covariance
        self._means, self._covariance = means, covariance
        motion = out_covariances[..., SUM, SUM] - 2 * out_covariances[..., SUM, BIAS] + out_covariances[..., BIAS, BIAS]
        return out_means[:, :, SUM], out_means[:, :, BIAS], np.maximum(motion, 0)

    def add_means(self, disagreement: NDArray, sums: NDArray, stretch: float, variance: NDArray) -> None:
        """At the end of a line, if the last two lines were complete: means of the bands' disagreement and of the sum over both (2, 3). The bias is `stretch`
        times the disagreement. variance (2): of the disagreement."""
        variance = variance * stretch**2
        self._estimate_noise(disagreement, sums, stretch, variance)
        self._means, self._covariance = _corrected(self._means, self._covariance, OF_BIAS, stretch * disagreement, variance)

    def next_line(self) -> None:
        """At the end of every line, after add_means()."""
        self._means[:, LAST_LINE], self._means[:, THIS_LINE] = self._means[:, THIS_LINE].copy(), 0
        covariance = self._covariance
        covariance[:, LAST_LINE] = covariance[:, THIS_LINE]
        covariance[:, :, LAST_LINE] = covariance[:, :, THIS_LINE]
        covariance[:, THIS_LINE] = covariance[:, :, THIS_LINE] = 0

    def _estimate_noise(self, disagreement, sums, stretch, variance):
        """All differences use the present `stretch`, so that a change of the scalar does not appear as motion."""
        if len(self._sums) == 2:
            bias = stretch * (disagreement - 2 * self._disagreements[1] + self._disagreements[0])
            self._bias_noise = self._followed(self._bias_noise, bias, variance)
            self._motion_noise = self._followed(self._motion_noise, sums - 2 * self._sums[1] + self._sums[0] - bias, variance)
        self._disagreements, self._sums = [*self._disagreements[-1:], disagreement], [*self._sums[-1:], sums]

    def _followed(self, noise, second_difference, variance):
        power = np.maximum(np.sum(second_difference**2, axis=1) / 3 - 6 * variance, 0)
        seen = power / (SECOND_DIFFERENCE * self._line_s**3)
        weight = np.where(seen > noise, self._params.attack, self._params.decay)
        return np.maximum(noise + weight * (seen - noise), self._min_noise)


def _corrected(means, covariance, h, measured, variance):
    """Means (2, 6, 3) and covariances (2, 6, 6) after measured (2, 3) = h . state with variance (2)."""
    ph = covariance @ h
    innovation = ph @ h + variance
    gain = (ph / np.maximum(innovation, TINY)[:, None])[:, :, None]  # zero: nothing is uncertain, and ph is zero
    covariance = covariance - gain * ph[:, None]
    diagonals = np.einsum("kii->ki", covariance)
    np.maximum(diagonals, 0, out=diagonals)  # rounding
    return means + gain * (measured - h @ means)[:, None], covariance
