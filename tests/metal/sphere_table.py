#!/usr/bin/env python3
"""Prints sphere_table.inc: the response of conducting spheres, evaluated with 40 digits (Debian package python3-mpmath).

Independent of sim/world/metal: Bessel functions and their derivatives from mpmath, couplings by numerical differentiation of the
potential's series.
  sphere_table.py > sphere_table.inc
"""
import mpmath as mp

mp.mp.dps = 40
MU0 = 4 * mp.pi * mp.mpf("1e-7")


def radial(n, z):
    """Modified spherical Bessel function of the first kind, without its constant factor."""
    return mp.besseli(n + mp.mpf(1) / 2, z) / mp.sqrt(z)


def coefficient(n, a, sigma, mu_r, hz):
    """A of r^n -> r^n + A a^(2n+1) r^(-n-1): radial B and tangential H are continuous at r = a."""
    k = mp.sqrt(mp.mpc(0, 2 * mp.pi * hz * MU0 * mu_r * sigma))
    f = 1  # at r = a
    slope = mp.diff(lambda r: r * radial(n, k * r), a) / radial(n, k * a)  # d(r f)/dr
    # Inside: B_r = c n (n+1) f / r, B_t = c (r f)' / r. Outside, potential -psi: B_r = -n + (n+1) A, H_t = -(1 + A), for a = 1.
    # Two equations for c and A, in units of the radius.
    matrix = mp.matrix([[n * (n + 1) * f, -(n + 1)], [slope / mu_r, 1]])
    right = mp.matrix([-n, -1])
    return mp.lu_solve(matrix, right)[1]


def couplings(a, sigma, mu_r, hz, source, sensor, orders=36):
    """Field at the sensor per unit dipole at the source: -grad grad of sum A a^(2n+1) / (d s)^(n+1) P_n(cos)."""
    constants = [coefficient(n, a, sigma, mu_r, hz) for n in range(1, orders)]

    def potential(*x):
        l, s = mp.matrix(x[:3]), mp.matrix(x[3:])
        d, r = mp.norm(l), mp.norm(s)
        cosine = sum(l[i] * s[i] for i in range(3)) / (d * r)
        return mp.fsum(c * a ** (2 * n + 1) / (d * r) ** (n + 1) * mp.legendre(n, cosine) for n, c in enumerate(constants, 1))

    rows = []
    for i in range(3):
        for j in range(3):
            order = [0] * 6
            order[j] += 1
            order[3 + i] += 1
            rows.append(-mp.diff(potential, tuple(source + sensor), tuple(order), h=mp.mpf("1e-8")))
    return rows


def number(x):
    return mp.nstr(x, 17, min_fixed=1, max_fixed=0)


METALS = [(5.96e7, 1), (3.77e7, 1), (5.85e5, 1), (1.39e6, 1.02), (1.75e6, 800), (6.29e6, 240), (1e3, 1), (1.0, 1.5)]

print("// Made by sphere_table.py: order, radius, conductivity, relative permeability, frequency, real and imaginary part of A.")
for sigma, mu_r in METALS:
    for a in (0.0025, 0.02, 0.08):
        for hz in (300, 1000, 10500):
            for n in (1, 2, 7):
                value = coefficient(n, mp.mpf(a), mp.mpf(sigma), mp.mpf(mu_r), mp.mpf(hz))
                print(f"COEFFICIENT({n}, {a}, {sigma:g}, {mu_r}, {hz}, {number(value.real)}, {number(value.imag)})")
print("// Couplings of a sphere of 40 mm near source and sensor: conductivity, permeability, frequency, source, sensor, nine values.")
for sigma, mu_r, hz in ((3.77e7, 1, 10500), (1.39e6, 1.02, 1000), (6.29e6, 240, 300)):
    source = [mp.mpf(x) for x in ("-0.07", "0.01", "0.02")]
    sensor = [mp.mpf(x) for x in ("0.03", "0.06", "-0.05")]
    values = couplings(mp.mpf("0.04"), mp.mpf(sigma), mp.mpf(mu_r), mp.mpf(hz), source, sensor)
    parts = ", ".join(f"{{{number(mp.re(v))}, {number(mp.im(v))}}}" for v in values)
    print(f"COUPLINGS({sigma:g}, {mu_r}, {hz}, {parts})")
