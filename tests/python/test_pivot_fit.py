"""Tip of a pointer: errors against the covariance of the result, outliers, and motions that do not determine the tip."""

import unittest

import numpy as np
from scipy.spatial.transform import Rotation
from tricoil import _pivot_fit

TIP_M = np.array([0.14, -0.01, 0.03])
PIVOT_M = np.array([0.5, 0.2, -0.1])


def point(seed, poses=300, tilt_rad=(0.4, 0.4, 0.4), position_sigma_m=1e-4, rotation_sigma_rad=5e-4, correlation=0.0, stated=1.0):
    """Poses with errors that are correlated between position and rotation. correlation: of successive errors. stated: standard deviations
    in the poses, relative to the true ones."""
    rng = np.random.default_rng(seed)
    root = np.diag([position_sigma_m] * 3 + [rotation_sigma_rad] * 3)
    root[0, 4] = root[1, 3] = position_sigma_m / 2
    noise = rng.normal(size=(poses, 6))
    for n in range(1, poses if correlation else 1):
        noise[n] = correlation * noise[n - 1] + np.sqrt(1 - correlation**2) * noise[n]
    errors = noise @ root.T
    t = 0.2 * np.arange(poses) * 300 / poses
    turn = Rotation.from_rotvec(np.array(tilt_rad) * np.column_stack((np.sin(t), np.sin(1.618 * t), np.sin(0.618 * t))))
    position_m = PIVOT_M - turn.apply(TIP_M) + errors[:, :3]
    xyzw = (Rotation.from_rotvec(errors[:, 3:]) * turn).as_quat()
    return [position_m, xyzw[:, [3, 0, 1, 2]], np.tile(stated**2 * root @ root.T, (poses, 1, 1))]


def calibrate(poses):
    return _pivot_fit.calibrate(*poses, "take")


class Errors(unittest.TestCase):
    def monte_carlo(self, runs, **options):
        """Mean square in standard deviations (3 if the covariance is correct), mean error in its standard deviations, largest error."""
        squares, errors, deviations = [], [], []
        for seed in range(1, runs + 1):
            found = calibrate(point(seed, **options))
            error = np.array(found["tip_m"]) - TIP_M
            squares.append(error @ np.linalg.solve(found["tip_covariance_m2"], error))
            errors.append(error)
            deviations.append(found["tip_std_m"])
        bias = np.sum(np.array(errors) / deviations, axis=0) / np.sqrt(runs)
        return np.mean(squares), np.max(np.abs(bias)), np.max(np.linalg.norm(errors, axis=1))

    def test_covariance_of_the_tip_is_that_of_its_errors(self):
        squares, bias, worst_m = self.monte_carlo(200)
        self.assertGreater(squares, 2.5)
        self.assertLess(squares, 3.3)
        self.assertLess(bias, 3.5)
        self.assertLess(worst_m, 0.15e-3)

    def test_covariance_includes_the_correlation_of_successive_errors(self):
        """Errors of a filter: 0.1 s at 240 Hz. Independent errors would have a covariance that is about 20 times smaller."""
        squares, _, _ = self.monte_carlo(30, poses=3000, correlation=0.96)
        self.assertGreater(squares, 1.7)
        self.assertLess(squares, 4.4)

    def test_covariance_follows_the_residuals(self):
        """Poses whose stated standard deviations are half of their true errors."""
        squares, _, _ = self.monte_carlo(100, stated=0.5)
        self.assertGreater(squares, 2.2)
        self.assertLess(squares, 3.9)
        self.assertAlmostEqual(calibrate(point(1, stated=0.5))["residual_sigmas"], 2, delta=0.2)

    def test_without_stated_deviations_the_residuals_are_them(self):
        squares, _, _ = self.monte_carlo(100, stated=0)
        self.assertGreater(squares, 2.2)
        self.assertLess(squares, 3.8)
        self.assertAlmostEqual(calibrate(point(1, stated=0))["residual_sigmas"], 1, delta=0.1)
        self.assertRaisesRegex(ValueError, "is not at rest", calibrate, point(1, stated=0, position_sigma_m=0.02))

    def test_errors_of_the_attitude_do_not_shorten_the_tip(self):
        """Without the correction of the attitudes' errors, the tip is shorter by ten standard deviations."""
        squares, bias, _ = self.monte_carlo(50, poses=1000, rotation_sigma_rad=0.02, tilt_rad=(0.25, 0.25, 0.25))
        self.assertLess(bias, 4)
        self.assertLess(squares, 3.9)

    def test_outlying_poses_are_left_out(self):
        poses = point(7)
        clean = calibrate(poses)["tip_m"]
        poses[0][::3] += np.column_stack((np.full(100, 0.02), np.full(100, 0.05), np.where(np.arange(100) % 2 == 0, 0.1, -0.3)))
        found = calibrate(poses)  # one third of the poses, as before and after the tip was in its hole
        self.assertEqual(found["outliers"], 100)
        self.assertEqual(found["warnings"][0], "100 of 300 poses are outliers; was the tip at rest?")
        self.assertLess(np.linalg.norm(np.subtract(found["tip_m"], clean)), 5e-5)

    def test_without_noise(self):
        found = calibrate(point(1, position_sigma_m=0, rotation_sigma_rad=0))
        self.assertLess(np.linalg.norm(found["tip_m"] - TIP_M), 1e-9)
        self.assertEqual(found["outliers"], 0)


class Refusals(unittest.TestCase):
    def refuse(self, poses, why):
        with self.assertRaisesRegex(ValueError, f"^take: .*{why}"):
            calibrate(poses)

    def test_rotation_about_one_axis(self):
        for axis in 0.5 * np.eye(3):
            self.refuse(point(3, tilt_rad=axis), "about one axis only")
            self.refuse(point(3, tilt_rad=axis + 0.03), "about one axis only")  # trembling
            self.refuse(point(3, tilt_rad=axis, position_sigma_m=0, rotation_sigma_rad=0), "about one axis only")

    def test_rotation_about_one_axis_with_large_noise(self):
        """Noise looks like rotation about all axes."""
        self.refuse(point(3, tilt_rad=(0, 0, 0.5), rotation_sigma_rad=0.1), "about one axis only")

    def test_too_little_rotation(self):
        self.refuse(point(3, tilt_rad=(0.05, 0.05, 0.05)), "the poses turn by only ")
        self.refuse(point(3, tilt_rad=(0, 0, 0)), "the poses turn by only ")

    def test_a_tip_that_moves(self):
        poses = point(3)
        poses[0][:, 0] += 2e-5 * np.arange(300)  # slides by 6 mm
        self.refuse(poses, "the tip is not at rest")

    def test_few_poses(self):
        self.refuse([part[:9] for part in point(3)], "9 valid poses; at least 10")
        self.refuse([part[:0] for part in point(3)], "0 valid poses")


if __name__ == "__main__":
    unittest.main()
