#!/usr/bin/env python3
"""Prints cylinder_table.inc: response of long rods and tubes, evaluated with 40 digits (Debian package python3-mpmath).

Independent of sim/world/metal: the boundary conditions are solved with Bessel functions of both kinds from series and integrals.
  cylinder_table.py > cylinder_table.inc
"""
import mpmath as mp

mp.mp.dps = 40
MU0 = 4 * mp.pi * mp.mpf("1e-7")


def first_kind(m, z):
    """I_m(z) by its power series."""
    term = (z / 2) ** m
    total, j = term, 0
    while abs(term) > mp.mpf(10) ** -50 * abs(total):
        j += 1
        term *= (z / 2) ** 2 / (j * (j + m))
        total += term
    return total


def second_kind(m, z):
    """exp(z) K_m(z) by its integral representation."""
    return mp.quad(lambda t: mp.exp(-z * (mp.cosh(t) - 1)) * mp.cosh(m * t), mp.linspace(0, mp.acosh(1 + 90 / mp.re(z)), 5))


def response(outer, inner, sigma, mu_r, hz):
    """Across: outside A_z = (r + across b^2 / r) sin(phi). Along: flux = mu0 pi b^2 (1 + along) H."""
    k = mp.sqrt(mp.mpc(0, 2 * mp.pi * hz * MU0 * mu_r * sigma))

    def bessel(m, r):
        """I_m, its derivative by r, K_m, its derivative by r."""
        z = k * r
        i0, i1 = first_kind(0, z), first_kind(1, z)
        k0, k1 = (second_kind(m, z) * mp.exp(-z) for m in (0, 1)) if inner else (0, 0)
        return (i0, k * i1, k0, -k * k1) if m == 0 else (i1, k * (i0 - i1 / z), k1, -k * (k0 + k1 / z))

    def slope(m, ratio):
        """Logarithmic derivative f'/f at the outer radius; f' = ratio f at the inner radius, None: solid."""
        g = 0
        if ratio is not None:
            i, i_slope, second, second_slope = bessel(m, inner)
            g = -(i_slope - ratio * i) / (second_slope - ratio * second)
        i, i_slope, second, second_slope = bessel(m, outer)
        return (i_slope + g * second_slope) / (i + g * second)

    solid = inner == 0
    q = outer * slope(1, None if solid else mp.mpf(mu_r) / inner)
    w = slope(0, None if solid else k * k * inner / (2 * mu_r))
    return (mu_r - q) / (mu_r + q), 2 * mu_r * w / (k * k * outer) - 1


def number(x):
    return mp.nstr(x, 15, min_fixed=1, max_fixed=0)


THICK = [  # diameter, wall, conductivity, permeability, frequency: thick walls of magnetic metal
    ("0.0127", "0.0057", 1.75e6, 800, 250),
    ("0.006", "0.0028", 1.75e6, 800, 1000),
    ("0.0127", "0.0013", 1.6e6, 20000, 250),
    ("0.01", "0.001", 1e6, 10000, 1000),
]
METALS = [(5.96e7, 1), (3.77e7, 1), (5.85e5, 1), (1.39e6, 1.02), (1.75e6, 800), (6.29e6, 240)]
print("// Made by cylinder_table.py: diameter, wall (0: solid), conductivity, relative permeability, frequency, across, along.")
ROWS = [
    (outer, wall, sigma, mu_r, hz)
    for sigma, mu_r in METALS
    for outer, wall in (("0.0079", "0"), ("0.0127", "0.0013"), ("0.05", "0.001"))
    for hz in (326, 10500)
]
for outer, wall, sigma, mu_r, hz in ROWS + THICK:
    b = mp.mpf(outer) / 2
    c = b - mp.mpf(wall) if wall != "0" else 0
    a, l = response(b, c, mp.mpf(sigma), mp.mpf(mu_r), mp.mpf(hz))
    parts = ", ".join(number(x) for x in (a.real, a.imag, l.real, l.imag))
    print(f"{{{outer}, {wall}, {sigma:g}, {mu_r}, {hz}, {parts}}},")
