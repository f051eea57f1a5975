"""`tricoil calibrate pick-up`: couplings that do not come from the sensor."""

import numpy as np
from numpy.typing import NDArray

from . import _tricoil
from ._recorded_columns import Recorded

BLOCK = 100  # columns of each source coil
FEWEST_BLOCKS = 4
CHANGE, CHANGE_OF_STRENGTH = 0.1, 1e-3  # most of the deviation, relative to the pick-up and to k at 0.75 m
DIPOLE = 0.03  # share that no pose explains: nine random numbers have less once in 1,000 times
SIGNIFICANT = 10


def block_means(coil: NDArray, values: NDArray) -> NDArray:
    """Means (B, 2, 3, 3) of blocks of columns (N,), (N, 2, 3), so that drift and slow interference count in the deviation: part, sensor coil, source coil.

    A block ends when each source coil has BLOCK columns or more.
    """
    counts = np.cumsum(coil[:, None] == range(3), axis=0)
    sums = np.cumsum(np.where((coil[:, None] == range(3))[:, None, None], values[..., None], 0), axis=0)
    means, count, before = [], np.zeros(3, int), np.zeros((2, 3, 3))
    while True:
        ends = [np.searchsorted(counts[:, j], count[j] + BLOCK) for j in range(3)]
        if max(ends) >= len(coil):
            return np.array(means).reshape(-1, 2, 3, 3)
        end = max(ends)
        means.append((sums[end] - before) / (counts[end] - count))
        count, before = counts[end], sums[end]


def mean(blocks: NDArray, other_sigma: float, strength: float) -> NDArray:
    """In phase, quadrature and standard deviation (19,). other_sigma: of each number, from another cause; strength: k at 0.75 m."""
    n = len(blocks)
    middle = blocks.mean(axis=0)
    sigma = np.sqrt(np.sum((blocks - middle) ** 2) / (18 * n * (n - 1)))
    if sigma > max(CHANGE * np.linalg.norm(middle[0]) / 3, CHANGE_OF_STRENGTH * strength):
        raise ValueError(f"the couplings change by {100 * sigma / strength:.2g} % of k at 0.75 m; leave the dummy connected and at rest, and record again")
    return np.append(middle.ravel(), np.hypot(sigma, other_sigma))


def _blocks(recorded: Recorded) -> tuple[NDArray, NDArray]:
    """Of the high and the low band, without columns that do not measure the couplings. The low band may be empty."""
    columns = [recorded.columns(folder) for folder in recorded.data]
    coil, low, faulty, measured = (np.concatenate([getattr(part, name) for part in columns]) for name in ("coil", "low", "faulty", "measured"))
    high, low = (block_means(coil[used], measured[used]) for used in (~low & ~faulty, low & ~faulty))
    if len(high) < FEWEST_BLOCKS or 0 < len(low) < FEWEST_BLOCKS:
        raise ValueError(f"{recorded.data[-1]}: too short, or with too many faulty columns; record a minute with all three source coils")
    return high, low


def _refuse_sensor(recorded: Recorded, pick_up: NDArray) -> None:
    """Raises ValueError if the couplings are those of a sensor within reach."""
    in_phase = pick_up[:9].reshape(3, 3)
    ideal = np.linalg.inv(recorded.sensitivity.T) @ in_phase @ np.linalg.inv(recorded.source_moment)
    # One of both signs is right-handed; the misfit is the same.
    rows = _tricoil.solve(np.array([ideal, -ideal]), np.ones(2), 1.0, np.array([1.0, 0, 0]), "", None)
    for row in rows[rows["solved"]]:
        range_m = np.linalg.norm(row["position_m"])
        if row["chi_square"] < 1.5 * (DIPOLE / range_m**3) ** 2 and np.linalg.norm(in_phase) > SIGNIFICANT * pick_up[18]:
            raise ValueError(f"the couplings are those of a sensor at {range_m:.2f} m; replace it by a dummy, or take it farther away")


def _distance(value):
    if value is None:
        return None
    try:
        distance_m = float(value)
    except (TypeError, ValueError):
        distance_m = 0
    if not 0 < distance_m < np.inf:
        raise ValueError(f"--distance-m must be a positive number of metres; got {value}")
    return distance_m


def run(data, calibration, out, blob=None, distance_m=None) -> tuple[dict, str]:
    """What `tricoil calibrate pick-up --json` prints, and its text. Raises ValueError; OSError if a disk fails."""
    distance_m = _distance(distance_m)
    recorded = Recorded(data, calibration, out, blob)
    constant = np.linalg.norm(recorded.source_moment) / np.sqrt(3)
    # By (6), the mean square of the nine couplings of a sensor in any attitude is k^2 / 6.
    of_sensor = constant / distance_m**3 / np.sqrt(6) if distance_m else 0.0
    strength = constant / 0.75**3
    high, low = _blocks(recorded)
    found, warnings = {"pick_up": mean(high, of_sensor, strength)}, []
    if len(low):
        found["low_pick_up"] = mean(low, of_sensor, strength)
    elif recorded.has_low_pick_up:
        warnings.append(f"{recorded.data[-1]}: has no low band; the older low-band pick-up is kept")
    _refuse_sensor(recorded, found["pick_up"])
    if of_sensor and np.linalg.norm(found["pick_up"][:9]) < 3 * of_sensor:
        raise ValueError(f"a sensor at {distance_m:g} m has couplings as large as the pick-up; replace it by a dummy")
    if not recorded.has_pick_up:
        warnings.append(f"{recorded.calibration}: its coils contain an unknown part of the pick-up; calibrate them again with --converters-from "
                        f"{'this one' if recorded.out == '-' else recorded.out}")
    return recorded.write(found, {"low_band": len(low) > 0}, warnings, lambda r: "also of the low band\n" if r["low_band"] else "")
