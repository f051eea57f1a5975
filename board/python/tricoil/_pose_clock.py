"""Clock of a tracker whose rows arrived in bursts: a host stamped them when a packet came, several with nearly one time."""

import numpy as np
from numpy.typing import NDArray

FEWEST = 20
TOGETHER = 0.25  # of the mean interval: rows that are closer came together
MOST_TOGETHER = 0.3  # share of such rows in which a stream is still even
LOST = 0.6  # of a burst: a pause that is longer by so much lost rows


def of_bursts(time_s: NDArray, position_m: NDArray) -> tuple[NDArray, str] | None:
    """Times of the even clock that explains the last row of each burst, and a note; None if the rows did not come in bursts.

    Raises ValueError if they did and no even clock explains them. The constant delay of the packets stays in the times.
    """
    step = np.diff(time_s)
    if len(time_s) < FEWEST or (step < 0).any():
        return None
    is_last = np.append(step >= TOGETHER * (time_s[-1] - time_s[0]) / len(step), True)
    last = np.flatnonzero(is_last)
    if len(last) < FEWEST // 2 or 1 - is_last.mean() < MOST_TOGETHER:
        return None
    rows, pause_s = np.diff(last), np.diff(time_s[last])
    size = max(1, round(float(np.median(rows))))
    if _moved(position_m, size) < 0.5 * _moved(position_m, 1):
        return None  # of several sensors, in turn
    longer = pause_s / float(np.median(pause_s / rows)) - rows
    whole = size if np.mean(rows == size) > 0.9 else 1  # packets are lost as a whole
    lost = np.where(longer > LOST * size, whole * np.rint(longer / whole), 0)
    row = np.arange(len(time_s)) + np.repeat(np.append(0, np.cumsum(lost)), np.diff(last, prepend=-1))
    clock = np.polyfit(row[last], time_s[last], 1)
    even = np.polyval(clock, row)
    if np.abs(even - time_s)[last].max() > np.median(pause_s):
        raise ValueError("its rows came in bursts, and no even clock explains their times; rename the column of times, and give --rate-hz")
    return even, f"rows came in bursts of {size}; the times of an even clock, {1 / clock[0]:.6g} rows a second, are used"


def _moved(position_m, rows):
    """Median distance between a pose and one so many rows later."""
    return float(np.median(np.linalg.norm(position_m[rows:] - position_m[:-rows], axis=1)))
