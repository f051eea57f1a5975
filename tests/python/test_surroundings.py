"""Virtual dipoles of metal at rest: derivatives, the search for them, and the arguments of the command."""

import json
import os
import subprocess
import unittest
import unittest.mock

import numpy as np
from folder_case import FolderCase
from scipy.spatial.transform import Rotation
import tricoil
from tricoil import _tricoil
from tricoil._calibration_files import files_of
from tricoil._induced import LENGTH_M, Coils, rows_of
from tricoil._levenberg import Blocks, minimise
from tricoil._surroundings_fit import Placed, Search, Unknowns, _Clearance, check_places

STEP = 1e-6


def dipole_field(r, m):
    """Written out, not by the package."""
    d = np.linalg.norm(r)
    return 1.5 * (r @ m) * r / d**5 - 0.5 * m / d**3


def couplings(numbers, position_m, attitude, dipoles):
    """(9,) in column order, of coils (4, 3, 3) and dipoles (D, 12)."""
    source, moment, sensor, sensitivity = numbers
    x = np.zeros((3, 3))
    for i in range(3):
        n, place = attitude @ sensitivity[:, i], position_m + attitude @ sensor[:, i]
        for j in range(3):
            x[i, j] = n @ dipole_field(place - source[:, j], moment[:, j])
            for row in dipoles:
                induced = 2 * row[3:].reshape(3, 3) @ dipole_field(row[:3] - source[:, j], moment[:, j])
                x[i, j] += n @ dipole_field(place - row[:3], induced)
    return x.T.ravel()


def numerical_model(numbers):
    """Couplings, and central differences by position and rotation."""
    def at(position_m, attitude, dipoles):
        return np.array([couplings(numbers, *pose, dipoles) for pose in zip(position_m, attitude)])

    def model(position_m, attitude, dipoles):
        columns = []
        for k in range(6):
            step = np.zeros(6)
            step[k] = STEP
            ends = [at(position_m + sign * step[:3], Rotation.from_rotvec(sign * step[3:]).as_matrix() @ attitude, dipoles) for sign in (1, -1)]
            columns.append((ends[0] - ends[1]) / (2 * STEP))
        return at(position_m, attitude, dipoles), np.stack(columns, axis=2)

    return model


def some_coils(rng):
    return np.stack((0.02 * rng.uniform(-1, 1, (3, 3)), 0.02 * np.eye(3) + 1e-3 * rng.uniform(-1, 1, (3, 3)), 0.005 * rng.uniform(-1, 1, (3, 3)),
                     np.eye(3) + 0.05 * rng.uniform(-1, 1, (3, 3))))


def turn(*vector):
    return Rotation.from_rotvec(vector).as_matrix()


