"""Magnetic field of the source coils near the source: loops of straight pieces (Biot-Savart)."""
import math

PIECES = 60


def _loop_field(axis, radius, ampere_turns, point):
    total = [0.0, 0.0, 0.0]
    e1, e2 = (axis + 1) % 3, (axis + 2) % 3
    for k in range(PIECES):
        angle = 2 * math.pi * (k + 0.5) / PIECES
        place, piece = [0.0] * 3, [0.0] * 3
        place[e1], place[e2] = radius * math.cos(angle), radius * math.sin(angle)
        length = 2 * radius * math.sin(math.pi / PIECES)
        piece[e1], piece[e2] = -length * math.sin(angle), length * math.cos(angle)
        d = [point[i] - place[i] for i in range(3)]
        cube = math.sqrt(sum(v * v for v in d)) ** 3
        total = [total[i] + (piece[(i + 1) % 3] * d[(i + 2) % 3] - piece[(i + 2) % 3] * d[(i + 1) % 3]) / cube for i in range(3)]
    return math.sqrt(sum(v * v for v in total)) * 1e-7 * ampere_turns


def reached_m(tesla, coils):
    """Distance, m, at which the sum of the coils' magnitudes falls to `tesla`; between 5 and 50 cm."""
    near, far = 0.05, 0.5
    for _ in range(20):
        middle = 0.5 * (near + far)
        near, far = (middle, far) if largest(middle, coils, True) > tesla else (near, middle)
    return far


def largest(distance, coils, together):
    """Largest magnetic flux density, tesla, at a distance from the centre. coils: (turns, radius, amperes) about x, y, z.
    together: sum of the coils' magnitudes (for the sum rule of several frequencies); otherwise the largest of one coil alone."""
    most = 0.0
    for i in range(0, 10):
        for j in range(0, 10):
            theta, phi = math.pi / 2 * i / 9, math.pi / 2 * j / 9
            point = [distance * math.sin(theta) * math.cos(phi), distance * math.sin(theta) * math.sin(phi), distance * math.cos(theta)]
            parts = [_loop_field(axis, radius, turns * amperes, point) for axis, (turns, radius, amperes) in enumerate(coils)]
            most = max(most, sum(parts) if together else max(parts))
    return most
