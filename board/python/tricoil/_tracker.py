"""A tracker fed with measured columns."""

import os
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from . import _tricoil
from ._model import COUPLING_CONSTANT, _file, _three
from ._source import Pose
from ._wiring import Wiring, wiring_of


class Filter:
    """Tracks columns of couplings: one call for each source coil that was measured.

    method: scaat (Kalman filter), direct or previous. calibration: file of tricoil calibrate with the coils, instead of
    coupling_constant; separate or large coils need scaat. column_span_s: longest time between the oldest and the newest column
    of a signal matrix: with TDM 2.5 slots, that is 2.5 / 3 of the frame period; 0 if the columns are simultaneous (FDM). window_s: length of
    a demodulation window, for the predicted blur. wiring: of the channels, see read_wiring(). confined: the sensor never leaves the half space `hemisphere`.
    """

    def __init__(
        self,
        method: str = "scaat",
        *,
        coupling_constant: float = COUPLING_CONSTANT,
        calibration: str | os.PathLike | None = None,
        hemisphere: Sequence[float] = (1, 0, 0),
        confined: bool = False,
        column_span_s: float = 0.0,
        window_s: float = 0.0,
        wiring: Wiring | str | os.PathLike | None = None,
    ):
        self._wiring = wiring_of(wiring)
        self._tracker = _tricoil.Tracker(
            method, coupling_constant, _three("hemisphere", hemisphere), confined, column_span_s, window_s, _file(calibration)
        )

    def update(self, time_s: float, source_coil: int, couplings: ArrayLike, sigma: ArrayLike) -> Pose | None:
        """Pose after one column, or None if the tracker needs more columns or refuses this one (not finite, out of order).

        time_s: middle of the window. source_coil: 0, 1 or 2. couplings: of the three sensor coils. sigma: their standard deviation,
        one number or three.
        """
        sigma = _three("sigma", np.broadcast_to(sigma, 3) if np.ndim(sigma) == 0 else sigma)
        couplings = _three("couplings", couplings)
        if source_coil in (0, 1, 2):  # the tracker refuses others
            source_coil, couplings, sigma = self._wiring.column_of_coils(source_coil, couplings, sigma)
        row = self._tracker.update(float(time_s), source_coil, list(couplings), list(sigma))
        return None if row is None else Pose.from_row(row)

    def tick(self, time_s: float) -> Pose | None:
        """Pose at a time without measurement, flagged as coasting or stale; None if nothing is due."""
        row = self._tracker.tick(float(time_s))
        return None if row is None else Pose.from_row(row)
