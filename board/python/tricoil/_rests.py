"""`tricoil convert --to rests`: mean couplings of a sensor that a user places by hand, over each rest of a recording.

A rest lasts 0.5 s or longer; meanwhile the signal matrix stays within 1 % of its mean (about 1 mm at 0.4 m). Its first and last 0.1 s are left out of the mean.
"""

import json
import os

import numpy as np

from . import _tricoil
from ._output_file import write_whole
from ._poses import refuse_others
from ._staged_lines import STAGES, staged_lines
from ._wiring import OF_COILS_COMMENT

TOLERANCE, SHORTEST_US, MARGIN_US = 0.01, 500_000, 100_000
FULL_SCALE = 65536  # of levels
PLACES = [f"{i}{j}" for i in "123" for j in "123"]
NAMES = ["rest", "start_s", "duration_s", *(f"{kind}{place}" for kind in "xqa" for place in PLACES), "gain_step"]


def _mean(values):
    """Over the rows, which are added in their order."""
    return np.cumsum(values, axis=0)[-1] / len(values)


def _text(matrix) -> str:
    return ",".join(format(value, ".10g") for value in np.ravel(matrix))


class _ColumnMeans:
    """Mean quadratures and levels of the columns, which are passed once."""

    def __init__(self, folder: str):
        self._rows = _tricoil.recorded_quadratures(folder)
        self._at = 0

    def skip_to_restart(self):
        """To the next column that is older than the one before: the device's clock started again."""
        older = np.flatnonzero(np.diff(self._rows[self._at:, 0]) < 0)
        self._at = self._at + older[0] + 1 if older.size else len(self._rows)

    def between(self, begin: int, end: int):
        """Quadratures (3, 3), levels (3, 3), which are zero if they or the gain step changed, and gain step between two times, us. None: a source coil is missing."""
        later = np.flatnonzero(self._rows[self._at:, 0] > end)
        rows = self._rows[self._at:self._at + later[0] if later.size else None]
        self._at += len(rows)
        rows = rows[rows[:, 0] >= begin]
        coils = [rows[rows[:, 1] == coil] for coil in range(3)]
        if not all(map(len, coils)):
            return None
        quadrature, level = (np.stack([_mean(rows[:, columns]) for rows in coils], axis=1) for columns in (slice(3, 6), slice(6, 9)))
        known = (rows[:, 6:] > 0).all() and (rows[:, 2] == rows[0, 2]).all()
        return quadrature, level / FULL_SCALE * known, int(rows[0, 2]) * known


def _rests(path: str, folder: str):
    """Lines of the rests of the first sensor. path: of its poses with couplings, as JSON lines."""
    means, rest, total, last_us = _ColumnMeans(folder), [], np.zeros((3, 3)), 0

    def ended():
        """The numbers of the rest that ends here, if it is one."""
        if not rest or rest[-1][0] - rest[0][0] < SHORTEST_US:
            return
        begin, end = rest[0][0] + MARGIN_US, rest[-1][0] - MARGIN_US
        used = [x for time_us, x in rest if begin <= time_us <= end]
        columns = means.between(begin, end)
        if used and columns:
            quadrature, level, gain_step = columns
            yield f"{rest[0][0] / 1e6:.3f},{(rest[-1][0] - rest[0][0]) / 1e6:.3f},{_text(_mean(used))},{_text(quadrature)},{_text(level)},{gain_step}"

    with open(path, "rb") as lines:
        for pose in map(json.loads, lines):
            if pose["sensor"]:
                continue
            is_restart, last_us = pose["time_us"] < last_us, pose["time_us"]
            x = np.array(pose["couplings"], dtype=float).reshape(3, 3).T
            is_faulty = pose["flags"] & _tricoil.FAULT_FLAGS
            if is_restart or (rest and not is_faulty and not np.linalg.norm(len(rest) * x - total) <= TOLERANCE * np.linalg.norm(total)):
                yield from ended()
                rest, total = [], np.zeros((3, 3))
            if is_restart:
                means.skip_to_restart()
            if not is_faulty:
                rest.append((last_us, x))
                total += x
    yield from ended()


def _refuse(options: dict):
    """Raises ValueError for stages, units and angles."""
    for names, fact in ((("units",), "which defines its own units"), (("euler",), "which has no angles"), (STAGES, "which has couplings, not poses")):
        if any(options.get(name) and (name, options[name]) != ("units", "m") for name in names):
            given = ", ".join("--" + name.replace("_", "-") for name in names)
            raise ValueError(f"{' and '.join(given.rsplit(', ', 1))}: not with --to rests, {fact}")


def _described(folder: str) -> dict:
    """Description of the recording. Raises ValueError if it has no measured couplings."""
    with open(os.path.join(folder, "recording.json"), encoding="utf-8") as file:
        description = json.load(file)
    if description["trackers"] is None:
        raise ValueError(f"{folder}: has no couplings, because the device computed the poses")
    if description["trackers"]["calibration"] is not None:
        raise ValueError(f"{folder}: recorded with a calibration; --to rests needs a recording without one")
    return description


def run(folder: str, out: str, options: dict) -> int:
    """Writes CSV lines: number, start and duration of each rest (s), nine couplings, their quadratures and levels, and the gain step. Returns
    the number of rests. Raises ValueError, also if there is none, and OSError."""
    refuse_others(options, (*STAGES, "units", "euler"), "only of a file of poses")
    _refuse(options)
    with staged_lines(folder, out, {}, "full") as (_, poses):
        wiring = _described(folder)["source"].get("wiring_file")
        rests = [f"{n},{rest}" for n, rest in enumerate(_rests(poses, folder), 1)]
    if not rests:
        raise ValueError(f"{folder}: the sensor never rests; hold it still for 0.5 s or longer at each place")
    write_whole(out, "\n".join([*([OF_COILS_COMMENT] if wiring else []), ",".join(NAMES), *rests, ""]))
    return len(rests)
