"""`tricoil calibrate low-band`: ratio and phase of the low band's couplings without metal, and the quadrature that motion causes."""

import numpy as np
from numpy.typing import NDArray

from ._recorded_columns import Columns, Recorded

REST = 1e-3  # change within a mean, relative: causes a quadrature of 2e-5
FEWEST_RESTS, LARGEST_PHASE_SIGMA_RAD = 5, 5e-3
FEWEST_FRAMES, LARGEST_LAG_SIGMA = 100, 0.01  # of the lag; three source coils add to 2 %
LARGEST_SIGMA = 1e-3  # of the ratio: 0.3 mm at 0.75 m
SAME_RATE = 0.01


class _Regression:
    """One part of the low band by the high band: sums over means, (3, 3), sensor coil i, source coil j."""

    def __init__(self):
        self.high_high, self.low_high, self.low_low, self.count = np.zeros((3, 3)), np.zeros((3, 3)), np.zeros((3, 3)), np.zeros(3)

    def add(self, j: int, high: NDArray, low: NDArray) -> None:
        self.high_high[:, j] += np.sum(high**2, axis=0)
        self.low_high[:, j] += np.sum(low * high, axis=0)
        self.low_low[:, j] += np.sum(low**2, axis=0)
        self.count[j] += len(high)

    @property
    def slope(self) -> NDArray:
        with np.errstate(all="ignore"):
            return self.low_high / self.high_high

    @property
    def sigma(self) -> NDArray:
        with np.errstate(all="ignore"):
            return np.sqrt(np.maximum(self.low_low - self.slope * self.low_high, 0) / ((self.count - 1) * self.high_high))


