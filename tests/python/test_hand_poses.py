"""Poses of rests that a hand placed, from a simulated board with errors of coils, pick-up, converters and gain steps."""

import os
import unittest
from unittest import mock

import numpy as np
from folder_case import FolderCase
from scipy.spatial.transform import Rotation

import tricoil

NAMES = [kind + i + j for kind in "xa" for i in "123" for j in "123"] + ["gain_step"]
NODES = (6, 4, 1)
SPACING_M = 0.1


class Board:
    """Measures the mean couplings of a rest, with errors of its coils, converters and gain steps, and pick-up."""

    def __init__(self, seed=5):
        self.rng = np.random.default_rng(seed)
        self.moment = 0.125 * (np.eye(3) + np.diag(self.rng.uniform(-0.01, 0.01, 3)))
        self.sensor = np.eye(3) + self.rng.uniform(-0.01, 0.01, (3, 3))
        self.pick_up = self.rng.uniform(-1.5e-3, 1.5e-3, (3, 3))
        self.gain = self.rng.normal(0, 0.8e-3, (16, 3))
        self.jump = self.rng.normal(0, 1e-4, (3, 14))

    def rest(self, position, turn):
        r = np.linalg.norm(position)
        u = position / r
        x = self.sensor @ turn.T @ (1.5 * np.outer(u, u) - 0.5 * np.eye(3)) @ self.moment / r**3 + self.pick_up
        step = int(np.clip(np.floor(np.log2(0.85 / (0.18 * abs(x).max()))) + 5, 3, 11))
        share = 0.18 * 2.0 ** (step - 5) * abs(x)
        ratio = np.minimum(np.arange(14) / 16 / share[..., None], 1)
        error = np.einsum("ijk,ik->ij", 2 / np.pi * np.sqrt(1 - ratio**2), self.jump) / share
        x = x * (1 + error) * (1 + self.gain[step][:, None]) + self.rng.normal(0, 2e-5, (3, 3)) / (0.18 * 2.0 ** (step - 5))
        return [*x.ravel(), *share.ravel(), step]


