"""Fit of coils, converters and poses to rests that a hand placed."""

import dataclasses
import os

import numpy as np
from scipy.spatial.transform import Rotation

from ._byte_stream import ByteStream
from ._coupling_table import ENTRIES, matrices, refuse_dead
from ._output_file import OutputFile, refuse_input_as_output
from ._rotation import wxyz
from ._table_rows import Table

EXPECTED = "x11 to x33, a11 to a33 and gain_step, as tricoil convert --to rests writes for a tracker board in TDM"
FEWEST = 72  # rests
MOST_MISFIT = 2e-3  # share of the couplings; other causes than converters
WORST_GRID = 0.05  # RMS distance from the nodes, of the extent of the grid
SYMMETRIC = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
ROUNDS = 6

# As in board/host/calibration/converter_errors.cpp; amplitudes are shares of full scale
LSB = 1 / 2048
JUMPS = 14
UNEXPLAINED = np.hypot(0.03 * LSB, 3e-5)  # of an amplitude, with the noise of a mean
COIL_ERROR, PICK_UP, GAIN_ERROR = 0.1, 0.05, 1e-3  # expected; pick-up: of the least coupling strength


def _expected_jumps():
    bits = [11 if n == 0 else (128 * n & -128 * n).bit_length() - 1 for n in range(JUMPS)]
    return np.array([(1 if n == 0 else 2) * 0.6 * LSB * 2 ** ((bit - 11) / 2) for n, bit in enumerate(bits)])


def _response(amplitude):
    """Amplitude error of a sine for a jump of height 1, (..., JUMPS): ConverterErrors::response()."""
    level = np.arange(JUMPS) / 16
    ratio = np.minimum(level / np.maximum(amplitude[..., None], 1e-9), 1)
    return 2 / np.pi * np.sqrt(1 - ratio**2)


@dataclasses.dataclass
class _Rests:
    x: np.ndarray  # (N, 3, 3)
    share: np.ndarray  # (N, 3, 3)
    step: np.ndarray  # (N,)
    quadrature: np.ndarray  # (N, 3, 3); NaN if the file has none

    def __add__(self, other):
        return _Rests(*(np.concatenate(both) for both in zip(dataclasses.astuple(self), dataclasses.astuple(other))))


def _read(path):
    path = os.fspath(path)
    parts = []
    with ByteStream(path) as stream:
        table = Table(stream)
        while (rows := table.next()) is not None:
            x, share = (matrices(table, rows, [kind + entry for entry in ENTRIES], EXPECTED) for kind in "xa")
            step = table.numbers(rows, [(table.column("gain_step", EXPECTED), None)])[0].astype(int)
            refuse_dead(table, rows, x)
            unknown = ~(share > 0).all(axis=(1, 2))
            left = np.linalg.det(x) <= 0
            for wrong, reason in ((unknown, "the levels at the converters are not known: the gain changed during this rest, or they are corrected "
                                            "already; remove the line, or record without a stored calibration"),
                                  (left, "the couplings are left-handed; correct the wiring (tricoil calibrate wiring)")):
                if wrong.any():
                    raise ValueError(f"{path}:{rows.lines[wrong.argmax()]}: {reason}")
            quadrature = matrices(table, rows, ["q" + entry for entry in ENTRIES], EXPECTED) if "q11" in table.names else np.full_like(x, np.nan)
            parts.append(_Rests(x, share, step, quadrature))
    if not parts:
        raise ValueError(f"{path}: holds no rests")
    return sum(parts[1:], parts[0])


class _Fit:
    """Coils, pick-up, converters and gain steps that leave the least part of the couplings which no pose explains. Unit of length: that for
    which the coupling constant is 1."""

    def __init__(self, rests, hemisphere):
        self.rests, self.side = rests, np.asarray(hemisphere, float)
        self.steps, self.at_step = np.unique(rests.step, return_inverse=True)
        self.response = _response(rests.share)
        weakest = np.linalg.norm(rests.x, axis=(1, 2)).min()
        self.expected = np.concatenate([np.full(12, COIL_ERROR), np.full(9, PICK_UP * weakest), np.full(3 * len(self.steps), GAIN_ERROR),
                                        np.tile(_expected_jumps(), 3)])
        self.sigma = UNEXPLAINED / rests.share.max(axis=(1, 2))
        self.parameters = np.zeros(len(self.expected))
        for _ in range(ROUNDS):
            self._improve()

    def _ideal(self, p):
        """Couplings of ideal triads, without the errors of the board."""
        moment, sensitivity = np.eye(3), np.eye(3)
        for k, (i, j) in enumerate(SYMMETRIC):
            moment[[i, j], [j, i]] += p[k]
            sensitivity[[i, j], [j, i]] += p[6 + k]
        gain = p[21:-3 * JUMPS].reshape(-1, 3)[self.at_step]
        error = np.einsum("nijk,ik->nij", self.response, p[-3 * JUMPS:].reshape(3, JUMPS)) / self.rests.share
        x = self.rests.x * (1 - error) * (1 - gain[:, :, None]) - p[12:21].reshape(3, 3)
        return np.linalg.inv(sensitivity).T @ x @ np.linalg.inv(moment)

    def _solve(self, p):
        """Strength k (N,), U and V^T of the direct solver, and the misfit relative to k (N, 3, 3)."""
        ideal = self._ideal(p)
        u, s, v = np.linalg.svd(ideal)
        k = 2 / 3 * (s[:, 0] + (s[:, 1] + s[:, 2]) / 2)
        return k, u, v, ideal / k[:, None, None] - u * (1, 0.5, 0.5) @ v

    def _residual(self, p):
        return np.concatenate(((self._solve(p)[3] / self.sigma[:, None, None]).ravel(), p / self.expected))

    def _improve(self):
        now = self._residual(self.parameters)
        steps = np.diag(1e-3 * self.expected)
        jacobian = np.stack([(self._residual(self.parameters + step) - now) / step.sum() for step in steps], axis=1)
        self.parameters = self.parameters - np.linalg.lstsq(jacobian, now, rcond=None)[0]

    def poses(self):
        """Positions (N, 3), rotations from sensor to source components, RMS misfit."""
        k, u, v, misfit = self._solve(self.parameters)
        direction = v[:, 0] * np.where(v[:, 0] @ self.side < 0, -1, 1)[:, None]
        attitude = u * (1, -1, -1) @ v
        return k[:, None] ** (-1 / 3) * direction, attitude.swapaxes(1, 2), np.sqrt((misfit**2).sum(axis=(1, 2)).mean())


