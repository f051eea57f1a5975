"""Forward model and solver on arrays."""

import unittest

import numpy as np
import tricoil


def random_poses(count, seed=1):
    rng = np.random.default_rng(seed)
    u = rng.normal(size=(count, 3))
    positions = u / np.linalg.norm(u, axis=1, keepdims=True) * rng.uniform(0.2, 1.0, (count, 1))
    positions[:, 0] = np.abs(positions[:, 0])
    quaternions = rng.normal(size=(count, 4))
    return positions, quaternions / np.linalg.norm(quaternions, axis=1, keepdims=True)


def rotation_matrix(q):
    """Sensor frame to source frame; textbook formula."""
    w, x, y, z = q
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


class Couplings(unittest.TestCase):
    def test_equal_equation_6_in_numpy(self):
        positions, quaternions = random_poses(50)
        x = tricoil.couplings(positions, quaternions)
        for n, (p, q) in enumerate(zip(positions, quaternions)):
            rho = np.linalg.norm(p)
            u = p / rho
            expected = tricoil.COUPLING_CONSTANT / rho**3 * rotation_matrix(q).T @ (1.5 * np.outer(u, u) - 0.5 * np.eye(3))
            np.testing.assert_allclose(x[n], expected, rtol=0, atol=1e-15 + 1e-13 * abs(expected).max())

    def test_one_pose_and_broadcast(self):
        self.assertEqual(tricoil.couplings([0.5, 0, 0]).shape, (3, 3))
        self.assertEqual(tricoil.couplings(np.ones((7, 3)), [1, 0, 0, 0]).shape, (7, 3, 3))
        self.assertEqual(tricoil.couplings([1, 0, 0], np.ones((4, 4))).shape, (4, 3, 3))
        self.assertEqual(tricoil.couplings(np.empty((0, 3))).shape, (0, 3, 3))

    def test_bad_input(self):
        for position, message in (([0, 0, 0], "zero"), ([np.nan, 0, 0], "NaN"), ([1, 2], "shape"), (["a", "b", "c"], "real numbers")):
            with self.assertRaisesRegex((ValueError, TypeError), message):
                tricoil.couplings(position)
        with self.assertRaisesRegex(ValueError, "2 positions and 3 quaternions"):
            tricoil.couplings(np.ones((2, 3)), np.ones((3, 4)))


class Solve(unittest.TestCase):
    def test_inverts_the_forward_model(self):
        positions, quaternions = random_poses(1000)
        rows = tricoil.solve(tricoil.couplings(positions, quaternions), 1e-6)
        self.assertTrue(rows["solved"].all())
        np.testing.assert_allclose(rows["position_m"], positions, atol=1e-12)
        np.testing.assert_allclose(np.abs(np.sum(rows["quaternion_wxyz"] * quaternions, axis=1)), 1, atol=1e-12)

    def test_covariance_is_that_of_the_noise(self):
        count, sigma = 20000, 1e-5
        position, quaternion = np.array([0.4, 0.3, -0.2]), np.array([0.8, 0.2, -0.4, 0.4])
        x = tricoil.couplings(position, quaternion)
        noisy = x + np.random.default_rng(2).normal(scale=sigma, size=(count, 3, 3))
        rows = tricoil.solve(noisy, sigma, hemisphere=position)
        errors = rows["position_m"] - position
        measured = errors.T @ errors / count
        expected = rows["covariance"][:, :3, :3].mean(axis=0)
        np.testing.assert_allclose(measured, expected, rtol=0.05, atol=0.05 * np.trace(expected) / 3)
        self.assertAlmostEqual(rows["chi_square"].mean(), 3, delta=0.1)

    def test_hemisphere_selects_the_side(self):
        x = tricoil.couplings([0.5, 0.1, 0])
        np.testing.assert_allclose(tricoil.solve(x, 1e-6, hemisphere=[-1, 0, 0])["position_m"], [-0.5, -0.1, 0], atol=1e-12)

    def test_rows_without_solution_are_nan(self):
        x = tricoil.couplings(np.full((4, 3), 0.3))
        x[0] = np.nan
        x[1] = 0
        x[2, 0] *= -1  # reversed sensor coil
        rows = tricoil.solve(x, 1e-6)
        self.assertEqual(rows["solved"].tolist(), [False, False, False, True])
        self.assertTrue(np.isnan(rows["position_m"][:3]).all())

    def test_bad_input(self):
        x = np.eye(3)
        for arguments, message in (
            ((np.ones((2, 3)), 1), r"X: has shape \(2, 3\); give \(3, 3\) or \(N, 3, 3\)"),
            ((x, 0), "sigma: must be positive"),
            ((x, np.nan), "sigma: must be positive"),
            ((x, np.inf), "sigma: must be positive and finite"),
            ((x[np.newaxis], [1, 2]), r"sigma: has shape \(2,\)"),
            ((x + 1j, 1), "X: must be real numbers; has dtype complex128"),
            (([[1, 2], [3]], 1), "X: not an array"),
        ):
            with self.assertRaisesRegex((ValueError, TypeError), message):
                tricoil.solve(*arguments)
        with self.assertRaisesRegex(ValueError, "hemisphere"):
            tricoil.solve(x, 1, hemisphere=[0, 0, 0])
        with self.assertRaisesRegex(ValueError, "coupling_constant"):
            tricoil.solve(x, 1, coupling_constant=-1)


if __name__ == "__main__":
    unittest.main()
