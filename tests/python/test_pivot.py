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

    def test_poses_of_any_tracker_without_deviations(self):
        """The standard deviations of the tip are then those of the residuals; they are honest."""
        poses = self.run_.poses[self.run_.poses["valid"]]
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "other.csv")
            with open(path, "w", encoding="utf-8") as file:
                file.write("sensor,time_ms,x_mm,y_mm,z_mm,qw,qx,qy,qz\n")
                file.writelines(f"2,{1e3 * row['time_s']:.3f}," + ",".join(map(repr, [*(1e3 * row["position_m"]).tolist(), *row["quaternion_wxyz"].tolist()])) + "\n"
                                for row in poses)
            result = tricoil.pivot(path)
            self.assertEqual((result["sensor"], result["poses"], result["warnings"]), (2, len(poses), []))
            self.assertEqual(tricoil.command("calibrate pivot", path)["tip_m"], result["tip_m"])
            self.assertEqual(tricoil.pivot(tricoil.read_poses(path))["tip_m"], result["tip_m"])
            with open(path, encoding="utf-8") as file:
                text = file.read()
            with open(path, "w", encoding="utf-8") as file:
                file.write(text.replace("\n2,", "\n4,"))
            fourth = tricoil.pivot(path, out=os.path.join(folder, "tip.toml"))
            self.assertEqual((fourth["sensor"], fourth["tip_m"]), (0, result["tip_m"]))
            self.assertRegex(fourth["warnings"][0], "^sensor 4 of the file is written as sensor 0")
        error = np.array(result["tip_m"]) - TRUE_TIP_M
        self.assertLess(np.linalg.norm(error), 5e-5)
        self.assertLess(error @ np.linalg.solve(result["tip_covariance_m2"], error), 16.3)
        self.assertAlmostEqual(result["residual_sigmas"], 1, delta=0.3)

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
        ):
            with self.assertRaisesRegex(ValueError, message):
                tricoil.pivot(value, **options)
        self.assertRaisesRegex(OSError, "nowhere", tricoil.pivot, "nowhere")
        with tricoil.open("sim:still") as source, self.assertRaisesRegex(ValueError, "covariance_m2: has shape"):
            source.set_tip((0, 0, 0), covariance_m2=[1, 2, 3])


if __name__ == "__main__":
    unittest.main()
