#!/usr/bin/env python3
"""Prints finite_cylinder_table.inc: moments of finite cylinders in a uniform field (Debian package python3-scipy).

Independent of sim/world/metal: the exact integral equation for the charge on the whole surface, end faces included,
sigma (mu + 1) / (2 (mu - 1)) - K' sigma = n H, in azimuthal order 0 (field along the axis) and 1 (across). Permeability 0 is a
perfect conductor. Panels of Gauss points grow geometrically from the edges; panels near a point are integrated in finer parts.
  finite_cylinder_table.py > finite_cylinder_table.inc
  finite_cylinder_table.py --check    prints errors for a sphere and a spheroid, and the change with half as many points
"""
import sys

import numpy as np
from numpy.polynomial.legendre import leggauss
from scipy.special import ellipe, ellipkm1


def kernel(order, rho, z, n_rho, n_z, s_rho, s_z):
    """n grad 1/(4 pi R) of a ring with density cos(order phi), seen at azimuth 0; times the ring's radius; sign of an outward field."""
    dz = z - s_z
    near = (rho - s_rho) ** 2 + dz**2  # A - B
    far = (rho + s_rho) ** 2 + dz**2  # A + B
    a, b = (near + far) / 2, 2 * rho * s_rho
    p = near / far  # 1 - m
    e, k = ellipe(1 - p), ellipkm1(p)
    root = np.sqrt(far)
    i0, j0, h0 = 4 * e / (near * root), 4 * k / root, 4 * root * e
    i1 = (a * i0 - j0) / b
    if order == 0:
        value = (n_rho * rho + n_z * dz) * i0 - n_rho * s_rho * i1
    else:
        i2 = (a * a * i0 - 2 * a * j0 + h0) / b**2
        value = (n_rho * rho + n_z * dz) * i1 - n_rho * s_rho * i2
    return value * s_rho / (4 * np.pi)


class Line:
    """A straight part of the generating curve, in panels."""

    def __init__(self, start, end, normal, edges):
        self.start, self.end, self.normal, self.edges = map(np.asarray, (start, end, normal, edges))

    def at(self, t):
        point = self.start + t[..., None] * (self.end - self.start)
        return point, np.broadcast_to(self.normal, point.shape), np.full(t.shape, np.hypot(*(self.end - self.start)))


class Arc:
    """Generating curve of a spheroid with half-axes a (across) and c (along); t from 0 to 1."""

    def __init__(self, a, c, edges):
        self.a, self.c, self.edges = a, c, edges

    def at(self, t):
        th = np.pi * t
        point = np.stack((self.a * np.sin(th), self.c * np.cos(th)), -1)
        normal = np.stack((self.c * np.sin(th), self.a * np.cos(th)), -1)
        length = np.linalg.norm(normal, axis=-1)
        return point, normal / length[..., None], np.pi * length


def graded(levels, middle, both):
    """Panel edges on 0..1, halved repeatedly towards 1 (and 0), with `middle` equal panels between."""
    towards = 1 - 0.25 * 0.5 ** np.arange(levels + 1)
    low = 1 - towards[::-1] if both else np.array([0.0])
    edges = [[0], low, np.linspace(low[-1], 0.75, middle + 1), towards, [1]]
    return np.unique(np.round(np.concatenate(edges), 14))


