"""Calibration of a generator, and of the mounts of sensor coils, from couplings at known poses."""

import itertools

import numpy as np
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from ._generator import Generator, SensorCoil
from ._generator_table import Frames

DISTANCES = (0.7, 1.2, 2.0, 3.2, 5.0)  # of starts from the middle of the poses, in units of their RMS distance from it
DIRECTIONS = np.array([u for u in itertools.product((-1, 0, 1), repeat=3) if any(u)], float)
TRIED = 3  # starts of each coil that are refined
SCALE = 2e-3  # residual relative to a row's couplings: the size of an ordinary misfit, for the robust loss
OFFSET_PRIOR_M = 0.1  # weak: fixes only what the poses do not show
CROSSTALK_PRIOR = 0.3
RICH = 6  # equations for each unknown of the model with crosstalk and sizes
LEAST_ROWS = 12  # of the sensor coil with which the search begins
MOST_CONDITION = 1e6  # of the Jacobian with columns of unit length, as in `tricoil calibrate stage`
FLAT = 1e-3  # thickness of poses in a plane, relative to their size
LEAST_GAIN_DEVIATION = 2e-4  # of calibrated gains from one recording to the next
MIRRORED = 3.0  # residual of coils on the other side of such a plane, relative to that of the fit


def dyads(position_m, at_m):
    """(M, 3, 3): coupling of unit moments and sensitivities, (3 u u^T - 1) / (2 d^3). position_m: (M, 3); at_m: (3,)."""
    r = position_m - at_m
    d = np.linalg.norm(r, axis=1)
    u = r / d[:, None]
    return (3 * u[:, :, None] * u[:, None, :] - np.eye(3)) / (2 * d[:, None, None] ** 3)


class _Rows:
    """Rows of each sensor coil with the poses of the coil, or of its body."""

    def __init__(self, frames: Frames, turn: Rotation | None):
        self.numbers = sorted(set(frames.sensor.tolist()))
        self.index = np.searchsorted(self.numbers, frames.sensor)
        self.position_m, self.couplings, self.axis = frames.position_m, frames.couplings, frames.axis
        self.turn = None if turn is None else turn.as_matrix()
        self.weight = 1 / np.linalg.norm(frames.couplings, axis=1)
        rows_of = np.bincount(self.index)
        self.first = int(np.argmax(rows_of))  # sensor coil with the most rows
        self.begins = self.index == self.first if rows_of.max() >= LEAST_ROWS else np.ones(len(self.index), bool)

    def geometry(self, offset_m, sensitivity):
        """Positions and sensitivities of the coils, (M, 3)."""
        if self.turn is None:
            return self.position_m, self.axis * sensitivity[self.index, :1]
        return (self.position_m + np.einsum("mij,mj->mi", self.turn, offset_m[self.index]), np.einsum("mij,mj->mi", self.turn, sensitivity[self.index]))


def _products(rows, at_m, coil):
    """For a source coil at at_m: the products of sensitivities and moment that explain its couplings best, (3 K, 3), or (1, 3), of one sensor
    coil, if the axes are known, and the residuals. Linear least squares; without offsets."""
    t = dyads(rows.position_m, at_m)
    blocks, residuals = [], np.zeros(len(rows.couplings))
    parts = [rows.begins] if rows.turn is None else [rows.index == k for k in range(len(rows.numbers))]
    for part in parts:
        if rows.turn is None:
            a = np.einsum("mi,mij->mj", rows.axis[part], t[part])
        else:
            a = np.einsum("mji,mjk->mik", rows.turn[part], t[part]).reshape(part.sum(), 9)
        right = rows.couplings[part, coil] * rows.weight[part]
        weighted = a * rows.weight[part, None]
        x = np.linalg.lstsq(weighted, right, rcond=1e-9)[0]
        residuals[part] = weighted @ x - right
        blocks.append(x.reshape(-1, 3))
    return np.concatenate(blocks), residuals


def _starts(rows):
    middle = rows.position_m.mean(axis=0)
    size = np.sqrt(np.mean(np.sum((rows.position_m - middle) ** 2, axis=1)))
    return [middle + f * size * u / np.linalg.norm(u) for f in DISTANCES for u in DIRECTIONS]


