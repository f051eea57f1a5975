"""Poses at the rate of the high band, without the bias that metal causes, from the couplings of both bands."""

import dataclasses

import numpy as np
from numpy.typing import NDArray

from ._band_scalar import BandScalar
from ._coil_model import Coils, unit_covariance
from ._coil_solver import turned
from ._pose_track import PoseTrack, follow
from ._rotation import rotations
from ._split_filter import SplitFilter, SplitParams

FIRST_BIAS = 0.03  # sigma of the bias before the first low-band line: share of the range, and rad
FIRST_RATES = np.array([0.5, 3])  # m/s, rad/s
HIGH_NOISE_SHARE = 0.01  # weight of each row in the running noise power
LOW_NOISE_SHARE = 0.1  # weight of each line
APPEARS = 1e-3  # largest new bias within a line: share of the range, and rad
PARTS = (slice(0, 3), slice(3, 6))  # position, small rotation


@dataclasses.dataclass(frozen=True)
class DualRateParams:
    row_period_s: float = 1 / 1500  # of the high band
    rows_per_line: int = 128  # high-band rows for each low-band line
    scalar: float | None = None  # of the extrapolation to zero metal; None: estimated from the data so far
    filter: bool = True  # False: the last bias is held between low-band lines
    hemisphere: NDArray = dataclasses.field(default_factory=lambda: np.zeros(3))  # of the first pose, source frame; zero: unknown
    max_misfit_share: float = 0.1  # of the high band; beyond it no dipole explains the couplings
    max_sigma_m: float = 0.02  # of the position per axis; beyond it the pose is not valid
    scalar_spread: float = 0.2  # share of the low band's error that remains, because one scalar serves all couplings (recorded sheet: 0.026 of 0.13 mm)
    misfit_share: float = 0.003  # variation of the misfit over the range, as a share of the couplings: equal in both bands (calibrated coils leave 0.3-0.8 %)
    split_spread: float = 0.2  # sigma of the bias' change since the last line, relative to its largest plausible value
    split: SplitParams = SplitParams()


@dataclasses.dataclass
class DualRatePoses:
    """Rows (N). position_m (N, 3), quaternion_wxyz (N, 4); position_sigma_m, rotation_sigma_rad: per axis; distortion_m: estimated displacement of the high band's
    pose by metal; is_valid: the high band's couplings fit a dipole, and position_sigma_m is within its limit."""

    position_m: NDArray
    quaternion_wxyz: NDArray
    position_sigma_m: NDArray
    rotation_sigma_rad: NDArray
    distortion_m: NDArray
    is_valid: NDArray

    def __getitem__(self, rows) -> "DualRatePoses":
        return DualRatePoses(*(getattr(self, field.name)[rows] for field in dataclasses.fields(self)))


class _Line:
    """Sums over the solved high-band rows of one line: [expected disagreement of the bands, (2, 3); low-band couplings at the poses that are corrected by the
    bias so far, (9); their Jacobian, (9, 6); residual of the high band's fit in units of the low band, (9); pose, (2, 3)]."""

    def __init__(self):
        self.rows, self.sums = 0, [np.zeros(6), np.zeros(9), np.zeros((9, 6)), np.zeros(9), np.zeros((2, 3))]

    def add(self, rows, sums):
        self.rows += rows
        self.sums = [a + b for a, b in zip(self.sums, sums)]


@dataclasses.dataclass
class _Comparison:
    """Both bands over the last two lines."""

    disagreement: NDArray  # (2, 3), high - low: position, small rotation
    pose: NDArray  # (2, 3), means of the high band
    low_redundant: NDArray  # (9), parts of the couplings that no pose explains, both in units of the low band
    high_redundant: NDArray
    low_norm: float  # of the low band's couplings
    variances: NDArray  # (2), of the low band's pose per axis, for unit noise of each coupling


def _axis_variances(covariance):
    return np.array([np.trace(covariance[part, part]) for part in PARTS]) / 3


