"""Poses from simulated couplings in two bands near moving metal, and the parts of their estimator."""

import dataclasses
import json
import os
import tempfile
import unittest
import warnings

import numpy as np
import tricoil
from scipy.spatial.transform import Rotation
from tricoil import _couplings_command
from tricoil._band_files import COLUMNS
from tricoil._band_scalar import BandScalar
from tricoil._coil_model import Coils
from tricoil._coil_solver import refine, solve_cold
from tricoil._dual_rate import DualRateParams, dual_rate
from tricoil._pose_track import follow
from tricoil._rotation import rotations, wxyz
from tricoil._split_filter import SplitFilter, SplitParams
from two_bands import ALUMINIUM, COUPLING, STEEL_304, TITANIUM, Scene, calibration, coils, truth_wxyz, two_bands

NO_SIDE = np.zeros(3)


@dataclasses.dataclass
class Score:
    high_rms_m: float  # error of the high band alone
    rms_m: float
    rotation_rms_rad: float
    within_5_sigma: float  # share of rows with all three errors within 5 sigma
    valid: float  # share of rows
    roc_area: float  # of the distortion figure, for errors of the high band above 1 mm
    poses: object


def rms(values):
    return float(np.sqrt(np.mean(np.square(values))))


def roc_area(value, is_true):
    """Share of pairs (true, false) in which the true one has the higher value."""
    rank = np.argsort(np.argsort(value)) + 1
    trues, falses = is_true.sum(), (~is_true).sum()
    return (rank[is_true].sum() - trues * (trues + 1) / 2) / (trues * falses) if trues and falses else 0


def track(scene, data=None, scalar=None, holds=False):
    """Scored from half a second before the metal comes."""
    data = data or two_bands(scene)
    params = DualRateParams(row_period_s=1 / scene.rate_hz, rows_per_line=scene.ratio, scalar=scalar, filter=not holds)
    poses, lines, found = dual_rate(data.high_coils, data.low_coils, data.high, data.low, params)
    assert lines == len(data.low)
    rows = slice(int((scene.metal_from_s - 0.5) * scene.rate_hz), None)
    high = refine(data.high_coils, data.high[rows], data.position_m[rows], truth_wxyz(data)[rows], 1)
    high_error = np.linalg.norm(high.position_m - data.position_m[rows], axis=1)
    error, some = poses.position_m[rows] - data.position_m[rows], poses[rows]
    turned = (rotations(some.quaternion_wxyz) * data.turn[rows].inv()).magnitude()
    score = Score(rms(high_error), rms(np.linalg.norm(error, axis=1)), rms(turned), np.mean(abs(error).max(axis=1) < 5 * some.position_sigma_m),
                  np.mean(some.is_valid), roc_area(some.distortion_m, high_error > 1e-3), poses)
    print(f"high band {1e3 * score.high_rms_m:.3f} mm RMS; both {1e3 * score.rms_m:.4f} mm, {1e3 * score.rotation_rms_rad:.3f} mrad; within 5 sigma "
          f"{score.within_5_sigma:.4f}, valid {score.valid:.4f}, ROC area {score.roc_area:.5f}, scalar {found.value:.4f} (true {data.share / (1 - data.share):.4f})")
    return score