def _place(rows, coil, starts):
    """Position of one source coil: the best of several starts."""
    def cost(at):
        return np.sum(_products(rows, at, coil)[1] ** 2)

    best = sorted(starts, key=cost)[:TRIED]
    found = [least_squares(lambda at: _products(rows, at, coil)[1], start, x_scale=0.05, max_nfev=60) for start in best]
    return min(found, key=lambda one: one.cost).x


def _gains(rows, places, moments):
    """Gains (K,) of sensor coils with known axes, that of the first one is 1: linear least squares."""
    alone = np.stack([np.einsum("mi,mij,j->m", rows.axis, dyads(rows.position_m, place), moment) for place, moment in zip(places, moments)], axis=1)
    alone, measured = (values * rows.weight[:, None] for values in (alone, rows.couplings))
    gains = np.array([np.sum((alone * measured)[part]) / np.sum(alone[part] ** 2) for part in (rows.index == k for k in range(len(rows.numbers)))])
    return np.where(rows.begins.all(), 1.0, gains / gains[rows.first])


def _initial(rows, count):
    """Positions and moments of the coils, sensitivities of the sensor coils (K, 3): products of rank one."""
    starts = _starts(rows)
    places = np.array([_place(rows, coil, starts) for coil in range(count)])
    products = [_products(rows, place, coil)[0] for coil, place in enumerate(places)]
    if rows.turn is None:
        moments = np.concatenate(products)
        gains = _gains(rows, places, moments)
        scale = np.sqrt(np.mean(gains**2))
        return places, moments * scale, np.repeat(gains[:, None] / scale, 3, axis=1)
    u, s, vt = np.linalg.svd(np.concatenate(products, axis=1), full_matrices=False)
    scale = np.sqrt(len(rows.numbers))
    return places, (s[0] / scale * vt[0]).reshape(count, 3), (scale * u[:, 0]).reshape(-1, 3)