def placed(board, rng, slip_m=0.3e-3, pivot_m=(0, 0, 0.015)):
    """Rests on the grid, and their true positions."""
    rows, places = [], []
    for n in range(72):
        node = n // 3
        turn = Rotation.random(random_state=rng.integers(1 << 30)).as_matrix()
        mark = np.array([0.4, SPACING_M * (node % 6 - 2.5), SPACING_M * (node // 6 - 1.5)])
        places.append(mark + rng.normal(0, slip_m, 3) + turn @ pivot_m)
        rows.append(board.rest(places[-1], turn))
    return rows, places


def elsewhere(board, rng, count=72):
    rows, places = [], []
    for r in np.linspace(0.28, 1.2, count):
        u = rng.normal(size=3)
        u[0] = abs(u[0]) + 0.3
        places.append(r * u / np.linalg.norm(u))
        rows.append(board.rest(places[-1], Rotation.random(random_state=rng.integers(1 << 30)).as_matrix()))
    return rows, places


def table(rows, names=NAMES):
    return ",".join(names) + "\n" + "".join(",".join(map(repr, map(float, row[:-1]))) + f",{row[-1]}\n" for row in rows)


class HandPoses(FolderCase):
    def setUp(self):
        super().setUp()
        self.rng = np.random.default_rng(3)
        self.board = Board()
        self.grid, self.on_grid = placed(self.board, self.rng)
        self.rests, self.at = elsewhere(self.board, self.rng)

    def solved(self, grid=None, rests=None, **options):
        self.write("grid.csv", table(self.grid if grid is None else grid))
        self.write("rests.csv", table(self.rests if rests is None else rests))
        options = {"nodes": NODES, "spacing_mm": 100, **options}
        return tricoil.hand_poses(self.path("grid.csv"), self.path("rests.csv"), self.path("posed.csv"), **options)

    def write(self, name, text):
        with open(self.path(name), "w") as file:
            file.write(text)

    def fails_with(self, message, **options):
        with self.assertRaisesRegex(ValueError, message):
            self.solved(**options)
        self.assertFalse(os.path.exists(self.path("posed.csv")))

    def error_mm(self):
        """RMS of the solved positions at 0.6 to 0.9 m."""
        posed = np.genfromtxt(self.path("posed.csv"), delimiter=",", names=True)
        true = np.array(self.on_grid + self.at)
        found = np.stack([posed["x_m"], posed["y_m"], posed["z_m"]], axis=1)
        distance = np.linalg.norm(true, axis=1)
        far = (distance > 0.6) & (distance < 0.9)
        return 1e3 * np.sqrt(np.mean(np.sum((found - true)[far] ** 2, axis=1)))

    def test_poses_of_a_board_with_errors(self):
        result = self.solved()
        self.assertLess(self.error_mm(), 0.5)
        self.assertLess(result["misfit"], 1e-4)
        self.assertAlmostEqual(1e3 * result["grid_rms_m"], 0.3 * 3**0.5, delta=0.15)
        self.assertLess(result["scale_deviation"], 5e-4)
        self.assertEqual(result["rests"], 144)

    def test_quadratures_are_kept(self):
        self.solved()
        with open(self.path("posed.csv")) as file:
            self.assertNotIn("q11", file.readline())
        names = NAMES[:-1] + ["q" + i + j for i in "123" for j in "123"] + ["gain_step"]
        for name, rows in (("grid.csv", self.grid), ("rests.csv", self.rests)):
            self.write(name, table([[*row[:-1], *range(1, 10), row[-1]] for row in rows], names))
        tricoil.hand_poses(self.path("grid.csv"), self.path("rests.csv"), self.path("posed.csv"), nodes=NODES, spacing_mm=100)
        posed = np.genfromtxt(self.path("posed.csv"), delimiter=",", names=True)
        self.assertEqual([set(posed[f"q{i}{j}"]) for i in "123" for j in "123"], [{float(n)} for n in range(1, 10)])

    def test_errors_of_the_board_matter(self):
        self.solved()
        fitted_mm = self.error_mm()
        with mock.patch("tricoil._hand_fit.GAIN_ERROR", 1e-9), mock.patch("tricoil._hand_fit._expected_jumps", lambda: np.full(14, 1e-12)):
            self.solved()
        self.assertGreater(self.error_mm(), 2 * fitted_mm)

    def test_bad_input(self):
        self.fails_with(r"grid: 71 rests are not equally many at each of 24 nodes", grid=self.grid[:71])
        self.fails_with(r"rests do not determine", grid=self.grid[:24], rests=self.rests[:40])
        self.fails_with(r"mm RMS from the nodes", grid=self.grid[::-1][:36] + self.grid[:36])
        self.fails_with(r"nodes: needs numbers", nodes=(24, 1, 1))
        self.fails_with(r"spacing_mm: must be", spacing_mm=0)
        dead = [list(row) for row in self.rests]
        dead[4][9] = 0
        self.fails_with(r"rests.csv:6: the levels at the converters are not known", rests=dead)
        reversed_coil = [[*(-np.array(row[:3])), *row[3:]] for row in self.rests]
        self.fails_with(r"rests.csv:2: the couplings are left-handed", rests=reversed_coil)
        noisy = [[*(np.array(row[:9]) * self.rng.normal(1, 0.02, 9)), *row[9:]] for row in self.rests]
        self.fails_with(r"% of the couplings remain unexplained", rests=noisy)
        self.write("x.csv", "x11,x12\n1,2\n")
        with self.assertRaisesRegex(ValueError, "x.csv.*x13"):
            tricoil.hand_poses(self.path("x.csv"), self.path("rests.csv"), self.path("posed.csv"), nodes=NODES, spacing_mm=100)
        with self.assertRaisesRegex(ValueError, "is also an input file"):
            tricoil.hand_poses(self.path("grid.csv"), self.path("rests.csv"), self.path("rests.csv"), nodes=NODES, spacing_mm=100)


if __name__ == "__main__":
    unittest.main()
