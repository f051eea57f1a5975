"""Tip of a pointer from poses that turn about divots: one tip for all of them, robust, with its own uncertainty."""

import dataclasses

import numpy as np
from numpy.typing import NDArray

from ._bench_segments import Segment, matrices, rests_of
from ._poses import PoseError, Poses

LEAST_TILT_RAD = 0.07  # of the sensor axis that tilts least; 4 deg
LEAST_TURN_RAD = 0.03  # between two poses of one equation
LARGEST_TIP_M = 1.0
LARGEST_PLAY_M = 5e-3  # of a tip in its hole
OUTLIER = 3.0  # medians of the residuals
TRIALS = 400
QUIET_SHARE = 0.3  # of the turning poses: at least these have the tip at rest
BLOCKS = 5  # of each divot, for the uncertainty
LEAST_PAIRS = 30
PASSES = 20


@dataclasses.dataclass(frozen=True)
class Pivots:
    """tip_m: sensor frame, with tip_covariance_m2. center_m: of the divots, (D, 3), with center_std_m. residual_m: (N,), of the poses of the
    segments in order; used: those that are no outliers. turn: mean rotation matrix of each divot, (D, 3, 3)."""

    segments: list[Segment]
    tip_m: NDArray
    tip_covariance_m2: NDArray
    center_m: NDArray
    center_std_m: NDArray
    residual_m: list[NDArray]
    used: list[NDArray]
    turn: NDArray
    tilt_rad: float

    @property
    def residual_rms_m(self) -> float:
        return float(np.sqrt(np.mean(np.concatenate([r[good] for r, good in zip(self.residual_m, self.used)]) ** 2)))


def moving_tip(poses: Poses) -> tuple[NDArray, float] | None:
    """Tip of the sensor frame that is at rest while the attitude turns, if there is one, and the play of it, m.

    Between two poses of one divot (R_j - R_i) tip = p_i - p_j. The tip with the smallest residual in QUIET_SHARE of all pairs is taken.
    """
    turn, p = matrices(poses), poses.position_m
    lag = max(1, round(0.3 / float(np.median(np.diff(poses.time_s)))))
    a, b = turn[lag:] - turn[:-lag], p[:-lag] - p[lag:]
    turns = np.linalg.norm(a, axis=(1, 2)) > LEAST_TURN_RAD
    a, b = a[turns], b[turns]
    if len(a) < LEAST_PAIRS:
        return None
    random = np.random.default_rng(1)
    chosen = random.integers(0, len(a), (TRIALS, 4))
    rows, sides = a[chosen].reshape(TRIALS, 12, 3), b[chosen].reshape(TRIALS, 12, 1)
    tips = (np.linalg.pinv(rows, rcond=1e-3) @ sides)[..., 0]
    tips = tips[np.linalg.norm(tips, axis=1) < LARGEST_TIP_M]
    if not len(tips):
        return None
    scores = [np.quantile(np.linalg.norm(a @ tip - b, axis=1), QUIET_SHARE) for tip in tips]
    tip = tips[int(np.argmin(scores))]
    for _ in range(PASSES):
        left = np.linalg.norm(a @ tip - b, axis=1)
        near = left <= 3 * np.quantile(left, QUIET_SHARE)
        tip = np.linalg.lstsq(a[near].reshape(-1, 3), b[near].reshape(-1), rcond=None)[0]
    play = float(np.quantile(np.linalg.norm(a @ tip - b, axis=1), QUIET_SHARE))
    return (tip, play) if play < LARGEST_PLAY_M else None



def find(poses: Poses) -> list[Segment]:
    """Divots: parts in which the tip rests while the sensor turns about more than one axis."""
    found = moving_tip(poses)
    if found is None:
        return []
    tip, play = found
    turn = matrices(poses)
    rests = rests_of(poses, poses.position_m + turn @ tip, max(8 * play, 2e-4))
    return [dataclasses.replace(one, kind="pivot") for one in rests if tilts_of(turn[one.rows])[1] > LEAST_TILT_RAD]


def tilts_of(turn: NDArray) -> NDArray:
    """RMS tilt of the sensor's axes about their mean, rad, rising."""
    mean = turn.mean(axis=0)
    return np.sqrt(np.clip(np.linalg.eigvalsh(np.eye(3) - mean.T @ mean), 0, None))