class _Model:
    """Unknowns: positions, moments, octupoles (1e-3 m2) and crosstalk of the coils; offsets and sensitivities of the sensor coils, or gains of all but
    the first."""

    def __init__(self, rows, count, is_rich):
        self.rows, self.count, self.is_rich = rows, count, is_rich
        self.off_diagonal = ~np.eye(count, dtype=bool)

    def parts(self, x):
        n, k = self.count, len(self.rows.numbers)
        sizes = [3 * n, 3 * n, n if self.is_rich else 0, n * (n - 1) if self.is_rich else 0, 3 * k, 3 * k if self.rows.turn is not None else k]
        place, moment, octupole, crosstalk, offset, sensitivity = np.split(x, np.cumsum(sizes)[:-1])
        mixed = np.zeros((n, n))
        if self.is_rich:
            mixed[self.off_diagonal] = crosstalk
        if self.rows.turn is None:
            sensitivity = np.repeat(sensitivity, 3)
        return (place.reshape(n, 3), moment.reshape(n, 3), octupole * 1e-3 if self.is_rich else np.zeros(n), mixed, offset.reshape(k, 3),
                sensitivity.reshape(k, 3))

    def start(self, places, moments, sensitivities):
        n, k = self.count, len(self.rows.numbers)
        extra = np.zeros(n * n if self.is_rich else 0)
        return np.concatenate((places.ravel(), moments.ravel(), extra, np.zeros(3 * k), sensitivities.ravel() if self.rows.turn is not None else sensitivities[:, 0]))

    def generator(self, x, **more):
        place, moment, octupole, mixed, *_ = self.parts(x)
        return Generator(tuple(f"c{n}" for n in range(self.count)), place, moment, octupole, mixed, **more)

    def residuals(self, x):
        """Relative to the couplings of each row, (M, N); measured couplings without crosstalk minus the model."""
        *_, offset, sensitivity = self.parts(x)
        generator = self.generator(x)
        p, n = self.rows.geometry(offset, sensitivity)
        return (generator.field(p, n)[:, :, 0] - generator.of_coils(self.rows.couplings)) * self.rows.weight[:, None]

    def all(self, x):
        """Residuals, and weak knowledge of what the poses may not show: scale of the sensitivities, offsets, crosstalk."""
        *_, mixed, offset, sensitivity = self.parts(x)
        scale = np.linalg.norm(sensitivity) - np.linalg.norm(np.ones_like(sensitivity)) / (np.sqrt(3) if self.rows.turn is not None else 1)
        prior = SCALE * np.concatenate((offset.ravel() / OFFSET_PRIOR_M, mixed[self.off_diagonal] / CROSSTALK_PRIOR)) * 0.1
        return np.concatenate((self.residuals(x).ravel(), [scale], prior))

    def jacobian(self, x):
        place, moment, octupole, mixed, offset, sensitivity = self.parts(x)
        m, n, k = len(self.rows.couplings), self.count, len(self.rows.numbers)
        p, s = self.rows.geometry(offset, sensitivity)
        generator = self.generator(x)
        field = generator.field(p, s) * self.rows.weight[:, None, None]
        out = np.zeros((m, n, x.size))
        coils = np.arange(n)
        for i in range(n):
            out[:, i, 3 * i:3 * i + 3] = -field[:, i, 1:4]
            # Without the octupole's part, which is small.
            out[:, i, 3 * n + 3 * i:3 * n + 3 * i + 3] = np.einsum("mij,mj->mi", dyads(p, place[i]), s) * self.rows.weight[:, None]
        at = 6 * n
        if self.is_rich:
            ones = Generator(generator.names, place, moment, np.ones(n)).field(p, s)[:, :, 0] - Generator(generator.names, place, moment).field(p, s)[:, :, 0]
            out[:, coils, at + coils] = ones * self.rows.weight[:, None] * 1e-3
            at += n
            i, j = np.nonzero(self.off_diagonal)
            out[:, i, at + np.arange(i.size)] = -(self.rows.couplings * self.rows.weight[:, None])[:, j]
            at += i.size
        by_p, by_n = field[:, :, 1:4], field[:, :, 4:]
        turned = None if self.rows.turn is None else [np.einsum("mni,mij->mnj", by, self.rows.turn) for by in (by_p, by_n)]
        for c in range(k):
            part = self.rows.index == c
            if turned is None:
                out[part, :, at + 3 * k + c] = np.einsum("mni,mi->mn", by_n[part], self.rows.axis[part])
            else:
                out[part, :, at + 3 * c:at + 3 * c + 3] = turned[0][part]
                out[part, :, at + 3 * k + 3 * c:at + 3 * k + 3 * c + 3] = turned[1][part]
        return np.concatenate((out.reshape(m * n, -1), self._prior_rows(x, sensitivity, at)))

    def _prior_rows(self, x, sensitivity, at):
        k, count = len(self.rows.numbers), self.off_diagonal.sum()
        rows = np.zeros((1 + 3 * k + count, x.size))
        length = np.linalg.norm(sensitivity)
        if self.rows.turn is None:
            rows[0, at + 3 * k:] = 3 * sensitivity[:, 0] / length
        else:
            rows[0, at + 3 * k:] = sensitivity.ravel() / length
        rows[1 + np.arange(3 * k), at + np.arange(3 * k)] = 0.1 * SCALE / OFFSET_PRIOR_M
        if self.is_rich:
            rows[1 + 3 * k + np.arange(count), at - count + np.arange(count)] = 0.1 * SCALE / CROSSTALK_PRIOR
        return rows

    def fit(self, start):
        return least_squares(self.all, start, self.jacobian, x_scale="jac", loss="soft_l1", f_scale=1.5 * SCALE, max_nfev=60)


    def refuse_few(self):
        if self.unknowns() >= self.rows.couplings.size:
            raise ValueError(f"{self.rows.couplings.size} couplings for {self.unknowns()} unknowns: add poses" + (", or choose --model dipole" if self.is_rich else ""))

    def unknowns(self):
        """Number of unknowns: without the common scale, and without offsets if the poses are those of the coil."""
        n, k = self.count, len(self.rows.numbers)
        return 6 * n + (n**2 if self.is_rich else 0) + (k if self.rows.turn is None else 6 * k) - 1

    def refuse_undetermined(self, x):
        """Raises ValueError if the poses do not determine positions and moments of the coils and sensitivities of the sensor coils. The weak
        knowledge of offsets and crosstalk does not count."""
        n, k = 6 * self.count, len(self.rows.numbers)
        *_, sensitivity = self.parts(x)
        end = x.size - (sensitivity.size if self.rows.turn is not None else k)
        jacobian = np.delete(self.jacobian(x)[:self.rows.couplings.size + 1], np.arange(n, end), axis=1)
        s = np.linalg.svd(jacobian / np.maximum(np.linalg.norm(jacobian, axis=0), 1e-300), compute_uv=False)
        if not s[0] < MOST_CONDITION * s[-1]:
            raise ValueError(f"the poses do not determine the coils (condition number {s[0] / max(s[-1], 1e-300):.1e}): add poses at other places, not on one line, "
                             "and with other axes")

    def refuse_mirrored(self, x):
        """Raises ValueError if the poses are in a plane and a coil on its other side explains the couplings too."""
        place, moment, octupole, mixed, offset, sensitivity = self.parts(x)
        p, n = self.rows.geometry(offset, sensitivity)
        middle = p.mean(axis=0)
        _, s, axes = np.linalg.svd(p - middle, full_matrices=False)
        if s[2] > FLAT * s[0]:
            return
        mirror = np.eye(3) - 2 * np.outer(axes[2], axes[2])
        names = tuple(f"c{i}" for i in range(self.count))
        of = lambda sign: Generator(names, (place - middle) @ mirror + middle, sign * moment @ mirror, octupole, mixed)
        wanted = Generator(names, place, moment, octupole, mixed).of_coils(self.rows.couplings)
        other = np.min([np.mean(((of(sign).field(p, n)[:, :, 0] - wanted) * self.rows.weight[:, None]) ** 2, axis=0) for sign in (1, -1)], axis=0)
        is_far = abs((place - middle) @ axes[2]) > FLAT * s[0]
        if (is_far & (other <= MIRRORED**2 * np.mean(self.residuals(x) ** 2, axis=0))).any():
            raise ValueError("the poses are in one plane, and coils on both sides of it explain the couplings: add poses outside the plane, or with inclined axes")