class Derivatives(unittest.TestCase):
    def test_equal_central_differences(self):
        rng = np.random.default_rng(20261124)
        for n in range(12):
            numbers = some_coils(rng)
            data = Placed(np.array([[0.35, -0.1, 0.15], [0.5, 0.2, -0.1]]), np.array([turn(0.2, -0.5, 1.1), turn(1, 0.3, -0.2)]),
                          0.1 * np.array([turn(0.5, 0.1, -0.7)] * 2), np.zeros((2, 3, 3)), (turn(0.1, 0.2, 0.3), np.zeros(3)), (turn(-1, 0.4, 0.2), np.zeros(3)),
                          fixtures_known=False, attitudes_known=bool(n % 2))
            search = Search(numerical_model(numbers), Coils(numbers), data)
            search.own = 3  # also of known attitudes: the derivatives of all blocks are compared
            rigid = 0 if n == 0 else 0.3
            dipoles = np.hstack((rng.uniform(-1, 1, (n % 3, 3)) + [2, 0, -5], 5 * rng.uniform(-1, 1, (n % 3, 6))))
            search.at = Unknowns(rigid * rng.uniform(-1, 1, 6), rigid * rng.uniform(-1, 1, 6), rigid * rng.uniform(-1, 1, (2, 3)), dipoles)
            weights = np.array([np.eye(9) + 0.1] * 2)
            _, shared, by_dipoles, own = search.linearised(weights)

            def numerical(change):
                return (search.residuals(weights, change(STEP)) - search.residuals(weights, change(-STEP))) / (2 * STEP)

            both = np.concatenate((shared, by_dipoles), axis=2)
            self.assertEqual(both.shape[2], (12 if n % 2 else 9) + dipoles.size)
            for k in range(both.shape[2]):
                unit = np.eye(both.shape[2])[k]
                expected = numerical(lambda step: search.moved(search.at, step * unit, np.zeros((2, 3))))
                np.testing.assert_allclose(both[:, :, k], expected, rtol=1e-5, atol=1e-7 * max(np.max(np.abs(expected)), 1e-4), err_msg=f"{n} {k}")
            for k in range(3):
                expected = numerical(lambda step: search.moved(search.at, np.zeros(both.shape[2]), step * np.eye(3)[[k, k]]))
                np.testing.assert_allclose(own[:, :, k], expected, rtol=1e-5, atol=1e-7 * np.max(np.abs(expected)), err_msg=f"{n} {k}")

    def test_clearance(self):
        clear = _Clearance(0.1, np.array([[0.5, 0, 0], [0.4, 0.3, 0]]))
        dipoles = np.array([[4.6, 0, 0.1, *range(6)], [0.2, 0.1, 0.3, *range(6)]])  # one beside each of the first pose and the source
        residual, by_dipoles = clear(dipoles)
        self.assertEqual(by_dipoles.shape, (2, 18))
        for k in range(18):
            step = STEP * np.eye(18)[k].reshape(2, 9)
            np.testing.assert_allclose(by_dipoles[:, k], (clear(dipoles + step)[0] - clear(dipoles - step)[0]) / (2 * STEP), atol=1e-8)
        np.testing.assert_allclose(residual, 0.1 - LENGTH_M * np.array([np.hypot(0.4, 0.1), np.linalg.norm([0.2, 0.1, 0.3])]))
        self.assertEqual([len(part) for part in clear(np.array([[9.0, 9, 9, *range(6)]]))], [0, 0])


class LeastSquares(unittest.TestCase):
    """Lines of different offsets and one slope: y = slope t + own."""

    def setUp(self):
        rng = np.random.default_rng(4)
        self.t = rng.normal(size=(30, 5))
        self.y = 3 * self.t + np.arange(30)[:, None] + 0.01 * rng.normal(size=(30, 5))

    def fitted(self, scale=None):
        def cost(at):
            return at[0] * self.t + at[1][:, None] - self.y, np.zeros(0)

        def blocks(at):
            return Blocks(cost(at)[0], self.t[..., None], np.ones((30, 5, 1)), np.zeros(0), np.zeros((0, 1)))

        return minimise((0.0, np.zeros(30)), cost, blocks, lambda at, shared, own: (at[0] + shared[0], at[1] + own[:, 0]), scale)

    def test_equals_the_dense_solution(self):
        jacobian = np.hstack((self.t.reshape(-1, 1), np.kron(np.eye(30), np.ones((5, 1)))))
        expected = np.linalg.lstsq(jacobian, self.y.ravel(), rcond=None)[0]
        with unittest.mock.patch("tricoil._levenberg.MOST_STEPS", 3):  # the equations are linear
            slope, own = self.fitted()
        self.assertAlmostEqual(slope, expected[0], 6)
        np.testing.assert_allclose(own, expected[1:], atol=1e-6)

    def test_a_wrong_row_has_little_weight(self):
        self.y[7] = -5 * self.t[7]
        self.assertGreater(abs(self.fitted()[0] - 3), 0.05)
        self.assertAlmostEqual(self.fitted(0.05)[0], 3, 2)

    def test_numbers_that_are_not_finite(self):
        self.y[3, 2] = np.nan
        with self.assertRaisesRegex(ValueError, "does not converge"):
            self.fitted()