class DualRate(unittest.TestCase):
    def test_resting_sensor_beside_moving_metal(self):
        for sphere, seed in ((STEEL_304, 22), (TITANIUM, 5)):  # paths on which the high band is off by more than 0.5 mm
            score = track(Scene(seed=seed, sphere=sphere, sensor_moves=False, ratio=128, metal_from_s=4))
            self.assertGreater(score.high_rms_m, 5e-4)
            self.assertLess(score.rms_m, score.high_rms_m / 10)
            self.assertLess(score.rms_m, 5e-5)
            self.assertGreaterEqual(score.within_5_sigma, 0.99)
            self.assertEqual(score.valid, 1)

    @classmethod
    def setUpClass(cls):
        cls.usual = two_bands(Scene())
        cls.score = track(Scene(), cls.usual)

    def test_hand_and_metal_both_move(self):
        for sphere, seed in ((STEEL_304, 1), (STEEL_304, 2), (TITANIUM, 1), (TITANIUM, 3)):
            with self.subTest(sphere=sphere, seed=seed):
                scene = Scene(seed=seed, sphere=sphere)
                score = self.score if scene == Scene() else track(scene)
                self.assertLess(score.rms_m, score.high_rms_m / 3)
                self.assertGreaterEqual(score.within_5_sigma, 0.99)
                self.assertGreaterEqual(score.roc_area, 0.999)
                self.assertGreater(score.valid, 0.99)

    def test_thick_aluminium_is_extrapolated_with_a_large_scalar(self):
        scene = Scene(sphere=ALUMINIUM)
        data = two_bands(scene)
        estimated = track(scene, data)
        self.assertLess(estimated.rms_m, estimated.high_rms_m / 3)
        self.assertGreaterEqual(estimated.within_5_sigma, 0.99)
        given = track(scene, data, data.share / (1 - data.share))
        self.assertLess(given.rms_m, given.high_rms_m / 3)

    def test_the_filter_is_better_than_the_held_bias(self):
        held = track(Scene(), self.usual, holds=True)
        self.assertLess(self.score.rms_m, held.rms_m / 2)
        self.assertGreaterEqual(held.within_5_sigma, 0.99)

    def test_rows_are_causal(self):
        scene = Scene(duration_s=5)
        data = two_bands(scene)
        cut = dataclasses.replace(data, high=data.high[:6000], low=data.low[:6000 // scene.ratio + 1])
        params = DualRateParams(rows_per_line=scene.ratio)
        every, first = (dual_rate(one.high_coils, one.low_coils, one.high, one.low, params)[0] for one in (data, cut))
        for name in ("position_m", "quaternion_wxyz", "position_sigma_m", "distortion_m"):
            np.testing.assert_array_equal(getattr(every, name)[:6000], getattr(first, name))


    def test_a_bias_that_diverges_is_no_error(self):
        """After jumps that no sensor makes."""
        data = two_bands(Scene(seed=3, duration_s=20))
        random = np.random.default_rng(1)
        data.high[3000:3070] = random.normal(size=(70, 9))
        data.high[5000:5040] = data.high[1000:1040]
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            poses, _, scalar = dual_rate(data.high_coils, data.low_coils, data.high, data.low, DualRateParams(rows_per_line=32))
        self.assertTrue(np.isfinite(scalar.value) and np.isfinite(scalar.sigma))
        self.assertGreater(poses.is_valid[:5000].mean(), 0.95)
        self.assertTrue(np.isfinite(poses.position_m[poses.is_valid]).all())


class Track(unittest.TestCase):
    def rows(self, degrees):
        turn = Rotation.from_rotvec(np.radians(degrees)[:, None] * [0, 0, 1])
        return coils().couplings(np.tile([0.3, 0.1, 0.08], (len(turn), 1)), turn.as_matrix())[0]

    def test_quaternion_is_continuous_over_a_loss(self):
        x = np.concatenate((self.rows(190 + 0.25 * np.arange(401)), np.ones((1, 9)), self.rows(np.array([300.0]))))
        track = follow(coils(), x, 1, NO_SIDE, 0.1)
        self.assertEqual(np.flatnonzero(~track.is_solved).tolist(), [401])
        self.assertEqual(np.flatnonzero(track.is_start).tolist(), [0, 402])
        self.assertTrue((np.sum(track.quaternion_wxyz[1:] * track.quaternion_wxyz[:-1], axis=1) > 0.99).all())
        np.testing.assert_allclose(track.turned_rad[400:, 2], np.radians(100), atol=1e-6)  # the loss is not a turn

    def test_a_lost_pose_is_found_from_the_last_one_within_a_line(self):
        x = np.concatenate((self.rows(np.zeros(3)), np.ones((3, 9)), self.rows(np.ones(4))))
        for ratio, starts in ((32, [0]), (5, [0, 6])):
            track = follow(coils(), x, ratio, NO_SIDE, 0.1)
            self.assertEqual(np.flatnonzero(track.is_start).tolist(), starts)
            self.assertEqual(np.flatnonzero(~track.is_solved).tolist(), [3, 4, 5])

    def test_no_couplings_of_a_dipole_have_no_pose(self):
        for x in (np.ones(9), np.zeros(9), np.full(9, np.nan), -self.rows(np.zeros(1))[0]):
            track = follow(coils(), x[None], 4, NO_SIDE, 0.1)
            self.assertFalse(track.is_solved.any())
            self.assertFalse(track.is_known.any())


class CoilModel(unittest.TestCase):
    def setUp(self):
        random = np.random.default_rng(5)
        self.position_m, self.turn = random.uniform(-0.5, 0.5, (20, 3)), Rotation.random(20, random_state=5)
        self.position_m += 0.2 * self.position_m / np.linalg.norm(self.position_m, axis=1, keepdims=True)
        self.coils = Coils(*(scale * random.normal(size=(3, 3)) + np.eye(3) * size for scale, size in ((0.02, 0), (0.05, 1), (0.005, 0), (0.05, 1))))

    def test_concentric_coils_agree_with_the_core(self):
        ideal = Coils(np.zeros((3, 3)), COUPLING * np.eye(3), np.zeros((3, 3)), np.eye(3))
        x, _ = ideal.couplings(self.position_m, self.turn.as_matrix())
        core = tricoil.couplings(self.position_m, wxyz(self.turn), coupling_constant=COUPLING)
        np.testing.assert_allclose(x.reshape(-1, 3, 3).swapaxes(1, 2), core, rtol=1e-12, atol=1e-15)

    def test_offsets_are_distances_of_dipoles(self):
        x, _ = self.coils.couplings(self.position_m, self.turn.as_matrix())
        for n, turn in enumerate(self.turn.as_matrix()):
            for j in range(3):
                for i in range(3):
                    r = self.position_m[n] + turn @ self.coils.sensor_m[i] - self.coils.source_m[j]
                    field = 3 * r * (r @ self.coils.moment[j]) / np.linalg.norm(r)**5 - self.coils.moment[j] / np.linalg.norm(r)**3
                    self.assertAlmostEqual(x[n, 3 * j + i], turn @ self.coils.sensitivity[i] @ field / 2, delta=1e-12 * abs(x[n]).max())

    def test_jacobian(self):
        _, jacobian = self.coils.couplings(self.position_m, self.turn.as_matrix())
        step = 1e-6
        for k in range(6):
            d = step * np.eye(6)[k]
            ends = [self.coils.couplings(self.position_m + s * d[:3], (Rotation.from_rotvec(s * d[3:]) * self.turn).as_matrix())[0] for s in (1, -1)]
            numeric = (ends[0] - ends[1]) / (2 * step)
            np.testing.assert_allclose(jacobian[..., k], numeric, atol=1e-6 * abs(jacobian[..., k]).max())

    def test_cold_start_finds_poses_of_coils_apart(self):
        x, _ = self.coils.couplings(self.position_m, self.turn.as_matrix())
        for n, row in enumerate(x):
            for side in (NO_SIDE, self.position_m[n]):
                fit = solve_cold(self.coils, row, side, 0.1)
                self.assertTrue(fit.converged)
                np.testing.assert_allclose(fit.position_m, self.position_m[n], atol=1e-6)
                self.assertLess((rotations(fit.quaternion_wxyz[None])[0] * self.turn[n].inv()).magnitude(), 1e-5)

    def test_cold_start_near_the_coils(self):
        self.position_m *= 0.12 / np.linalg.norm(self.position_m, axis=1, keepdims=True)
        near = Coils(coils().source_m, np.eye(3), self.coils.sensor_m, np.eye(3))
        x, _ = near.couplings(self.position_m, self.turn.as_matrix())
        found = np.array([solve_cold(near, row, NO_SIDE, 0.1).position_m for row in x])
        np.testing.assert_allclose(found, self.position_m, atol=1e-6)

    def test_cold_start_of_concentric_coils_keeps_the_given_side(self):
        ideal = Coils(np.zeros((3, 3)), np.eye(3), np.zeros((3, 3)), np.eye(3))
        x, _ = ideal.couplings(self.position_m, self.turn.as_matrix())
        for side in (self.position_m[0], -self.position_m[0]):
            self.assertGreater(solve_cold(ideal, x[0], side, 0.1).position_m @ side, 0)


class Filter(unittest.TestCase):
    def test_the_bias_has_the_time_of_the_last_row(self):
        """A sensor at rest and a bias that grows evenly, which the low band sees as the mean over two lines."""
        rows, speed = 16, np.array([[1e-3, 0, -2e-3], [0, 3e-3, 0]])
        split = SplitFilter(SplitParams(), 1 / 1500, rows, np.ones(2), np.zeros((2, 3)), np.full(2, 1e-3), np.full(2, 0.1))
        for line in range(200):
            bias = speed * (line * rows + 1 + np.arange(rows))[:, None, None] / 1500
            if line > 2:
                split.add_means(mean, mean, 1, np.full(2, 1e-16))
            split.next_line()
            mean = speed * ((line + 1) * rows - rows + 0.5) / 1500  # over this line and the last one
            found = split.rows(bias, np.full(rows, True), np.full(2, 1e-16))[1]
        np.testing.assert_allclose(found[-1], bias[-1], atol=0.02 * abs(speed).max() * rows / 1500)


class Scalar(unittest.TestCase):
    def test_noise_alone_does_not_move_it(self):
        scalar = BandScalar()
        for noise in np.random.default_rng(3).normal(0, 1e-6, (1000, 3)):
            scalar.add_poses(noise, -noise, 2e-12)
        self.assertEqual(scalar.value, 0)

    def test_moving_sensor_uses_the_redundant_part(self):
        random, true, scalar = np.random.default_rng(4), 0.25, BandScalar()
        for _ in range(300):
            disagreement = 1e-3 * random.normal(size=3)
            scalar.add_poses(20e-3 * random.normal(size=3) + true * disagreement, disagreement, 1e-12)
            high = 1e-4 * random.normal(size=3)
            scalar.add_redundant(true / (1 + true) * high + 1e-6 * random.normal(size=3), high, 1e-12, 0)
        self.assertAlmostEqual(scalar.value, true, delta=0.01)
        self.assertLess(scalar.sigma, 0.01)


class Command(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        data = two_bands(Scene(duration_s=1, metal_from_s=0.5))
        self.options = {"ratio": 32, "out": os.path.join(folder.name, "out.csv")}
        for name, x in (("high", data.high), ("low", data.low)):
            self.options[name] = os.path.join(folder.name, name + ".csv")
            np.savetxt(self.options[name], x, delimiter=",", header=",".join(COLUMNS), comments="")
        self.options["calibration"] = os.path.join(folder.name, "bands.json")
        with open(self.options["calibration"], "w") as file:
            json.dump(calibration(data), file)
        self.data = data

    def test_from_python(self):
        result = tricoil.command("couplings", **self.options, hemisphere=(1, 0, 0), tracker="direct")
        self.assertEqual(result["rows"], len(self.data.high))
        self.assertEqual(len(np.loadtxt(self.options["out"], delimiter=",", skiprows=1)), len(self.data.high))
        for option, value, message in (("ratio", 1, "ratio: 1 is not a whole number"), ("tracker", "dirct", "did you mean 'direct'"), ("rate_hz", "x", "rate_hz: x is not a number"),
                                       ("hemisphere", (1, 0), "hemisphere must be a direction"), ("scalar", -1, "scalar must be"), ("unknown", 1, "unknown option unknown")):
            with self.assertRaisesRegex(ValueError, message):
                tricoil.command("couplings", **{**self.options, option: value})
        self.options.pop("low")
        with self.assertRaisesRegex(ValueError, "needs low"):
            tricoil.command("couplings", **self.options)

    def test_calibrations_that_are_refused(self):
        with open(self.options["calibration"]) as file:
            good = file.read()
        for bad, message in ((good.replace("0.045", "true", 1), "'high.source_pos' must hold finite numbers"), (good.replace("0.045", "1.5", 1), "exceeds 1 m"),
                             (good.replace("125.0", "0.0", 1), "linearly dependent"), (good[:100], ":1: the JSON ends too early"), (good[:-1] + "\n]", ":2: is not JSON"),
                             ("[" * 100_000, "nested too deeply"), ('{"NaN": Infinity}', ":1: is not JSON; NaN"), ('"\xff', "the JSON ends too early"), ("1" * 5000, "a number is too large")):
            with open(self.options["calibration"], "w", encoding="latin-1") as file:
                file.write(bad)
            with self.subTest(message=message), self.assertRaisesRegex(ValueError, message):
                _couplings_command.run(**self.options)
            self.assertFalse(os.path.exists(self.options["out"]))


if __name__ == "__main__":
    unittest.main()
