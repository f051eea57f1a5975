"""Inductance, loss and self-capacitance of the coils of winding.py.

L is the sum of the mutual inductances of all turns: coaxial circles by Maxwell's formula with complete elliptic integrals (Grover 1946,
"Inductance calculations", chapter 11), other outlines by Neumann's integral. The inductance of a turn is that of two turns at the
geometric mean distance of the wire's cross-section from itself, exp(-1/4) of its radius (Grover, chapter 2). Independent of this:
Wheeler's formula for multilayer coils (Proc. IRE 16, 1928, p. 1398)."""
import math

from winding import COPPER_OHM_MM

MU0 = 4e-7 * math.pi
EPSILON0 = 8.854e-12


def elliptic(m):
    """Complete elliptic integrals K and E of the parameter m = k^2, by the arithmetic-geometric mean."""
    a, b, total, power = 1.0, math.sqrt(1 - m), m, 1.0
    while abs(a - b) > 1e-15 * a:
        c = 0.5 * (a - b)
        a, b = 0.5 * (a + b), math.sqrt(a * b)
        total += 2 * power * c * c
        power *= 2
    k = math.pi / (2 * a)
    return k, k * (1 - 0.5 * total)


def of_circles(a, b, distance):
    """Mutual inductance of two coaxial circles; lengths in m."""
    m = 4 * a * b / ((a + b)**2 + distance**2)
    k, e = elliptic(m)
    return MU0 * math.sqrt(a * b / m) * ((2 - m) * k - 2 * e)


NODES = ((0.0694318442, 0.1739274226), (0.3300094782, 0.3260725774), (0.6699905218, 0.3260725774), (0.9305681558, 0.1739274226))  # Gauss


def _quarter(corners):
    """Gauss points (x, y, dx, dy) on the part of a polygon with x > 0 and y > 0."""
    points = []
    for (x1, y1), (x2, y2) in zip(corners, corners[1:] + corners[:1]):
        cuts = sorted({0.0, 1.0, *(p / (p - q) for p, q in ((x1, x2), (y1, y2)) if p * q < 0)})
        for low, high in zip(cuts, cuts[1:]):
            middle, part = 0.5 * (low + high), high - low
            if x1 + middle * (x2 - x1) > 0 and y1 + middle * (y2 - y1) > 0:
                points += [(x1 + (low + part * u) * (x2 - x1), y1 + (low + part * u) * (y2 - y1), part * w * (x2 - x1), part * w * (y2 - y1))
                           for u, w in NODES]
    return points


def of_outlines(first, second, distances):
    """Mutual inductances of two plane polygons, parallel at each of the distances; lengths in m. Both are symmetric about both axes, so
    that a quarter is a fourth of the whole. Neumann's integral: the vector potential of the straight pieces of the second at points of
    the first."""
    pieces = []
    for (x1, y1), (x2, y2) in zip(second, second[1:] + second[:1]):
        length = math.hypot(x2 - x1, y2 - y1)
        pieces.append((x1, y1, x2, y2, length))
    terms = [((x - x1)**2 + (y - y1)**2, (x - x2)**2 + (y - y2)**2, length, (dx * (x2 - x1) + dy * (y2 - y1)) / length)
             for x, y, dx, dy in _quarter(first) for x1, y1, x2, y2, length in pieces]
    found = []
    for distance in distances:
        apart, total = distance * distance, 0.0
        for start, end, length, along in terms:
            both = math.sqrt(start + apart) + math.sqrt(end + apart)
            total += along * math.log((both + length) / (both - length))
        found.append(MU0 / math.pi * total)
    return found


def _own_distance(coil):
    """Geometric mean distance of a turn's copper from itself, m. Of litz: of the bundle of strands."""
    wire = coil.wire
    bundle = wire["copper"] if wire["strands"] == 1 else 0.9 * coil.pitch  # serving and enamel outside of the outer strands
    return 1e-3 * 0.5 * bundle * math.exp(-0.25)


def _pairs(first, second):
    """(layer of the first, layer of the second, distance in m, number of pairs of turns)."""
    for i, m in enumerate(first.layers):
        for j, n in enumerate(second.layers):
            counts = {}
            for p in range(m):
                for q in range(n):
                    z = abs((p - 0.5 * (m - 1)) * first.pitch - (q - 0.5 * (n - 1)) * second.pitch)
                    counts[round(1e-3 * z, 9)] = counts.get(round(1e-3 * z, 9), 0) + 1
            yield i, j, counts


def between(first, second):
    """Mutual inductance of two rings with one axis and centre, H."""
    return sum(number * of_circles(1e-3 * first.offset(i), 1e-3 * second.offset(j), z)
               for i, j, counts in _pairs(first, second) for z, number in counts.items())


def of_coil(coil):
    """Inductance, H."""
    own, total = _own_distance(coil), 0.0
    for i, j, counts in _pairs(coil, coil):
        if j < i:
            continue
        distances = [own if i == j and z == 0 else z for z in counts]
        if len(coil.outline.corners) == 1:
            henry = [of_circles(1e-3 * coil.offset(i), 1e-3 * coil.offset(j), z) for z in distances]
        else:
            outlines = [[(1e-3 * x, 1e-3 * y) for x, y in coil.outline.points_at(coil.offset(k))] for k in (i, j)]
            henry = of_outlines(*outlines, distances)
        total += (1 if i == j else 2) * sum(n * h for n, h in zip(counts.values(), henry))
    return total


def by_wheeler(coil):
    """Inductance by Wheeler 1928 (SI units): within some per cent for coils whose radius, length and depth are of similar size. Other
    outlines: circles of the same area."""
    length, depth = 1e-3 * max(coil.layers) * coil.pitch, 1e-3 * len(coil.layers) * coil.pitch
    return 31.6e-6 * (coil.turns * coil.radius_m)**2 / (6 * coil.radius_m + 9 * length + 10 * depth)


def loss_factor(coil, hz):
    """Resistance at a frequency relative to direct current: proximity effect (Sullivan, IEEE Trans. Power Electronics 14, 1999, eq. 2, k = 1):
    strands in a field that rises linearly from 0 to N I / b over the depth of the winding; b: length of the window along the axis."""
    wire = coil.wire
    copper, window = 1e-3 * wire["copper"], 1e-3 * coil.window
    field = 2 * math.pi * hz * MU0 * coil.turns * wire["strands"]
    return 1 + (math.pi * field)**2 * copper**6 / (768 * (1e-3 * COPPER_OHM_MM)**2 * window**2)


def own_capacitance(coil):
    """Estimate, F: capacitances between adjacent layers, voltage rising along the winding (Snelling, "Soft ferrites", 2nd ed., 11.7)."""
    layers = len(coil.layers)
    if layers < 2:
        return 0.0
    copper = coil.wire["copper"] if coil.wire["strands"] == 1 else 0.9 * coil.pitch
    apart = 1e-3 * (1.26 * coil.pitch - 1.15 * copper)
    surface = 1e-6 * coil.window * sum(coil.outline.length_at(coil.offset(k)) for k in range(layers)) / layers
    return 4 / 3 * (layers - 1) / layers**2 * 3.5 * EPSILON0 * surface / apart


def resonance_hz(coil, henry):
    capacitance = own_capacitance(coil)
    return 1 / (2 * math.pi * math.sqrt(henry * capacitance)) if capacitance else math.inf