class Places(unittest.TestCase):
    def test_too_few_and_flat(self):
        grid = np.stack(np.meshgrid([0.0, 0.1, 0.2], [0.0, 0.1, 0.2], [0.0, 0.1]), axis=-1).reshape(-1, 3)
        check_places(grid)
        check_places(np.vstack((grid, grid + 5e-4)))
        with self.assertRaisesRegex(ValueError, "at 17 places; surroundings need 18"):
            check_places(np.vstack((grid[1:], grid[1:] + 5e-4)))
        with self.assertRaisesRegex(ValueError, "in one plane"):
            check_places(np.vstack((grid, grid + [0.3, 0, 0])) * [1, 1, 0.01])


class Command(FolderCase):
    def setUp(self):
        super().setUp()
        self.data, self.coils = self.path("soYoutZup_seYoutZup_table.csv"), self.path("coils.toml")
        run = ("run", "--scenario", "table", "--fidelity", "columns", "--couplings", self.data)
        stage = self.path("stage.toml")
        with open(stage, "w", encoding="utf-8") as file:
            file.write('duration_s = 5\n[motion]\nkind = "grid"\ncentre_m = [0.45, 0, 0.05]\nnodes = [4, 4, 3]\nspacing_m = [0.1, 0.1, 0.1]\nrest_s = 0.09\n')
        clean = self.path("soYoutZup_seYoutZup_clean.csv")
        for words in (run, ("run", "--duration", "4.32", "--scenario", stage, "--fidelity", "columns", "--couplings", clean),
                      ("calibrate", "stage", "--model", "concentric", "--out", self.coils, clean)):
            done = subprocess.run([os.environ["TRICOIL_PROGRAM"], *words], capture_output=True, text=True)
            self.assertEqual(done.returncode, 0, done.stderr)

    def test_python_and_program_agree(self):
        words = ("calibrate", "surroundings", "--json", "--calibration", self.coils, "--out", self.path("room.toml"), self.data)
        done = subprocess.run([os.environ["TRICOIL_PROGRAM"], *words], capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stderr)
        other = self.path("other.toml")
        result = tricoil.calibrate([self.data], other, "surroundings", calibration=self.coils)
        self.assertEqual(result, {**json.loads(done.stdout), "out": other})
        with open(other, encoding="utf-8") as file, open(self.path("room.toml"), encoding="utf-8") as expected:
            self.assertEqual(file.read(), expected.read())

    def test_model_of_coils_and_dipoles(self):
        room = _tricoil.Surroundings(files_of([self.data], self.path("x.toml"), calibration=self.coils), False, None, None, [1, 0, 0])
        _, poses, _, numbers = room.data()
        self.assertEqual(poses.shape, (27, 30))
        dipoles = rows_of(np.array([[4.0, 0, -5, -5, -4, -6, 0.5, 1, -1], [1, 2, -6, -3, -3, -3, 0, 0, 0]]))
        position_m, attitude = poses[:, :3], poses[:, 3:12].reshape(-1, 3, 3)
        rows = room.model(position_m, attitude, dipoles)
        x, jacobian = numerical_model(numbers)(position_m, attitude, dipoles)
        np.testing.assert_allclose(rows[:, :9], x, rtol=1e-9, atol=1e-12)
        np.testing.assert_allclose(rows[:, 9:].reshape(-1, 9, 6), jacobian, rtol=1e-5, atol=1e-7)

    def test_wrong_arguments(self):
        more = {"calibration": self.coils}
        for options, message in (({"nodes": (3, 3, 3)}, "nodes requires spacing_mm"), ({"hemisphere": (1, 0, 0)}, "hemisphere requires spacing_mm"),
                                 ({"spacing_mm": 200, "hemisphere": (0, 0, 0)}, "not all zero"), ({"spacing_mm": 200, "nodes": (3, 3)}, "nodes needs 3 whole numbers"), ({"spacing_mm": 200, "nodes": (3, 3, 0)}, "must be 1 to 1000"),
                                 ({"spacing_mm": 200, "refit_fixtures": True}, "remove refit_fixtures"), ({"spacing_mm": 5000}, "between 1 and 1000"),
                                 ({"model": "finite"}, "unknown option model")):
            with self.assertRaisesRegex(ValueError, message):
                tricoil.calibrate([self.data], self.path("room.toml"), "surroundings", **more, **options)
        self.assertFalse(os.path.exists(self.path("room.toml")))


if __name__ == "__main__":
    unittest.main()