def _refuse_reversed(rows, gains):
    for number, gain in zip(rows.numbers, gains):
        if gain * gains[rows.first] <= 0:
            raise ValueError(f"sensor coil {number} is reversed relative to sensor coil {rows.numbers[rows.first]}: exchange its wires, or the signs of its couplings")


def fitted(frames: Frames, model: str) -> tuple[Generator, float]:
    """The generator with the mounts of the sensor coils, and the RMS residual relative to the couplings. model: dipole or full (sizes of the
    coils and crosstalk between them)."""
    count = frames.couplings.shape[1]
    best = None
    turns = [(False, frames.turn)] if not frames.is_stage or frames.turn is None else [(False, frames.turn), (True, frames.turn.inv())]
    for is_left_handed, turn in turns:
        rows = _Rows(frames, turn)
        simple = _Model(rows, count, False)
        simple.refuse_few()
        found = simple.fit(simple.start(*_initial(rows, count)))
        if best is None or found.cost < best[2].cost:
            best = is_left_handed, rows, found, simple
    is_left_handed, rows, found, used = best
    if model == "full":
        place, moment, _, _, offset, sensitivity = used.parts(found.x)
        used = _Model(rows, count, True)
        used.refuse_few()
        start = used.start(place, moment, sensitivity)
        k = len(rows.numbers)
        tail = 3 * k if rows.turn is not None else k
        start[-tail - 3 * k:] = found.x[-tail - 3 * k:]
        found = used.fit(start)
    used.refuse_undetermined(found.x)
    used.refuse_mirrored(found.x)
    *_, offset, sensitivity = used.parts(found.x)
    if rows.turn is None:
        _refuse_reversed(rows, sensitivity[:, 0])
    free = 1 - used.unknowns() / rows.couplings.size  # degrees of freedom, relative
    residuals = used.residuals(found.x) / np.sqrt(free)
    misfit = np.sqrt(np.mean(residuals**2, axis=0))
    sensors = {}
    of_gain = np.sum(residuals * rows.couplings * rows.weight[:, None], axis=1)  # error of the gain that each row shows, relative
    for k, (number, at, n) in enumerate(zip(rows.numbers, offset, sensitivity)):
        gain = float(np.linalg.norm(n)) if rows.turn is not None else float(n[0])
        shown = of_gain[rows.index == k]
        deviation = max(LEAST_GAIN_DEVIATION, float(np.sqrt(np.mean(shown**2) / len(shown))))
        sensors[number] = SensorCoil(gain, *((at, n / gain) if rows.turn is not None else (None, None)), deviation)
    place, moment, octupole, mixed, *_ = used.parts(found.x)
    generator = Generator(frames.names, place, moment, octupole, mixed, misfit, sensors, is_left_handed)
    return generator, float(np.sqrt(np.mean(np.sum(residuals**2, axis=1))))
