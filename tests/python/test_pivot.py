"""Tip of a pointer from simulated poses."""

import os
import tempfile
import unittest

import numpy as np
import tricoil

TRUE_TIP_M = (0.15, 0, 0.02)  # of the scenario


class Pivot(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.run_ = tricoil.run("pointer", tracker="scaat", mux="tdm", duration_s=10, fidelity="columns")

    def test_tip_from_arrays_is_used_by_a_source(self):
        tip = tricoil.pivot(self.run_.poses)
        np.testing.assert_allclose(tip["tip_m"], TRUE_TIP_M, atol=1e-5)
        np.testing.assert_allclose(tip["pivot_m"], (0.6, 0, 0), atol=1e-5)
        with tricoil.open("sim:pointer,duration_s=0.2") as source:
            source.set_tip(tip["tip_m"], covariance_m2=np.eye(3))
            pose = [pose for pose in source if pose.valid][-1]
        np.testing.assert_allclose(pose.position_m, (0.6, 0, 0), atol=1e-3)
        np.testing.assert_allclose(pose.position_std_m, np.ones(3), atol=1e-3)

    def test_recording_and_array_agree(self):
        with tempfile.TemporaryDirectory() as folder:
            take = os.path.join(folder, "take")
            tricoil.run("pointer", duration_s=5, record=take, fidelity="columns")
            out = os.path.join(folder, "tip.toml")
            result = tricoil.pivot(take, out=out)
            np.testing.assert_allclose(result["tip_m"], tricoil.pivot(tricoil.load(take))["tip_m"], atol=1e-9)
            self.assertTrue(os.path.exists(out))

    def test_bad_input(self):
        poses = self.run_.poses
        broken = poses.copy()
        broken["position_m"][-1] = np.nan
        mixed = poses.copy()
        mixed["sensor"][:5] = 1
        still = np.repeat(poses[-1:], 100)
        for value, options, message in (
            (np.zeros((5, 3)), {}, "field position_m"),
            (poses.reshape(1, -1), {}, "one dimension"),
            (broken, {}, "position_m: a valid pose"),
            (mixed, {}, "poses of sensors 0, 1"),
            (mixed, {"sensor": 1}, "valid poses; at least 10"),
            (mixed, {"sensor": 7}, "sensor: must be 0 to 3"),
            (poses[:0], {}, "0 valid poses"),
            (still, {}, "does not determine the tip"),
            ("nowhere", {}, "nowhere"),
        ):
            with self.assertRaisesRegex(ValueError, message):
                tricoil.pivot(value, **options)
        with tricoil.open("sim:still") as source, self.assertRaisesRegex(ValueError, "covariance_m2: has shape"):
            source.set_tip((0, 0, 0), covariance_m2=[1, 2, 3])


if __name__ == "__main__":
    unittest.main()