def _turn(nodes, places):
    """Rotation of nodes to places, both about their middle."""
    return Rotation.align_vectors(places, nodes)[0].as_matrix()


def _scale(positions, turns, nodes):
    """Metres of the unit of length: nodes = scale position - attitude pivot - place, turned. (scale, RMS distance, m)."""
    middle = nodes - nodes.mean(axis=0)
    spread = positions - positions.mean(axis=0)
    place, scale = spread, np.linalg.norm(middle) / np.linalg.norm(spread)
    for _ in range(50):
        turned = middle @ _turn(middle, place).T
        equations = np.concatenate((positions[:, :, None], -turns, np.broadcast_to(-np.eye(3), turns.shape)), axis=2).reshape(-1, 7)
        solution = np.linalg.lstsq(equations, turned.ravel(), rcond=None)[0]
        scale, place = solution[0], (equations @ solution).reshape(-1, 3)
    return scale, np.sqrt(((place - turned) ** 2).sum(axis=1).mean())


def _nodes(count, nodes, spacing_mm):
    """Place of each rest on the grid, m. nodes: numbers of columns, rows, levels."""
    nodes = tuple(int(n) for n in nodes)
    if len(nodes) != 3 or min(nodes) < 1 or sorted(nodes)[1] < 2:
        raise ValueError(f"nodes: needs numbers of columns, rows and levels, two of them 2 or more; got {nodes}")
    if not 1 <= spacing_mm <= 1000:
        raise ValueError(f"spacing_mm: must be 1 to 1000; got {spacing_mm}")
    total = nodes[0] * nodes[1] * nodes[2]
    if count % total:
        raise ValueError(f"grid: {count} rests are not equally many at each of {total} nodes")
    number = np.arange(count) // (count // total)
    return spacing_mm / 1e3 * np.stack((number % nodes[0], number // nodes[0] % nodes[1], number // nodes[0] // nodes[1]), axis=1)


def hand_poses(grid, anywhere, out, nodes, spacing_mm, hemisphere) -> dict:
    """See _hand_poses.hand_poses()."""
    refuse_input_as_output({"out": out}, [grid, anywhere])
    placed = _read(grid)
    count = len(placed.step)
    node = _nodes(count, nodes, spacing_mm)
    rests = placed + _read(anywhere)
    if len(rests.step) < FEWEST:
        raise ValueError(f"{len(rests.step)} rests do not determine coils and converters; {FEWEST} or more are needed")
    position, turn, misfit = _Fit(rests, hemisphere).poses()
    if not misfit < MOST_MISFIT:
        raise ValueError(f"{100 * misfit:.2g} % of the couplings remain unexplained, at most {100 * MOST_MISFIT:g} % are converters and coils: metal nearby, "
                         "a moving sensor, or coils that are no dipoles at the nearest rests")
    scale, rms_m = _scale(position[:count], turn[:count], node)
    extent_m = np.linalg.norm(node - node.mean(axis=0)) / np.sqrt(count)
    if not (scale > 0 and rms_m < WORST_GRID * extent_m):
        raise ValueError(f"{os.fspath(grid)}: the rests are {1e3 * rms_m:.1f} mm RMS from the nodes: another order of the nodes, or the grid is on another "
                         "side of the source than hemisphere says")
    has_quadrature = np.isfinite(rests.quadrature).all()
    kinds = {"x": rests.x, **({"q": rests.quadrature} if has_quadrature else {}), "a": rests.share}
    names = [kind + entry for kind in kinds for entry in ENTRIES] + ["gain_step", "x_m", "y_m", "z_m", "qw", "qx", "qy", "qz"]
    table = np.column_stack((*(values.reshape(-1, 9) for values in kinds.values()), rests.step, scale * position, wxyz(Rotation.from_matrix(turn))))
    with OutputFile(os.fspath(out)) as file:
        file.write(",".join(names) + "\n" + "".join(",".join(f"{value:.9g}" for value in row) + "\n" for row in table))
        file.commit()
    return {"rests": len(table), "misfit": float(misfit), "grid_rms_m": float(rms_m), "scale_deviation": float(rms_m / extent_m / np.sqrt(3 * count))}
