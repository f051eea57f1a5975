"""A tracker fed with columns."""

import pathlib
import tempfile
import unittest

import numpy as np
import tricoil

SIGMA = 1e-6

SEPARATE_COILS = """version = 1
model = "general"
residual_rms = 0.001
misfit_floor = 0.0001
[source]
moment = [[0.0012, 0, 0], [0, 0.00121, 0], [0, 0, 0.00126]]
offset_m = [[0.03, -0.015, -0.015], [-0.015, 0.03, -0.015], [-0.015, -0.015, 0.03]]
octupole_m2 = [0, 0, 0]
[sensor]
sensitivity = [[0.995, 0, 0], [0, 0.99, 0], [0, 0, 1.015]]
offset_m = [[0, 0, 0], [0, 0, 0], [0, 0, 0]]
octupole_m2 = [0, 0, 0]
[output]
hemisphere = [1, 0, 0]
linear = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
offset_m = [0, 0, 0]
"""


def columns(position, quaternion, frames, rate_hz=240.0):
    """Columns of simultaneous signal matrices."""
    x = tricoil.couplings(position, quaternion)
    for frame in range(frames):
        for coil in range(3):
            yield frame / rate_hz, coil, x[:, coil]


class Filter(unittest.TestCase):
    def test_finds_a_resting_sensor(self):
        position, quaternion = np.array([0.5, 0.2, 0.1]), np.array([0.5, 0.5, -0.5, 0.5])
        for method in ("scaat", "direct", "previous"):
            tracker = tricoil.Filter(method, hemisphere=position)
            poses = [tracker.update(time_s, coil, x, SIGMA) for time_s, coil, x in columns(position, quaternion, 100)]
            last = [pose for pose in poses if pose is not None][-1]
            self.assertTrue(last.valid, method)
            np.testing.assert_allclose(last.position_m, position, atol=1e-4)
            self.assertAlmostEqual(abs(last.quaternion_wxyz @ quaternion), 1, places=6)

    def test_uses_calibrated_coils(self):
        position, quaternion = np.array([0.2, 0.05, -0.03]), np.array([0.5, 0.5, -0.5, 0.5])
        with tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder) / "coils.toml"
            file.write_text(SEPARATE_COILS)
            x = tricoil.couplings(position, quaternion, calibration=file)
            row = tricoil.solve(x, SIGMA, calibration=file)
            tracker = tricoil.Filter(calibration=file)
        self.assertTrue(row["solved"])
        np.testing.assert_allclose(row["position_m"], position, atol=1e-8)
        self.assertLess(row["chi_square"], 1e-3)
        self.assertTrue(np.all(np.diag(row["covariance"]) > 0))
        ideal = tricoil.solve(x, SIGMA, coupling_constant=1.2e-3)
        self.assertGreater(np.linalg.norm(ideal["position_m"] - position), 5e-3)
        poses = [tracker.update(frame / 240, coil, x[:, coil], SIGMA) for frame in range(100) for coil in range(3)]
        np.testing.assert_allclose([pose for pose in poses if pose is not None][-1].position_m, position, atol=1e-4)
        with self.assertRaisesRegex(ValueError, "missing.toml"):
            tricoil.solve(x, SIGMA, calibration="missing.toml")

    def test_refuses_bad_columns(self):
        tracker = tricoil.Filter()
        for arguments, message in (
            ((0, 3, [1, 2, 3], 1e-6), "source_coil"),
            ((0, 0, [1, 2], 1e-6), "couplings: has shape"),
            ((float("inf"), 0, [1, 2, 3], 1e-6), "time_s"),
            ((0, 0, [1, 2, 3], [1, 2]), "sigma: has shape"),
        ):
            with self.assertRaisesRegex(ValueError, message):
                tracker.update(*arguments)
        for method in ("scaat", "direct"):
            tracker = tricoil.Filter(method)
            self.assertIsNone(tracker.update(0, 0, [np.nan] * 3, 1e-6), "refused by the tracker itself")

    def test_refuses_bad_settings(self):
        for arguments, message in (
            ({"method": "kalman"}, "direct"),
            ({"coupling_constant": 0}, "tracker"),
            ({"hemisphere": [np.nan, 0, 0]}, "tracker"),
            ({"window_s": -1}, "tracker"),
            ({"column_span_s": -1}, "tracker"),
        ):
            with self.assertRaisesRegex(ValueError, message):
                tricoil.Filter(**arguments)


if __name__ == "__main__":
    unittest.main()
