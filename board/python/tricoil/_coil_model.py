"""Couplings of three source and three sensor coils, each with its own position, direction and strength: the point dipoles of core/field/general_dipole.hpp.

Nine couplings are in one row, source coil by source coil: entry 3 j + i is that of source coil j to sensor coil i.
"""

import dataclasses
import functools

import numpy as np
from numpy.typing import NDArray


_NEXT, _LAST = np.array([1, 2, 0]), np.array([2, 0, 1])


def _cross(a, b):
    """np.cross() of few vectors in a fifth of its time, (..., 3)."""
    return a.take(_NEXT, -1) * b.take(_LAST, -1) - a.take(_LAST, -1) * b.take(_NEXT, -1)


@dataclasses.dataclass(frozen=True)
class Coils:
    """Rows are coils. source_m, sensor_m: positions (3, 3) in the source and the sensor frame, m. moment (3, 3): m_j, source frame, coupling units times
    m^3. sensitivity (3, 3): n_i, sensor frame, no unit."""

    source_m: NDArray
    moment: NDArray
    sensor_m: NDArray
    sensitivity: NDArray

    def couplings(self, position_m: NDArray, turn: NDArray) -> tuple[NDArray, NDArray]:
        """Couplings (N, 9) and their Jacobian (N, 9, 6) by position (m) and small rotation (rad), both in the source frame.

        position_m (N, 3): origin of the sensor frame in the source frame. turn (N, 3, 3): sensor components to source components, changed by a small
        rotation w to exp([w]x) turn. With r from source to sensor coil and u = r / |r|, the coupling is n . B, B = (3 (u.m) u - m) / (2 |r|^3), as in
        equation (4) of the paper; its gradient is 3 / (2 |r|^4) ((u.m) n + (u.n) m + (m.n - 5 (u.m) (u.n)) u).
        """
        arm = self.sensor_m @ turn.swapaxes(1, 2)  # (N, i, 3)
        n = self.sensitivity @ turn.swapaxes(1, 2)
        r = position_m[:, None, None] - self.source_m[:, None] + arm[:, None]  # (N, j, i, 3)
        length = np.sqrt(np.einsum("njia,njia->nji", r, r))
        u = r / length[..., None]
        um = np.einsum("njia,ja->nji", u, self.moment)
        un = np.einsum("njia,nia->nji", u, n)
        mn = self.moment @ n.swapaxes(1, 2)
        half = 0.5 / length**3
        field = half[..., None] * (3 * um[..., None] * u - self.moment[:, None])
        across = um[..., None] * n[:, None] + un[..., None] * self.moment[:, None] + (mn - 5 * um * un)[..., None] * u
        jacobian = np.empty((*length.shape, 6))
        jacobian[..., :3] = (3 * half / length)[..., None] * across
        jacobian[..., 3:] = _cross(arm[:, None], jacobian[..., :3]) + _cross(n[:, None], field)  # w x arm moves the coil, w x n turns it
        return (half * (3 * um * un - mn)).reshape(-1, 9), jacobian.reshape(-1, 9, 6)

    @functools.cached_property
    def centres_m(self) -> tuple[NDArray, NDArray]:
        """Mean positions (3) of the source and the sensor coils."""
        return self.source_m.mean(axis=0), self.sensor_m.mean(axis=0)

    @functools.cached_property
    def centred(self) -> "Coils":
        """The coils in frames whose origins are their centres."""
        source, sensor = self.centres_m
        return dataclasses.replace(self, source_m=self.source_m - source, sensor_m=self.sensor_m - sensor)


def unit_covariance(jacobian: NDArray, range_m: float) -> NDArray | None:
    """Covariance (6, 6) of position (m) and small rotation (rad) for unit noise of each coupling. jacobian (9, 6) as of couplings(). None if the couplings
    do not determine a pose. Computed with lengths relative to the range, for better conditioning."""
    units = np.repeat((range_m, 1.0), 3)
    scaled = jacobian * units
    information = scaled.T @ scaled
    try:
        np.linalg.cholesky(information)
        covariance = np.linalg.inv(information) * np.outer(units, units)
    except np.linalg.LinAlgError:
        return None
    return covariance if covariance[0, 0] > 0 else None
