"""A tracker fed with columns."""

import unittest

import numpy as np
import tricoil

SIGMA = 1e-6


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
