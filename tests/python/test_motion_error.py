"""Motion error from poses alone: prediction and correction, on hands that the product simulates."""

import unittest
from unittest import mock

import numpy as np
import tricoil
from motion_cases import DURATION_S, FRAME, SLOT_S, Case, deskewed_rms_m, errors_m, rms, simulated, smoothed_rms_m
from scipy.spatial.transform import Rotation
from tricoil import _motion_analysis
from tricoil._pose_path import PosePath


class Prediction(unittest.TestCase):
    def test_predicts_the_error_of_each_pose(self):
        case = simulated(step=FRAME)
        result = tricoil.motion_error(case.poses, "tdm:3/720")
        true = case.without_noise_truth - case.without_noise_poses
        inside = case.inside
        left = result.rows["total"][inside, :3] - true[inside]
        self.assertLess(rms(left), 0.05 * rms(true[inside]))
        stated = np.sqrt(np.mean(np.sum(result.rows["total_deviation"][inside, :3] ** 2, axis=1)))
        self.assertTrue(0.7 < rms(left) / stated < 1.3, rms(left) / stated)

    def test_causes_add_up(self):
        rows = tricoil.motion_error(simulated(step=FRAME).poses, "tdm:3/720,latency=4").rows
        total = sum(rows[cause] for cause in ("skew", "blur", "linearization", "latency"))
        np.testing.assert_allclose(rows["total"], total)
        self.assertGreater(rms(rows["latency"][:, :3]), rms(rows["skew"][:, :3]) / 10)
        self.assertLess(np.abs(rows["linearization"]).max(), 1e-12)

    def test_the_previous_measurement_technique_has_a_linearization_error(self):
        case = simulated(step=1, tracker="previous", noise=False)
        rows = tricoil.motion_error(case.poses, "tdm:3/720,solver=previous").rows
        self.assertGreater(rms(rows["linearization"][case.inside, :3]), 0)
        self.assertLess(rms(rows["linearization"][case.inside, :3]), 0.1 * rms(rows["skew"][case.inside, :3]))


class Correction(unittest.TestCase):
    def test_without_noise_fifty_times_better(self):
        for step, tracker, timing in ((FRAME, "direct", "tdm:3/720"), (2 * FRAME, "direct", "tdm:3/720"), (1, "direct", "tdm:3/720"),
                                      (FRAME, "previous", "tdm:3/720,solver=previous"), (1, "previous", "tdm:3/720,solver=previous")):
            with self.subTest(step=step, tracker=tracker):
                case = simulated(step=step, tracker=tracker, noise=False)
                corrected = tricoil.motion_error(case.poses, timing).corrected
                self.assertLess(50 * rms(errors_m(case, corrected)), rms(errors_m(case)))

    def test_with_noise_as_good_as_a_tracker_that_had_the_columns(self):
        for step in (FRAME, 2 * FRAME, 1):
            with self.subTest(step=step):
                case = simulated(step=step)
                result = tricoil.motion_error(case.poses, "tdm:3/720")
                corrected, smoothed = (rms(errors_m(case, one)) for one in (result.corrected, result.smoothed))
                deskewed, at_deskewed = deskewed_rms_m(case, result.corrected)
                self.assertLess(at_deskewed, deskewed)
                self.assertLess(smoothed, 1.5 * smoothed_rms_m(case))
                self.assertLess(corrected, 1.02 * rms(errors_m(case)))
                for one, error in ((result.corrected, corrected), (result.smoothed, smoothed)):
                    stated = np.sqrt(np.mean(np.trace(one.covariance[case.inside, :3, :3], axis1=1, axis2=2)))
                    self.assertTrue(0.8 < error / stated < 1.3, error / stated)

    def test_long_recordings_are_analysed_in_pieces(self):
        case = simulated(step=FRAME)
        whole = tricoil.motion_error(case.poses, "tdm:3/720")
        with mock.patch.multiple(_motion_analysis, PIECE=150, AROUND=100):
            pieces = tricoil.motion_error(case.poses, "tdm:3/720")
        np.testing.assert_allclose(pieces.corrected.position_m, whole.corrected.position_m, atol=1e-6)
        self.assertLess(rms(errors_m(case, pieces.smoothed)), 1.3 * rms(errors_m(case, whole.smoothed)))

    def test_fdm_is_left_alone(self):
        poses = tricoil.run("hand", mux="fdm", duration_s=2, fidelity="columns").poses
        corrected = tricoil.motion_error(poses, "fdm:240").corrected
        np.testing.assert_array_equal(corrected.position_m, poses["position_m"][poses["valid"]])

    def test_poses_beside_a_gap_and_after_it_are_corrected(self):
        case = simulated(step=FRAME, noise=False)
        without = np.delete(case.poses, slice(200, 240))
        result = tricoil.motion_error(without, "tdm:3/720")
        self.assertTrue(result.corrected.is_corrected.all())
        keep = np.delete(case.inside, slice(200, 240))
        keep[185:215] = False
        truth = np.delete(case.truth, slice(200, 240), axis=0)
        self.assertLess(rms((result.corrected.position_m - truth)[keep]), rms((without["position_m"] - truth)[keep]) / 50)


