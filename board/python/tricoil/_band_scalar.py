"""The scalar that extrapolates couplings of two bands to zero metal."""

import math

import numpy as np
from numpy.typing import NDArray

PRIOR_SIGMA = 1.0
LEAST, MOST = -0.2, 5.0  # MOST: share 0.83; beyond this the bands are too similar to extrapolate
CLEAR = 100
SEEN = 4


class _Running:
    """Variance of the residuals. A residual far above it gets less weight."""

    def __init__(self):
        self.noise = 0.0

    def used(self, size, min_variance):
        used = max(self.noise, size / 2, min_variance)
        self.noise += 0.2 * (size - self.noise)
        return used


class BandScalar:
    """Couplings without metal = low - scalar (high - low). The scalar is share / (1 - share), where share is the effect of the metal in the low band relative
    to the high band.

    Two sources. If the sensor rests, the low band's pose moves by scalar times the disagreement of the bands. If it moves, only the three redundant
    directions of the couplings do not depend on motion: there the low band changes by share times the high band. Each source is weighted by the noise of
    its own residuals, so motion makes the first one weak by itself."""

    def __init__(self, fixed: float | None = None):
        self._is_fixed = fixed is not None
        self.value = fixed if self._is_fixed else 0.0
        self._variance = 0.0 if self._is_fixed else PRIOR_SIGMA**2
        self._pose, self._redundant = _Running(), _Running()

    @property
    def sigma(self) -> float:
        return math.sqrt(self._variance)

    @property
    def share(self) -> float:
        return self.value / (1 + self.value)

    def add_poses(self, low: NDArray, disagreement: NDArray, variance: float) -> None:
        """Change of the low band's position (3), m, and of the bands' disagreement, high - low, from one line to the next. variance: of the low band's
        position per axis. A disagreement within its noise is ignored, because both arguments contain the noise of the low band."""
        if not self._is_fixed and disagreement @ disagreement > CLEAR * variance:
            self._correct(low - self.value * disagreement, disagreement, variance, self._pose)

    def add_redundant(self, low: NDArray, high: NDArray, variance: float, misfit: float) -> None:
        """Changes of the redundant part of the couplings, both in units of the low band. variance: of one low coupling; changes within it are ignored,
        because slow drift is equal in both bands. misfit: variance by which motion changes the misfit of the calibration, also equal in both bands."""
        slope = 1 / (1 + self.value) ** 2  # d share / d scalar
        if not self._is_fixed and high @ high > SEEN * variance:
            self._correct(low - self.share * high, slope * high, variance + misfit, self._redundant)

    def _correct(self, residual, slope, min_variance, running):
        size, steepness = float(residual @ residual) / 3, float(slope @ slope)
        if not math.isfinite(size) or not math.isfinite(steepness):  # the bias diverged
            return
        used = running.used(size, min_variance)
        information = steepness / used
        self._variance /= 1 + self._variance * information
        self.value = float(np.clip(self.value + self._variance * float(slope @ residual) / used, LEAST, MOST))
