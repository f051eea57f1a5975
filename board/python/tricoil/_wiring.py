"""Coil and polarity of each channel: the file of `tricoil calibrate wiring --out`."""

import dataclasses
import os

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _tricoil

OF_COILS_COMMENT = "# wiring corrected"  # above couplings to which a wiring was applied: board/support/table.hpp


@dataclasses.dataclass(frozen=True)
class Wiring:
    """sensor, source: coil of each of three channels, 1 to 3, negative if it is reversed. Raises ValueError if a coil is missing."""

    sensor: tuple[int, int, int] = (1, 2, 3)
    source: tuple[int, int, int] = (1, 2, 3)

    def __post_init__(self):
        for side in ("sensor", "source"):
            if sorted(map(abs, getattr(self, side))) != [1, 2, 3]:
                raise ValueError(f"wiring: {side} {list(getattr(self, side))} must name each coil once: 1, 2, 3, negative if reversed")

    @staticmethod
    def _matrix(order) -> NDArray:
        """channels = matrix @ coils."""
        return np.sign(order)[:, None] * np.eye(3)[np.abs(order) - 1]

    @property
    def sensor_channels(self) -> list[int]:
        """Index of the channel of each sensor coil."""
        return np.argsort(np.abs(self.sensor)).tolist()

    @property
    def parity(self) -> float:
        """1, or -1 if the couplings of the channels have a determinant of the other sign."""
        return float(round(np.linalg.det(self._matrix(self.sensor)) * np.linalg.det(self._matrix(self.source))))

    def of_coils(self, couplings: ArrayLike) -> NDArray:
        """Couplings of coils (..., 3, 3; sensor coil, source coil), from those of channels."""
        return self._matrix(self.sensor).T @ np.asarray(couplings) @ self._matrix(self.source)

    def column_of_coils(self, source_channel: int, couplings: ArrayLike, sigma: ArrayLike) -> tuple[int, NDArray, NDArray]:
        """Source coil (0 to 2), couplings (3,) and sigma (3,) of the sensor coils, from those of the channels."""
        driven = self.source[source_channel]
        channels = self.sensor_channels
        signs = np.sign(driven) * np.sign(self.sensor)[channels]
        return abs(driven) - 1, signs * np.asarray(couplings, float)[channels], np.asarray(sigma, float)[channels]


def read_wiring(path: str | os.PathLike) -> Wiring:
    """Reads the file that `tricoil calibrate wiring --out` wrote. Raises ValueError with file and line, and OSError if a disk fails."""
    sensor, source = _tricoil.read_wiring(os.fspath(path))
    return Wiring(tuple(sensor), tuple(source))


def wiring_of(value: Wiring | str | os.PathLike | None) -> Wiring:
    """Wiring, or that of a file; None: straight."""
    return Wiring() if value is None else value if isinstance(value, Wiring) else read_wiring(value)
