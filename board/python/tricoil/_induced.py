"""Couplings of virtual dipoles, metal at rest, and their derivatives: core/field/induced_dipole.hpp."""

import numpy as np
from numpy.typing import NDArray

LENGTH_M = 0.1  # unit of a dipole's position among the unknowns
POLARISABILITY_M3 = 1e-3  # unit of its polarisability: xx, yy, zz, xy, xz, yz
NUMBERS = 9  # of a dipole


def _norm(v):
    return np.linalg.norm(v, axis=-1, keepdims=True)


def _dot(a, b):
    return np.sum(a * b, axis=-1, keepdims=True)


def field(r_m: NDArray, moment: NDArray) -> NDArray:
    """B (..., 3) of (4) at a displacement from a moment."""
    distance = _norm(r_m)
    u = r_m / distance
    return (3 * _dot(u, moment) * u - moment) / (2 * distance**3)


def gradient(r_m: NDArray, moment: NDArray, sensitivity: NDArray) -> NDArray:
    """Of sensitivity.B by the displacement, (..., 3)."""
    distance = _norm(r_m)
    u = r_m / distance
    um, un = _dot(u, moment), _dot(u, sensitivity)
    return 3 / (2 * distance**4) * (um * sensitivity + un * moment + (_dot(moment, sensitivity) - 5 * um * un) * u)


def symmetric(six: NDArray) -> NDArray:
    """Matrices (..., 3, 3) of xx, yy, zz, xy, xz, yz (..., 6)."""
    return np.asarray(six)[..., [[0, 3, 4], [3, 1, 5], [4, 5, 2]]]


def rows_of(dipoles: NDArray) -> NDArray:
    """Position (m) and polarisability (m^3, row by row), (D, 12), of the unknowns (D, 9)."""
    return np.hstack((LENGTH_M * dipoles[:, :3], POLARISABILITY_M3 * symmetric(dipoles[:, 3:]).reshape(-1, 9)))


class Coils:
    """Coils without finite sizes. numbers: (4, 3, 3), source offsets and moments, sensor offsets and sensitivities; columns are coils."""

    def __init__(self, numbers: NDArray):
        self.source_offset_m, self.source_moment, self.sensor_offset_m, self.sensitivity = np.swapaxes(numbers, 1, 2)

    def fields(self, dipole_m: NDArray, position_m: NDArray, attitude: NDArray):
        """At dipoles (P, 3): fields (P, 3, 3) of the source coils, and by reciprocity (P, N, 3, 3) of the sensor coils at poses (N) as sources; vectors from
        the source coils to the dipoles and from these to the sensor coils, and the sensitivities (N, 3, 3)."""
        n = self.sensitivity @ np.swapaxes(attitude, 1, 2)
        r = position_m[:, None] + self.sensor_offset_m @ np.swapaxes(attitude, 1, 2) - dipole_m[:, None, None]
        from_coil = dipole_m[:, None] - self.source_offset_m
        return field(from_coil, self.source_moment), field(r, n), from_coil, r, n

    def by_polarisability(self, dipole_m: NDArray, position_m: NDArray, attitude: NDArray) -> NDArray:
        """Derivatives (P, N, 9, 6) of the couplings, in column order."""
        f, b, *_ = self.fields(dipole_m, position_m, attitude)
        return _by_polarisability(f, b)

    def derivatives(self, dipoles: NDArray, position_m: NDArray, attitude: NDArray) -> NDArray:
        """Of the couplings in column order by the unknowns of dipoles (D, 9): (N, 9, 9 D)."""
        a = POLARISABILITY_M3 * symmetric(dipoles[:, 3:])
        f, b, from_coil, r, n = self.fields(LENGTH_M * dipoles[:, :3], position_m, attitude)
        # X = 2 b.A f, by the place of the dipole in the fields of the source and of the sensor.
        of_source = gradient(from_coil[:, None, :, None], self.source_moment[:, None], (2 * b @ a[:, None])[:, :, None])
        of_sensor = gradient(r[:, :, None], (2 * f @ a)[:, None, :, None], n[:, None])
        by_place = LENGTH_M * (of_source - of_sensor).reshape(len(dipoles), len(position_m), 9, 3)
        return np.concatenate((by_place, _by_polarisability(f, b)), axis=3).transpose(1, 2, 0, 3).reshape(len(position_m), 9, dipoles.size)


def _by_polarisability(f, b):
    (fx, fy, fz), (bx, by, bz) = np.moveaxis(f[:, None, :, None], -1, 0), np.moveaxis(b[:, :, None], -1, 0)
    products = np.stack((bx * fx, by * fy, bz * fz, bx * fy + by * fx, bx * fz + bz * fx, by * fz + bz * fy), axis=-1)
    return (2 * POLARISABILITY_M3 * products).reshape(*products.shape[:2], 9, 6)
