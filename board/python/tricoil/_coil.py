"""Round coils of copper wire: resistance, inductance, thermal noise."""

import functools
import math

import numpy as np

MU_0 = 4e-7 * math.pi  # V s / (A m)
RESISTIVITY = 1.72e-8  # copper at 20 degC, ohm m
KT = 1.380649e-23 * 293.15  # J


def ellipk(m):
    """Complete elliptic integrals K and E of the parameter m = k^2, by the arithmetic-geometric mean (Abramowitz and Stegun 17.6)."""
    a, b, c = np.ones_like(m), np.sqrt(1 - m), np.sqrt(m)
    share = c**2 / 2
    for n in range(40):
        a, b, c = (a + b) / 2, np.sqrt(a * b), (a - b) / 2
        share = share + 2.0**n * c**2
        if np.max(c, initial=0) < 1e-16:
            break
    k = math.pi / (2 * a)
    return k, k * (1 - share)


def mutual_h(a_m, b_m, apart_m):
    """Mutual inductance of two coaxial circles of radii a and b, H (Maxwell, Treatise, article 701). Arrays broadcast."""
    m = 4 * a_m * b_m / ((a_m + b_m) ** 2 + apart_m**2)
    big_k, big_e = ellipk(m)
    return MU_0 * np.sqrt(a_m * b_m / m) * ((2 - m) * big_k - 2 * big_e)


def winding(turns: int, radius_m: float, wire_m: float):
    """Turns of a winding of square section about the mean radius, as layers of (radius, turns). The wires touch."""
    layers = max(1, round(math.sqrt(turns)))
    counts = [turns // layers + (n < turns % layers) for n in range(layers)]
    radii = radius_m + wire_m * (np.arange(layers) - (layers - 1) / 2)
    if radii[0] - wire_m / 2 <= 0:
        raise ValueError(f"{turns} turns of {wire_m:g} m wire do not fit on a mean radius of {radius_m:g} m; use a thinner wire, fewer turns or a larger radius")
    return list(zip(radii.tolist(), counts))


@functools.lru_cache
def _pairs(count, others):
    """Pairs of turns of two layers, by the number of turns between them."""
    return np.bincount(np.abs(np.subtract.outer(np.arange(count), np.arange(others))).ravel())


def inductance_h(turns: int, radius_m: float, wire_m: float) -> float:
    """Sum of the mutual inductances of all turns; each turn itself is a ring of wire with uniform current, mu0 a (ln(8 a / r) - 7/4)."""
    layers = winding(turns, radius_m, wire_m)
    total = sum(count * MU_0 * a * (math.log(16 * a / wire_m) - 1.75) for a, count in layers)
    for n, (a, count) in enumerate(layers):
        for b, others in layers[n:]:
            first = 1 if a == b else 0  # a turn with itself is above
            pairs = _pairs(count, others)[first:]
            both = 1 if a == b else 2  # pairs of one layer are counted twice already
            total += both * float(np.sum(pairs * mutual_h(a, b, wire_m * np.arange(first, first + len(pairs)))))
    return total


def resistance_ohm(turns: int, radius_m: float, wire_m: float) -> float:
    """Direct-current resistance; at 10 kHz thick wire has more."""
    return RESISTIVITY * turns * 2 * math.pi * radius_m / (math.pi * wire_m**2 / 4)


def thermal_noise(ohm: float) -> float:
    """Noise density of a resistance at 20 degC, V per root Hz: sqrt(4 k T R) (Johnson, Nyquist 1928)."""
    return math.sqrt(4 * KT * ohm)
