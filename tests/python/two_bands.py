"""Couplings in two bands of a moving sensor near a moving conducting sphere: tests/support/two_bands.hpp, on arrays."""

import dataclasses

import numpy as np
from scipy.spatial.transform import Rotation
from tricoil._coil_model import Coils
from tricoil._rotation import wxyz

COUPLING = 6.75e-3  # m^3, as in the simulation
HIGH_HZ, LOW_HZ = 10500, 300
HIGH_NOISE, LOW_NOISE = 3e-6, 1e-5  # relative to the norm of the couplings
LOW_MOMENT = 0.03  # of the low band relative to the high band


@dataclasses.dataclass(frozen=True)
class Sphere:
    radius_m: float
    conductivity_s_m: float
    relative_permeability: float

    def polarisability(self, frequency_hz):
        """Magnetic polarisability over 4 pi, m^3: moment = 4 pi alpha H (Wait 1951)."""
        mu = self.relative_permeability
        z = self.radius_m * np.sqrt(2j * np.pi * frequency_hz * 4e-7 * np.pi * mu * self.conductivity_s_m)
        t = z / np.tanh(z)
        return self.radius_m**3 / 2 * (2 * mu * (t - 1) - (z * z + 1 - t)) / (mu * (t - 1) + (z * z + 1 - t))


STEEL_304 = Sphere(0.02, 1.39e6, 1.02)
TITANIUM = Sphere(0.03, 5.85e5, 1)
ALUMINIUM = Sphere(0.03, 3.77e7, 1)


@dataclasses.dataclass(frozen=True)
class Scene:
    seed: int = 1
    rate_hz: float = 1500
    ratio: int = 32  # high-band lines for each low-band line
    duration_s: float = 12
    metal_from_s: float = 3
    sphere: Sphere = STEEL_304
    sensor_moves: bool = True


@dataclasses.dataclass
class Data:
    """high (N, 9), low (lines, 9): couplings; line k of low is the mean over the 2 * ratio high-band lines before line k * ratio. share: effect of the sphere in
    the low band relative to the high band."""

    high_coils: Coils
    low_coils: Coils
    high: np.ndarray
    low: np.ndarray
    position_m: np.ndarray
    turn: Rotation
    share: float


def coils(moment=1.0):
    source_m = np.array([[0.045, 0, -0.044], [0, 0.045, -0.043], [0, 0, 0]])
    return Coils(source_m, moment * np.eye(3), np.zeros((3, 3)), np.eye(3))


def _smooth_path(random, amplitude, least_hz, most_hz, time_s):
    """Each component is the sum of two sines with random phases and frequencies."""
    hz, phase = random.uniform(least_hz, most_hz, 6), random.uniform(0, 2 * np.pi, 6)
    sines = np.sin(2 * np.pi * hz * time_s[:, None] + phase)
    return amplitude * (sines[:, :3] + sines[:, 3:] / 1.5)


def _away(points, origin, least_m):
    d = points - origin
    length = np.linalg.norm(d, axis=1, keepdims=True)
    return np.where(length < least_m, origin + d / length * least_m, points)


def _dipole(r):
    length = np.linalg.norm(r, axis=-1)[..., None, None]
    u = r[..., None] / length
    return (3 * u * u.swapaxes(-1, -2) - np.eye(3)) / length**3


def _through_sphere(model, position_m, turn, centre):
    """Couplings through a sphere of unit polarisability."""
    fields = np.einsum("njab,jb->nja", _dipole(centre[:, None] - model.source_m), model.moment) / 2
    sensors = position_m[:, None] + model.sensor_m @ turn.swapaxes(1, 2)
    return np.einsum("nia,niab,njb->nji", model.sensitivity @ turn.swapaxes(1, 2), _dipole(sensors - centre[:, None]), fields).reshape(-1, 9)


def two_bands(scene):
    random = np.random.default_rng(scene.seed)
    high_coils, low_coils = coils(), coils(LOW_MOMENT)
    effect = scene.sphere.polarisability(HIGH_HZ).real
    share = scene.sphere.polarisability(LOW_HZ).real / effect
    time_s = np.arange(int(scene.duration_s * scene.rate_hz)) / scene.rate_hz
    moves = 1 if scene.sensor_moves else 0
    position_m = np.array([0.3, 0.1, 0.08]) + _smooth_path(random, moves * 0.05, 0.2, 1.1, time_s)
    turn = Rotation.from_rotvec(_smooth_path(random, moves * 0.25, 0.2, 1.1, time_s)) * Rotation.from_rotvec([0.3, -0.5, 0.7])
    centre = np.array([0.22, -0.1, 0.1]) + _smooth_path(random, 0.06, 0.15, 0.45, time_s)
    centre = _away(_away(centre, 0, scene.sphere.radius_m + 0.08), position_m, scene.sphere.radius_m + 0.05)
    arrives = 1 / (1 + np.exp(-(time_s - scene.metal_from_s) / 0.15))
    clean, _ = high_coils.couplings(position_m, turn.as_matrix())
    metal = arrives[:, None] * effect * _through_sphere(high_coils, position_m, turn.as_matrix(), centre)

    def noisy(x, share):
        return x + share * np.linalg.norm(x, axis=1, keepdims=True) * random.normal(size=x.shape)

    sums = np.concatenate((np.zeros((1, 9)), np.cumsum(LOW_MOMENT * (clean + share * metal), axis=0)))
    ends = np.arange(0, len(time_s), scene.ratio)
    begins = np.maximum(ends - 2 * scene.ratio, 0)
    low = (sums[ends] - sums[begins]) / np.maximum(ends - begins, 1)[:, None]
    low[0] = sums[1]
    return Data(high_coils, low_coils, noisy(clean, HIGH_NOISE) + metal, noisy(low, LOW_NOISE), position_m, turn, share)


def calibration(data):
    """As `tricoil couplings` reads it: the files' field has no factor 1/2 and is divided by 250."""
    return {name: {"source_pos": one.source_m.tolist(), "source_moment": (125 * one.moment).tolist(), "sensor_pos": one.sensor_m.tolist(),
                   "sensor_moment": one.sensitivity.tolist()} for name, one in (("high", data.high_coils), ("low", data.low_coils))}


def truth_wxyz(data):
    return wxyz(data.turn)
