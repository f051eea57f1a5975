"""Columns of recordings, and the calibration to which their results are added."""

import dataclasses
import json
import os

import numpy as np
from numpy.typing import NDArray

from . import _tricoil
from ._calibration_files import end_text, files_of


@dataclasses.dataclass
class Columns:
    """Columns (N,) of couplings of the first sensor. (N, 2, 3): in phase and quadrature of the sensor coils.

    corrected: high band by its phases alone, low band without its pick-up. tracked: high band as a tracker corrects it, with the variance of a
    coupling's noise.
    """

    time_us: NDArray
    coil: NDArray
    low: NDArray
    faulty: NDArray
    variance: NDArray
    measured: NDArray
    corrected: NDArray
    tracked: NDArray


class Recorded:
    """Recordings, and the calibration of their coils. Raises ValueError for outputs that replace an input, and for bad files."""

    def __init__(self, data, calibration, out, blob=None):
        self.data = [os.fspath(folder) for folder in data]
        self.calibration, self.out = os.fspath(calibration), os.fspath(out)
        self._file = _tricoil.Bands(files_of(self.data, out, blob, calibration))
        (self.source_moment, self.sensitivity), self.has_pick_up, self.has_low_pick_up = self._file.coils()

    def columns(self, folder: str) -> Columns:
        rows = self._file.columns(folder)
        numbers = rows[:, 5:].reshape(-1, 3, 2, 3)
        return Columns(rows[:, 0], rows[:, 1].astype(int), rows[:, 2] > 0, rows[:, 3] > 0, rows[:, 4], *np.swapaxes(numbers, 0, 1))

    def two_band_frame(self, folder: str) -> tuple[float, int]:
        """Duration of a frame (s), and frames of a window. Raises ValueError for a recording without two bands."""
        return _tricoil.two_band_frame(folder)

    def write(self, found: dict, result: dict, warnings: list[str], text) -> tuple[dict, str]:
        """Writes the calibration with the numbers found; the complete result of the command, and its text."""
        numbers = {name: np.ravel(value).tolist() for name, value in found.items()}
        result = json.loads(self._file.write(numbers, json.dumps(result), warnings))
        return result, text(result) + end_text(result)