def moments(parts, order, permeabilities, points):
    """Moments per unit field along z (order 0) or across (order 1), one for each permeability."""
    x, w = leggauss(points)
    panels = [(part, lo, hi) for part in parts for lo, hi in zip(part.edges[:-1], part.edges[1:])]
    nodes = np.array([(lo + hi) / 2 + (hi - lo) / 2 * x for _, lo, hi in panels])
    place = [part.at(t) for (part, _, _), t in zip(panels, nodes)]
    position = np.concatenate([p for p, _, _ in place])
    normal = np.concatenate([n for _, n, _ in place])
    weight = np.concatenate([(hi - lo) / 2 * w * s for (_, lo, hi), (_, _, s) in zip(panels, place)])
    barycentric = np.array([1 / np.prod(x[i] - np.delete(x, i)) for i in range(points)])

    def lagrange(u):
        d = u[:, None] - x
        d[d == 0] = 1e-300
        terms = barycentric / d
        return terms / terms.sum(axis=1, keepdims=True)

    total = len(position)
    matrix = np.empty((total, total))
    for p, (part, lo, hi) in enumerate(panels):
        columns = slice(p * points, (p + 1) * points)
        s = position[columns]
        size = weight[columns].sum()
        matrix[:, columns] = weight[columns] * kernel(
            order, position[:, :1], position[:, 1:], normal[:, :1], normal[:, 1:], s[:, 0], s[:, 1])
        distance = np.min(np.linalg.norm(position[:, None] - s, axis=2), axis=1)
        for i in np.nonzero(distance < 2 * size)[0]:
            closest = nodes[p][np.argmin(np.linalg.norm(s - position[i], axis=1))]
            same = columns.start <= i < columns.stop
            if not same:
                fine = np.linspace(lo, hi, 400)
                closest = fine[np.argmin(np.linalg.norm(part.at(fine)[0] - position[i], axis=1))]
            u = (2 * closest - lo - hi) / (hi - lo)
            steps = 0.5 ** np.arange(24 if same else 16)
            cuts = np.unique(np.concatenate(([u], u + (1 - u) * steps, u - (1 + u) * steps)))
            cuts = cuts[np.concatenate(([True], np.diff(cuts) > 1e-12))]
            half = np.diff(cuts) / 2
            fine = ((cuts[:-1] + cuts[1:]) / 2)[:, None] + half[:, None] * x
            q, _, speed = part.at((lo + hi) / 2 + (hi - lo) / 2 * fine.ravel())
            values = kernel(order, position[i, 0], position[i, 1], normal[i, 0], normal[i, 1], q[:, 0], q[:, 1])
            values = values * speed * (hi - lo) / 2 * (half[:, None] * w).ravel()
            matrix[i, columns] = values @ lagrange(fine.ravel())
    rho, z = position.T
    arm = weight * (2 * np.pi * rho * z if order == 0 else np.pi * rho**2)
    values = []
    for mu in permeabilities:
        own = 0.5 if np.isinf(mu) else (mu + 1) / (2 * (mu - 1))
        values.append(arm @ np.linalg.solve(own * np.eye(total) - matrix, normal[:, 1 - order]))
    return values


def cylinder(aspect, levels):
    """Cylinder of diameter 1: end faces and side."""
    half = aspect / 2
    face = graded(levels, 2, False)
    side = graded(levels + int(np.log2(aspect)), max(4, int(aspect / 2)), True)
    return [Line((0, half), (0.5, half), (0, 1), face), Line((0.5, half), (0.5, -half), (1, 0), side),
            Line((0.5, -half), (0, -half), (0, -1), 1 - face[::-1])]


def demagnetisation(c):
    """Demagnetising factor along the axis of a prolate spheroid with length / diameter c."""
    e = np.sqrt(1 - 1 / c**2)
    return (1 - e * e) / e**3 * (np.arctanh(e) - e)


PERMEABILITIES = (0, 5, 240, np.inf)


def check():
    for c, edges in ((1.0001, np.linspace(0, 1, 9)), (8, np.linspace(0, 1, 33))):
        volume, along = 4 / 3 * np.pi * c, demagnetisation(c)
        for order, factor in ((0, along), (1, (1 - along) / 2)):
            for mu, value in zip(PERMEABILITIES, moments([Arc(1, c, edges)], order, PERMEABILITIES, 12)):
                exact = volume / (factor + (0 if np.isinf(mu) else 1 / (mu - 1)))
                print(f"spheroid {c} mu {mu} order {order}: {value / exact - 1:.1e}", flush=True)
    for aspect in (1, 8):
        for order in (0, 1):
            coarse, fine = (moments(cylinder(aspect, levels), order, PERMEABILITIES, points) for levels, points in ((6, 5), (10, 8)))
            for mu, a, b in zip(PERMEABILITIES, coarse, fine):
                print(f"cylinder {aspect} mu {mu} order {order}: fewer points change it by {a / b - 1:.1e}", flush=True)


if sys.argv[1:] == ["--check"]:
    check()
    sys.exit()
print("// Made by finite_cylinder_table.py: length / diameter, relative permeability (0: perfect conductor, 1e6: infinite), moment per")
print("// field and volume along and across the axis.")
for aspect in (4, 8, 12.65, 60):
    volume = np.pi / 4 * aspect
    along, across = (moments(cylinder(aspect, 10), order, PERMEABILITIES, 8) for order in (0, 1))
    for mu, a, b in zip(PERMEABILITIES, along, across):
        print(f"{{{aspect}, {'1e6' if np.isinf(mu) else mu}, {a / volume:.6g}, {b / volume:.6g}}},", flush=True)