class Timing(unittest.TestCase):
    def test_order_and_names(self):
        case = simulated(step=FRAME, noise=False)
        wrong = tricoil.motion_error(case.poses, "tdm:3/720,order=321").corrected
        self.assertGreater(rms(errors_m(case, wrong)), rms(errors_m(case)))
        named = tricoil.motion_error(case.poses, "tricoil-tdm").corrected
        self.assertLess(50 * rms(errors_m(case, named)), rms(errors_m(case)))
        for name, (description, _) in tricoil.TIMINGS.items():
            self.assertTrue(description, name)

    def test_every_result_says_what_was_assumed(self):
        result = tricoil.motion_error(simulated(step=FRAME).poses, "liberty,latency=3.5")
        self.assertEqual(result.timing.describe(), "S1 S2 S3 in turn, 1.389 ms apart, 3 slots a frame; window 1.389 ms, latency 3.5 ms, direct solver")

    def test_unknown_or_impossible(self):
        poses = simulated(step=FRAME).poses
        for timing, message in (
            ("libert", "did you mean 'liberty'"),
            ("tdm", "tdm:SLOTS/RATE"),
            ("tdm:2/720", "3 to 16 slots"),
            ("tdm:3/0", "rate of slots must be a number of 1 to 100000"),
            ("tdm:3/100", "a slot of 10 ms is longer than the pose interval of 4.167 ms"),
            ("tdm:3/500", "a frame of 3 slots, 6 ms, is longer than the pose interval"),
            ("tdm:4/720", "a frame of 4 slots"),
            ("tdm:3/720,order=112", "order must name each coil once"),
            ("tdm:3/720,latency=-1", "latency in ms must be a number of 0 to 100"),
            ("tdm:3/720,solver=svd", "solver must be direct, previous"),
            ("fdm,solver=previous", "is for tdm"),
            ("tdm:3/720,slot=3", "unknown option 'slot=3'"),
            ("aurora", "more than three coils"),
        ):
            with self.subTest(timing=timing), self.assertRaisesRegex(ValueError, message):
                tricoil.motion_error(poses, timing)


class Reference(unittest.TestCase):
    def reference(self, case, rate_hz=200):
        """The true path in another frame and clock, with noise of 0.1 mm."""
        time_s = np.arange(case.poses["time_s"][0], case.poses["time_s"][-1], 1 / rate_hz)
        truth = case.run.truth
        path = PosePath(case.run.poses["time_s"], truth["position_m"], truth["quaternion_wxyz"])
        position_m, quaternion = path(time_s)
        position_m = position_m[:, [1, 2, 0]] + (0.3, -0.2, 1) + np.random.default_rng(4).normal(0, 1e-4, position_m.shape)
        cyclic = Rotation.from_matrix([[0, 1, 0], [0, 0, 1], [1, 0, 0]]) * Rotation.from_quat(quaternion[:, [1, 2, 3, 0]])
        return tricoil.Poses(time_s + 5, position_m, cyclic.as_quat()[:, [3, 0, 1, 2]], "reference")

    def test_finds_order_and_slots(self):
        for step, first in ((FRAME, 0), (FRAME, 1), (1, 0)):
            with self.subTest(step=step, first=first):
                case = simulated(step=step, first=first)
                result = tricoil.motion_error(case.poses, "fit", reference=self.reference(case))
                self.assertAlmostEqual(result.timing.slot_s, SLOT_S, delta=0.02 * SLOT_S)
                self.assertLess(rms(errors_m(case, result.corrected)), 0.3 * rms(errors_m(case)))

    def test_leaves_fdm_and_own_deskew_alone(self):
        for options in ({"mux": "fdm"}, {"mux": "tdm", "tracker": "scaat"}):
            with self.subTest(**options):
                run = tricoil.run("hand", duration_s=DURATION_S, fidelity="columns", **options)
                poses = run.poses[run.poses["valid"]]
                case = Case(run, 1, None, poses, None, None, None, None)
                result = tricoil.motion_error(poses, "fit", reference=self.reference(case))
                self.assertFalse(result.timing.is_sequential)
                np.testing.assert_array_equal(result.corrected.position_m, poses["position_m"])

    def test_fit_needs_a_reference(self):
        with self.assertRaisesRegex(ValueError, "needs a reference"):
            tricoil.motion_error(simulated(step=FRAME).poses, "fit")


class BadPoses(unittest.TestCase):
    def test_refused_in_one_line(self):
        poses = simulated(step=FRAME).poses

        def changed(field, rows, value):
            other = poses.copy()
            other[field][rows] = value
            return other

        wrapped = poses.copy()
        wrapped["time_s"][300:] -= 2**32 * 1e-6
        held = poses.copy()
        held[100:200] = held[100]
        held["time_s"] = poses["time_s"]
        for bad, message in (
            (poses[:1], "has 1 pose; give at least 20"),
            (changed("position_m", 17, np.nan), "pose 17: the position is not finite"),
            (changed("quaternion_wxyz", 17, 3.0), "quaternion has length"),
            (changed("position_m", 17, 0.0), "position of zero"),
            (wrapped, "32-bit counter"),
            (held, "repeat the one before"),
            (poses[np.arange(len(poses)) // 10 % 2 == 0], "no 20 poses follow each other"),
        ):
            with self.subTest(message=message), self.assertRaisesRegex(ValueError, message) as caught:
                tricoil.motion_error(bad, "tdm:3/720")
            self.assertNotIn("\n", str(caught.exception))

    def test_other_types(self):
        with self.assertRaisesRegex(TypeError, "read_poses"):
            tricoil.motion_error([1, 2, 3], "fdm")


if __name__ == "__main__":
    unittest.main()