class Normal:
    """Normal equations of the tip and of `divots` centers, as sums over blocks of poses, so that blocks can be left out."""

    def __init__(self, divots: int):
        self.divots, self.blocks = divots, []

    def add(self, turn, position_m, divot):
        size = 3 + 3 * self.divots
        matrix, side = np.zeros((size, size)), np.zeros(size)
        at = slice(3 + 3 * divot, 6 + 3 * divot)
        matrix[:3, :3] = len(turn) * np.eye(3)
        matrix[:3, at] = -turn.sum(axis=0).T
        matrix[at, :3] = -turn.sum(axis=0)
        matrix[at, at] = len(turn) * np.eye(3)
        side[:3] = -np.einsum("nij,ni->j", turn, position_m)
        side[at] = position_m.sum(axis=0)
        self.blocks.append((matrix, side))

    def solve(self, without: int | None = None) -> NDArray:
        used = [block for n, block in enumerate(self.blocks) if n != without]
        return np.linalg.lstsq(sum(matrix for matrix, _ in used), sum(side for _, side in used), rcond=1e-12)[0]


def check_tilt(turn, segments, name):
    """Least tilt over all divots together, rad. Raises PoseError if it does not determine the tip."""
    spread = sum(len(one) * (np.eye(3) - turn[one.rows].mean(axis=0).T @ turn[one.rows].mean(axis=0)) for one in segments)
    tilts = np.sqrt(np.clip(np.linalg.eigvalsh(spread / sum(map(len, segments))), 0, None))
    if tilts[0] < LEAST_TILT_RAD:
        what = "turn about one axis only" if tilts[1] >= LEAST_TILT_RAD else f"turn by only {np.degrees(tilts[1]):.1f} deg RMS"
        raise PoseError(f"{name}: the poses {what}, which does not determine the tip; tilt the pointer to all sides by 30 deg or more")
    return float(tilts[0])


def solve(poses: Poses, segments: list[Segment]) -> Pivots:
    """The tip and the divots. Poses whose residual is OUTLIER times the median are left out. Raises PoseError if the motion does not determine them."""
    turn, position_m = matrices(poses), poses.position_m
    tilt = check_tilt(turn, segments, poses.name)
    used = [np.ones(len(one), bool) for one in segments]
    for _ in range(PASSES):
        normal = Normal(len(segments))
        for n, (one, good) in enumerate(zip(segments, used)):
            rows = np.arange(one.begin, one.end)[good]
            for block in np.array_split(rows, BLOCKS if len(segments) > 3 else 4 * BLOCKS):
                if len(block):
                    normal.add(turn[block], position_m[block], n)
        x = normal.solve()
        centers = x[3:].reshape(-1, 3)
        residual = [np.linalg.norm(position_m[one.rows] + turn[one.rows] @ x[:3] - center, axis=1) for one, center in zip(segments, centers)]
        limit = max(OUTLIER * float(np.median(np.concatenate(residual))), 1e-6)
        before, used = used, [r <= limit for r in residual]
        if any(np.sum(good) < 4 for good in used):
            raise PoseError(f"{poses.name}: the tip is not at rest in a segment of {limit:.2g} m; give other --segments")
        if all(map(np.array_equal, before, used)):
            break
    pivots = Pivots(segments, x[:3], np.zeros((3, 3)), centers, np.zeros_like(centers), residual, used, np.zeros((len(segments), 3, 3)), tilt)
    if pivots.residual_rms_m > LARGEST_PLAY_M:
        raise PoseError(f"{poses.name}: the tip is not at rest: residual {1e3 * pivots.residual_rms_m:.1f} mm RMS; give other --segments")
    changes = np.array([normal.solve(n) for n in range(len(normal.blocks))]) - x
    count = len(changes)
    covariance = (count - 1) / count * changes.T @ changes  # jackknife over blocks of successive poses
    means = np.array([turn[one.rows][good].mean(axis=0) for one, good in zip(segments, used)])
    return dataclasses.replace(pivots, tip_covariance_m2=covariance[:3, :3], center_std_m=np.sqrt(np.diag(covariance)[3:]).reshape(-1, 3), turn=means)


def report(poses: Poses, pivots: Pivots) -> dict:
    """Tip (sensor frame), divots (frame of the file), residuals. Lengths in m."""
    divots = []
    for n, one in enumerate(pivots.segments):
        left = pivots.residual_m[n][pivots.used[n]]
        divots.append({
            "from_s": float(poses.time_s[one.begin] - poses.time_s[0]),
            "to_s": float(poses.time_s[one.end - 1] - poses.time_s[0]),
            "poses": len(one),
            "outliers": int(np.sum(~pivots.used[n])),
            "position_m": pivots.center_m[n].tolist(),
            "position_std_m": pivots.center_std_m[n].tolist(),
            "residual_rms_m": float(np.sqrt(np.mean(left**2))),
        })
    return {
        "tip_m": pivots.tip_m.tolist(),
        "tip_std_m": np.sqrt(np.diag(pivots.tip_covariance_m2)).tolist(),
        "tip_covariance_m2": pivots.tip_covariance_m2.tolist(),
        "tilt_rad": pivots.tilt_rad,
        "poses": sum(map(len, pivots.segments)),
        "outliers": sum(one["outliers"] for one in divots),
        "residual_rms_m": pivots.residual_rms_m,
        "divots": divots,
    }
