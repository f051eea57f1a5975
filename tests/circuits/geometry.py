"""Position error due to errors of the couplings: linear least squares at random poses of the dipole model."""
import math
import random


def _couplings(p, w, q):
    """Rows: sensor axes turned by q and then by the small w; columns: source axes. Unit of coupling: C / r^3."""
    r = math.sqrt(sum(v * v for v in p))
    u = [v / r for v in p]
    field = [[0.5 * (3 * u[i] * u[j] - (i == j)) / r**3 for j in range(3)] for i in range(3)]
    small = [[1, -w[2], w[1]], [w[2], 1, -w[0]], [-w[1], w[0], 1]]
    turned = [[sum(small[i][k] * q[k][j] for k in range(3)) for j in range(3)] for i in range(3)]
    return [sum(turned[k][i] * field[k][j] for k in range(3)) for i in range(3) for j in range(3)]


def solve(a, b):
    n = len(a)
    m = [row[:] + [b[i]] for i, row in enumerate(a)]
    for i in range(n):
        pivot = max(range(i, n), key=lambda k: abs(m[k][i]))
        m[i], m[pivot] = m[pivot], m[i]
        for k in range(n):
            if k != i:
                f = m[k][i] / m[i][i]
                m[k] = [x - f * y for x, y in zip(m[k], m[i])]
    return [m[i][n] / m[i][i] for i in range(n)]


def _random_rotation(rng):
    q = [rng.gauss(0, 1) for _ in range(4)]
    n = math.sqrt(sum(v * v for v in q))
    w, x, y, z = (v / n for v in q)
    return [[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]]


class Sensitivity:
    """3D RMS position error, as a share of the range, due to errors of 1. coupling: independent errors of all couplings, relative to
    the largest coupling. row, column: independent gain errors of the sensor coils, of the source coils. common: gain error of all."""

    def __init__(self, poses=200, seed=1):
        rng = random.Random(seed)
        self.coupling = self.row = self.column = self.common = 0.0
        for _ in range(poses):
            direction = [rng.gauss(0, 1) for _ in range(3)]
            norm = math.sqrt(sum(v * v for v in direction))
            self._add([v / norm for v in direction], _random_rotation(rng), poses)
        for name in ("coupling", "row", "column", "common"):
            setattr(self, name, math.sqrt(getattr(self, name)))

    def _add(self, p, q, poses):
        step = 1e-5
        truth = _couplings(p, [0, 0, 0], q)
        jacobian = []
        for k in range(6):
            a, b = [0.0] * 6, [0.0] * 6
            a[k], b[k] = step, -step
            plus = _couplings([p[i] + a[i] for i in range(3)], a[3:], q)
            minus = _couplings([p[i] + b[i] for i in range(3)], b[3:], q)
            jacobian.append([(x - y) / (2 * step) for x, y in zip(plus, minus)])
        normal = [[sum(x * y for x, y in zip(a, b)) for b in jacobian] for a in jacobian]

        def squared(error):
            shift = solve(normal, [sum(x * e for x, e in zip(row, error)) for row in jacobian])
            return sum(v * v for v in shift[:3]) / poses

        for n in range(9):
            self.coupling += squared([float(k == n) for k in range(9)])
        for n in range(3):
            self.row += squared([truth[k] * (k // 3 == n) for k in range(9)])
            self.column += squared([truth[k] * (k % 3 == n) for k in range(9)])
        self.common += squared(truth)