class BandRatio:
    """Least squares over means of simultaneous columns of both bands, for each coupling: low band over in-phase high band.

    The ratio does not depend on the pose, so the sensor may move. Motion causes a quadrature, so only means at rest give phases. Errors of a low
    coupling do not depend on its size. A mean over a whole number of mains cycles contains no hum. window: columns of each mean.
    """

    def __init__(self, window: int):
        self.window, self.columns = window, 0
        self._in_phase, self._quadrature = _Regression(), _Regression()

    def add(self, j: int, high: NDArray, low: NDArray, low_quadrature: NDArray) -> None:
        """Couplings (N, 3) of the sensor coils to source coil j at successive times without a gap: high band in phase, low band."""
        self.columns += len(high)
        means = len(high) // self.window
        blocks = [part[:means * self.window].reshape(means, self.window, 3) for part in (high, low, low_quadrature)]
        mean, low_mean, low_quadrature_mean = (block.mean(axis=1) for block in blocks)
        sign = np.where(np.arange(self.window) < self.window // 2, -1, 1)[:, None]
        change = 2 * np.mean(sign * blocks[0], axis=1)  # from the first half to the second
        rests = np.linalg.norm(change, axis=1) <= REST / 2 * np.linalg.norm(mean, axis=1)
        self._in_phase.add(j, mean, low_mean)
        self._quadrature.add(j, mean[rests], low_quadrature_mean[rests])

    @property
    def knows_phases(self) -> bool:
        """False if the sensor rested too little or in too few attitudes, or the device has no quadrature: phases are then unknown."""
        q = self._quadrature
        return bool(np.min(q.count) >= FEWEST_RESTS and np.any(q.low_low) and np.max(q.sigma) <= LARGEST_PHASE_SIGMA_RAD)

    @property
    def ratio(self) -> NDArray:
        """NaN without columns."""
        return np.hypot(self._in_phase.slope, self._quadrature.slope) if self.knows_phases else self._in_phase.slope

    @property
    def sigma(self) -> NDArray:
        """Standard deviation of the ratio, from the residuals."""
        return self._in_phase.sigma

    @property
    def phase_rad(self) -> NDArray:
        return np.arctan2(self._quadrature.slope, self._in_phase.slope)

    @property
    def phase_sigma_rad(self) -> NDArray:
        return self._quadrature.sigma


class MotionLag:
    """Least squares over frames without metal: the quadratures of source coil i by the rates of the couplings to all source coils.

    A rate induces a voltage 90 degrees from the carrier's, and leaks from one carrier into the others; how much depends on the carriers and on their
    phases in the window.
    """

    def __init__(self):
        self._rate_rate, self._rate_quadrature, self._squares, self._count = np.zeros((3, 3)), np.zeros((3, 3)), np.zeros(3), 0

    def add(self, in_phase: NDArray, quadrature: NDArray, variance: NDArray, frame_s: float) -> None:
        """Successive frames (N, 3, 3; columns: source coils) without a gap. variance: (N,) of a coupling's noise."""
        rate = (in_phase[2:] - in_phase[:-2]) / (2 * frame_s)
        middle = quadrature[1:-1]
        self._rate_rate += np.einsum("nia,nib->ab", rate, rate)
        self._rate_rate -= np.sum(3 * variance[2:] / (2 * frame_s**2)) * np.eye(3)  # the rate's noise would bias the lag towards zero
        self._rate_quadrature += np.einsum("nia,nib->ab", rate, middle)
        self._squares += np.sum(middle**2, axis=(0, 1))
        self._count += len(rate)

    @property
    def lag_s(self) -> NDArray:
        """(j, i): of quadratures of source coil i by rates of source coil j. NaN without motion."""
        return self._inverse() @ self._rate_quadrature

    @property
    def sigma_s(self) -> NDArray:
        """Standard deviations, from the residuals."""
        explained = np.sum(self.lag_s * self._rate_quadrature, axis=0)
        with np.errstate(all="ignore"):
            return np.sqrt(np.outer(np.diag(self._inverse()), np.maximum(self._squares - explained, 0) / (3 * self._count - 3)))

    @property
    def is_known(self) -> bool:
        """False if the sensor moved too little, or the device has no quadrature."""
        largest_s = LARGEST_LAG_SIGMA * np.min(np.linalg.norm(self.lag_s, axis=0))
        return bool(self._count >= FEWEST_FRAMES and np.any(self._squares) and np.max(self.sigma_s) <= largest_s)

    def _inverse(self):
        try:
            return np.linalg.inv(self._rate_rate)
        except np.linalg.LinAlgError:
            return np.full((3, 3), np.nan)


def _parts(time_us, longest_us):
    """Slices of successive rows without a gap."""
    step = np.diff(time_us)
    ends = [0, *(np.flatnonzero((step > longest_us) | (step < 0)) + 1), len(time_us)]
    return [slice(*pair) for pair in zip(ends, ends[1:])]


def add_columns(columns: Columns, frame_s: float, ratio: BandRatio, lag: MotionLag) -> None:
    """Adds the columns of a recording, in their order. The low columns of a frame follow its high columns."""
    longest_us = 1e6 * 1.5 * frame_s
    for j in range(3):
        high, low = (np.flatnonzero((columns.coil == j) & (columns.low == is_low)) for is_low in (False, True))
        newest = np.searchsorted(high, low) - 1
        is_pair = newest >= 0
        is_pair[is_pair] = columns.time_us[high[newest[is_pair]]] == columns.time_us[low[is_pair]]
        high, low = high[newest[is_pair]], low[is_pair]
        for part in _parts(columns.time_us[low], longest_us):
            ratio.add(j, columns.corrected[high[part], 0], *np.swapaxes(columns.corrected[low[part]], 0, 1))
    high = np.flatnonzero(~columns.low)
    starts = np.append(True, np.diff(columns.time_us[high]) != 0)
    first = np.flatnonzero(starts)[:, None] + np.arange(3)
    first = first[first[:, 2] < len(high)]
    frames = high[first]
    frames = frames[(columns.time_us[frames] == columns.time_us[frames[:, :1]]).all(axis=1) & (np.sort(columns.coil[frames], axis=1) == range(3)).all(axis=1)]
    order = np.argsort(columns.coil[frames], axis=1)
    matrices = columns.tracked[np.take_along_axis(frames, order, axis=1)].transpose(2, 0, 3, 1)  # parts, frames, sensor coils, source coils
    for part in _parts(columns.time_us[frames[:, 0]], longest_us):
        lag.add(matrices[0, part], matrices[1, part], columns.variance[frames[part, 2]], frame_s)


def _bands(recorded: Recorded) -> tuple[BandRatio, MotionLag]:
    """All recordings must have the frame rate of the first one."""
    ratio, lag, first_s = None, MotionLag(), 0
    for folder in recorded.data:
        columns = recorded.columns(folder)
        frame_s, window = recorded.two_band_frame(folder)
        if ratio is None:
            ratio, first_s = BandRatio(window), frame_s
        elif abs(frame_s / first_s - 1) > SAME_RATE:
            raise ValueError(f"{folder}: has another frame rate than {recorded.data[0]}; calibrate from one rate")
        add_columns(columns, frame_s, ratio, lag)
    return ratio, lag


def _refuse_undetermined(sigma: NDArray) -> None:
    sizes = np.where(np.isnan(sigma), np.inf, sigma)
    i, j = np.unravel_index(np.argmax(sizes), (3, 3))
    if not sizes[i, j] <= LARGEST_SIGMA:
        raise ValueError(f"the ratio of the bands is not determined for sensor coil {i + 1} and source coil {j + 1} (standard deviation {sigma[i, j]:.2g}); "
                         "record longer, nearer to the source, and turn the sensor about all its axes")


def run(data, calibration, out) -> tuple[dict, str]:
    """What `tricoil calibrate low-band --json` prints, and its text. Raises ValueError; OSError if a disk fails."""
    recorded = Recorded(data, calibration, out)
    ratio, lag = _bands(recorded)
    _refuse_undetermined(ratio.sigma)
    found, result, floor = {"ratio": ratio.ratio}, {}, 1.0
    if ratio.knows_phases:
        floor = min(float(np.max(ratio.phase_sigma_rad)), 1.0)
        found |= {"phase_rad": ratio.phase_rad, "floor": floor}
        result["low_band_phase_rad"] = ratio.phase_rad.tolist()
    if lag.is_known:
        found["lag_s"] = lag.lag_s
        result |= {"motion_lag_s": lag.lag_s.tolist(), "motion_lag_sigma_s": float(np.max(lag.sigma_s))}
    result |= {"low_band_quadrature_floor": floor, "columns": ratio.columns, "low_band_ratio": ratio.ratio.tolist(), "least_ratio": float(np.min(ratio.ratio)),
               "most_ratio": float(np.max(ratio.ratio)), "ratio_sigma": float(np.max(ratio.sigma))}
    return recorded.write(found, result, [], _text)


def _text(r: dict) -> str:
    lines = [f"{r['columns']} columns; couplings of the low band relative to the high band: {r['least_ratio']:.5f} to {r['most_ratio']:.5f}, standard deviation "
             f"{r['ratio_sigma']:.2g}",
             f"phases of the low band, standard deviation {r['low_band_quadrature_floor']:.2g} rad" if "low_band_phase_rad" in r else
             "phases of the low band: unknown; let the sensor rest for some seconds in several attitudes",
             f"quadrature by motion, standard deviation {r['motion_lag_sigma_s']:.2g} s" if "motion_lag_s" in r else
             "quadrature by motion: unknown; move and turn the sensor faster, near the source"]
    return "\n".join(lines) + "\n"