class _Estimator:
    """State: pose and rates, bias of the high band's pose and its rates. A low-band line is a mean over two line periods, so the windows of consecutive
    lines overlap, as in lock-in amplifiers whose window is two output periods.

    The bias is measured in couplings: mean of the low band's model at the high band's poses, corrected by the bias so far, minus the low band's couplings.
    Therefore motion within the window causes no error, and only the error of the bias so far is linearised. Between lines nothing measures the bias; see
    SplitFilter. Pairs (2, 3) are position (m) and rotation (rad)."""

    def __init__(self, high: Coils, low: Coils, params: DualRateParams):
        self.high, self.low, self.params = high, low, params
        sizes = [np.outer(*(np.linalg.norm(part, axis=1) for part in (coils.moment, coils.sensitivity))).ravel() for coils in (low, high)]
        self.gain = sizes[0] / sizes[1]  # low coupling per high coupling, by moments and sensitivities
        self.scalar = BandScalar(params.scalar)
        self.filter = None
        self.last_row = None  # of the high band
        self.high_variance = 0.0  # of one high coupling
        self.low_variance = 0.0  # of one low coupling
        self.pose_variance = np.zeros(2)
        self.this_line, self.last_line = _Line(), _Line()
        self.last = None  # comparison that was used last, and the low band's position there
        self.line_at = self.end_at = self.held_bias = np.zeros((2, 3))  # high band at the time for which the bias is valid, and at the end of the last line

    # High band

    def start(self, pair):
        params, range_m = self.params, np.linalg.norm(pair[0])
        self.filter = SplitFilter(params.split, params.row_period_s, params.rows_per_line, np.array([1, 1 / range_m]), pair, FIRST_BIAS * np.array([range_m, 1]), FIRST_RATES)
        self.this_line, self.last_line, self.last = _Line(), _Line(), None
        self.line_at = self.end_at = pair
        self.held_bias = np.zeros((2, 3))

    def add_high(self, x: NDArray, high: PoseTrack) -> DualRatePoses:
        """Rows of one line: couplings (N, 9) and the poses of the high band alone."""
        count = len(x)
        out = DualRatePoses(high.position_m.copy(), high.quaternion_wxyz.copy(), *np.zeros((3, count)), np.zeros(count, bool))
        if high.is_known.any():
            first = int(np.argmax(high.is_known))
            pairs = np.stack((high.position_m, high.turned_rad), axis=1)
            if high.is_start[first]:
                self.start(pairs[first])
            rows = self.track(x[first:], high[first:], pairs[first:])
            for field in dataclasses.fields(out):
                getattr(out, field.name)[first:] = getattr(rows, field.name)
        self.last_row = high[-1:]
        return out

    def track(self, x, high, pairs):
        before = self.filter.bias()
        sums, biases, variances = self.filter.rows(pairs, high.is_solved, self.pose_variance)
        earlier = np.concatenate((before[None], biases[:-1]))[high.is_solved]
        self.accumulate(x[high.is_solved], high[high.is_solved], pairs[high.is_solved], earlier)
        if not self.params.filter:
            sums, biases = pairs, np.broadcast_to(self.held_bias, pairs.shape)
        position_m = sums[:, 0] - biases[:, 0]
        quaternion_wxyz = turned(high.quaternion_wxyz, sums[:, 1] - pairs[:, 1] - biases[:, 1])
        appears = APPEARS * np.stack((np.linalg.norm(position_m, axis=1), np.ones(len(x))), axis=1)
        sigma = self.sigma_of(variances, np.linalg.norm(biases, axis=2), np.linalg.norm(pairs - self.line_at, axis=2), appears)
        return DualRatePoses(position_m, quaternion_wxyz, sigma[:, 0], sigma[:, 1], np.linalg.norm(biases[:, 0], axis=1),
                             high.is_solved & (sigma[:, 0] <= self.params.max_sigma_m))

    def accumulate(self, x, high, pairs, biases):
        """biases (N, 2, 3): before each row."""
        if not len(x):
            return
        off = biases / (1 + self.scalar.value)
        turn = rotations(high.quaternion_wxyz).as_matrix()
        misfit = x - self.high.couplings(high.position_m, turn)[0]
        for seen in np.sum(np.diff(misfit, axis=0) ** 2, axis=1) / 6:  # white noise, from the change of the three redundant numbers from row to row
            self.high_variance += (HIGH_NOISE_SHARE if self.high_variance > 0 else 1) * (seen - self.high_variance)
        low, jacobian = self.low.couplings(high.position_m - off[:, 0], rotations(turned(high.quaternion_wxyz, -off[:, 1])).as_matrix())
        self.this_line.add(len(x), [off.sum(axis=0).ravel(), low.sum(axis=0), jacobian.sum(axis=0), self.gain * misfit.sum(axis=0), pairs.sum(axis=0)])

    def sigma_of(self, variance, bias, change, appears):
        """Of position and rotation per axis, (N, 2)."""
        scalar, params = self.scalar, self.params
        by_scalar = bias * scalar.sigma / (1 + scalar.value)
        by_spread = bias * params.scalar_spread * scalar.share
        # The high band's change since the last line may be bias, up to the largest plausible bias.
        plausible = bias + 5 * np.sqrt(variance) + appears
        by_split = params.split_spread * np.minimum(change, plausible) if params.filter else change
        return np.sqrt(variance + (by_scalar**2 + by_spread**2 + by_split**2) / 3)

    # Low band

    def add_low(self, x: NDArray) -> bool:
        """Adds a low-band line, couplings (9), before the rows of the same time. It is ignored if a high-band row of the last two lines is missing. False: its
        couplings do not determine a pose."""
        is_complete = self.this_line.rows == self.last_line.rows == self.params.rows_per_line
        comparison = self.compare(x) if is_complete else None
        if comparison is not None:
            self.use(comparison)
        if self.filter is not None:
            self.close_line()
        self.last_line, self.this_line = self.this_line, _Line()
        return not is_complete or comparison is not None

    def compare(self, low):
        expected, model, jacobian, residual, pose = ((a + b) / (2 * self.params.rows_per_line) for a, b in zip(self.last_line.sums, self.this_line.sums))
        covariance = unit_covariance(jacobian, np.linalg.norm(self.last_row.position_m))
        if covariance is None:
            return None
        solve = covariance @ jacobian.T  # pose that explains couplings
        excess = model - low
        unexpected = solve @ excess
        return _Comparison((expected + unexpected).reshape(2, 3), pose, jacobian @ unexpected - excess, residual - jacobian @ (solve @ residual),
                           np.linalg.norm(low), _axis_variances(covariance))

    def use(self, now):
        if self.last is not None:
            unexplained = now.low_redundant - self.last.low_redundant - self.scalar.share * (now.high_redundant - self.last.high_redundant)
            seen = unexplained @ unexplained / 6
            self.low_variance += (LOW_NOISE_SHARE if self.low_variance > 0 else 1) * (seen - self.low_variance)
        stretch = 1 + self.scalar.value
        self.held_bias = stretch * now.disagreement
        self.filter.add_means(now.disagreement, now.pose, stretch, self.low_variance * now.variances)
        if self.last is not None:
            self.fit_scalar(now, self.last)  # for the lines after this one
        self.last = now

    def fit_scalar(self, now, last):
        low_m, last_low_m = now.pose[0] - now.disagreement[0], last.pose[0] - last.disagreement[0]
        # Variance of a change from line to line: twice the variance of one line.
        self.scalar.add_poses(low_m - last_low_m, now.disagreement[0] - last.disagreement[0], 2 * self.low_variance * now.variances[0])
        misfit = self.params.misfit_share * np.linalg.norm(low_m - last_low_m) / np.linalg.norm(low_m) * now.low_norm
        self.scalar.add_redundant(now.low_redundant - last.low_redundant, now.high_redundant - last.high_redundant, 2 * self.low_variance, misfit**2 / 3)

    def close_line(self):
        self.filter.next_line()
        here = np.concatenate((self.last_row.position_m, self.last_row.turned_rad))
        # A held bias has the time of the middle of its window, one line ago.
        self.line_at, self.end_at = here if self.params.filter else self.end_at, here
        if self.last_row.is_solved[0]:
            _, jacobian = self.high.couplings(self.last_row.position_m, rotations(self.last_row.quaternion_wxyz).as_matrix())
            covariance = unit_covariance(jacobian[0], np.linalg.norm(here[0]))
            self.pose_variance = np.zeros(2) if covariance is None else self.high_variance * _axis_variances(covariance)


@np.errstate(all="ignore")  # of a bias that diverges, after jumps that no sensor makes
def dual_rate(high: Coils, low: Coils, high_x: NDArray, low_x: NDArray, params: DualRateParams) -> tuple[DualRatePoses, int, BandScalar]:
    """Poses of all high-band rows, the number of low-band lines that were accepted, and the scalar after the last of them.

    high, low: coils of both bands in the same source and sensor frames, each with its own moments and sensitivities. high_x (N, 9), low_x
    (ceil(N / rows_per_line), 9): couplings; line k of the low band has the time of row k * rows_per_line. Each row depends only on rows and lines up to its own
    time."""
    track = follow(high, high_x, params.rows_per_line, params.hemisphere, params.max_misfit_share)
    estimator, accepted, parts = _Estimator(high, low, params), 0, []
    for line, begin in enumerate(range(0, len(high_x), params.rows_per_line)):
        rows = slice(begin, begin + params.rows_per_line)
        accepted += estimator.add_low(low_x[line])
        parts.append(estimator.add_high(high_x[rows], track[rows]))
    poses = DualRatePoses(*(np.concatenate([getattr(part, field.name) for part in parts]) for field in dataclasses.fields(DualRatePoses)))
    return poses, accepted, estimator.scalar
