"""Ratio of two bands, quadrature by motion, and pick-up, from columns of a sensor."""

import math
import os
import types
import unittest
import unittest.mock

import numpy as np
from folder_case import FolderCase
import tricoil
from tricoil._low_band import BandRatio, MotionLag, add_columns
from tricoil._pick_up import block_means, mean
from tricoil._recorded_columns import Columns

NOISE = 1e-3  # of a low coupling
FRAME_S = 1 / 240
COLUMN_NOISE = 5e-7  # of a coupling, in phase and in quadrature
RATE = (3 + np.arange(9)).reshape(3, 3)
LAG_S = np.array([[-3e-5, 9e-5, 2e-5], [-8e-5, -2.4e-5, 7e-5], [-3e-5, -6e-5, -1.8e-5]])


def measured(truth, columns, rng):
    """Columns with random couplings of up to 1."""
    bands = BandRatio(1)
    for j in range(3):
        high = rng.uniform(-1, 1, (columns // 3, 3))
        bands.add(j, high, high * truth[:, j] + NOISE * rng.normal(size=high.shape), np.zeros_like(high))
    return bands


class Ratio(unittest.TestCase):
    def test_is_found_with_its_standard_deviation(self):
        truth = np.array([[1.002, 0.999, 1], [0.997, 1.001, 1.003], [1, 1, 0.998]])
        runs, columns = 200, 900
        expected = NOISE / math.sqrt(columns / 9)  # a third of them per coil; the mean square of a coupling is 1/3
        squares, rng = np.zeros((3, 3)), np.random.default_rng(3)
        for _ in range(runs):
            bands = measured(truth, columns, rng)
            self.assertEqual(bands.columns, columns)
            self.assertLess(np.max(np.abs(bands.sigma / expected - 1)), 0.25)
            squares += (bands.ratio - truth) ** 2 / runs
        self.assertLess(np.max(np.abs(np.sqrt(squares) / expected - 1)), 0.25)

    def test_means_remove_hum(self):
        """Hum whose sign changes from column to column, and an incomplete mean before a gap."""
        bands, high = BandRatio(4), np.array([0.5, -0.4, 0.3])
        hum = 0.1 * (-1.0) ** np.arange(120)[:, None]
        bands.add(0, np.tile(high, (120, 1)), 1.01 * high + hum, np.zeros((120, 3)))
        bands.add(0, high[None], high[None] + 0.1, np.full((1, 3), 0.1))
        self.assertLess(np.max(np.abs(bands.ratio[:, 0] - 1.01)), 1e-12)
        self.assertLess(np.max(bands.sigma[:, 0]), 1e-6)
        self.assertEqual(bands.columns, 121)

    def test_phases_come_from_rests(self):
        """A phase turns a part of the coupling into quadrature; the ratio is that of the amplitudes. Motion causes another quadrature."""
        phase_rad, ratio, rng, bands = 0.03, 1.02, np.random.default_rng(5), BandRatio(2)
        self.assertFalse(bands.knows_phases)
        for n in range(300):
            rests = n < 150
            now = rng.uniform(-1, 1, 3) * (1 + np.array([[0], [1e-4 if rests else 0.1]]))
            quadrature = ratio * math.sin(phase_rad) * now if rests else np.ones((2, 3))
            bands.add(n % 3, now, ratio * math.cos(phase_rad) * now, quadrature)
        self.assertTrue(bands.knows_phases)
        self.assertLess(np.max(np.abs(bands.ratio - ratio)), 1e-12)
        self.assertLess(np.max(np.abs(bands.phase_rad - phase_rad)), 1e-12)
        self.assertLess(np.max(bands.phase_sigma_rad), 1e-6)

    def test_is_unknown_without_columns(self):
        self.assertFalse(np.isfinite(BandRatio(1).ratio).any())
        self.assertFalse(np.max(BandRatio(1).sigma) <= 1)


def frames(count, speed, noise, rng):
    """Couplings that oscillate, each at its own rate, and their quadratures. speed: 0 for a resting sensor."""
    angle = RATE * (speed * FRAME_S * np.arange(count)[:, None, None]) + np.arange(9).reshape(3, 3)
    rate = 0.01 * RATE * np.cos(angle)
    return 0.01 * np.sin(angle) + noise * rng.normal(size=angle.shape), speed * rate @ LAG_S + noise * rng.normal(size=angle.shape), np.full(count, noise**2)


class Lag(unittest.TestCase):
    def test_is_found_with_its_standard_deviation(self):
        squares = []
        for run in range(100):
            lag = MotionLag()
            lag.add(*frames(720, 1, COLUMN_NOISE, np.random.default_rng(run)), FRAME_S)
            self.assertTrue(lag.is_known)
            squares.append(np.mean(((lag.lag_s - LAG_S) / lag.sigma_s) ** 2))
        self.assertAlmostEqual(np.mean(squares), 1, delta=0.25)

    def test_needs_motion_and_quadrature(self):
        rng = np.random.default_rng(1)
        for name, rows in (("resting", frames(720, 0, COLUMN_NOISE, rng)), ("few", frames(80, 1, COLUMN_NOISE, rng)), ("noisy", frames(720, 1, 1e3 * COLUMN_NOISE, rng))):
            lag = MotionLag()
            lag.add(*rows, FRAME_S)
            self.assertFalse(lag.is_known, name)
        in_phase, quadrature, variance = frames(720, 1, 0, rng)
        without = MotionLag()  # a device that sends no quadrature
        without.add(in_phase, 0 * quadrature, variance, FRAME_S)
        self.assertFalse(without.is_known)
        self.assertFalse(MotionLag().is_known)

    def test_a_gap_is_no_motion(self):
        lag, rng = MotionLag(), np.random.default_rng(1)
        lag.add(*frames(720, 1, 0, rng), FRAME_S)
        lag.add(1e3 * np.array([np.eye(3), -np.eye(3)]), np.zeros((2, 3, 3)), np.zeros(2), FRAME_S)
        self.assertLess(np.linalg.norm(lag.lag_s - LAG_S), 1e-2 * np.linalg.norm(LAG_S))


class Order(unittest.TestCase):
    """Columns as they are recorded: three high ones of a frame, then three low ones."""

    def columns(self, count, low_phase_rad=0.0):
        in_phase, quadrature, _ = frames(count, 1, 0, np.random.default_rng(1))
        time_us = np.repeat(1e6 * FRAME_S * np.arange(1, count + 1), 6)
        low, coil = np.tile([False] * 3 + [True] * 3, count), np.tile([0, 1, 2], 2 * count)
        high = np.stack((in_phase, quadrature), axis=1).transpose(0, 3, 1, 2)  # frames, source coils, parts, sensor coils
        factor = 1.01 * np.stack((np.cos(low_phase_rad) * in_phase, np.sin(low_phase_rad) * in_phase), axis=1).transpose(0, 3, 1, 2)
        both = np.concatenate((high, factor), axis=1).reshape(-1, 2, 3)
        return Columns(time_us, coil, low, np.zeros(len(coil), bool), np.zeros(len(coil)), both, both, both)

    @staticmethod
    def without(columns, rows):
        return Columns(*(np.delete(getattr(columns, name), rows, axis=0) for name in Columns.__dataclass_fields__))

    def found(self, columns):
        ratio, lag = BandRatio(4), MotionLag()
        add_columns(columns, FRAME_S, ratio, lag)
        return ratio, lag

    def test_pairs_and_frames(self):
        ratio, lag = self.found(self.columns(720))
        self.assertEqual(ratio.columns, 3 * 720)
        self.assertLess(np.max(np.abs(ratio.ratio - 1.01)), 1e-12)
        self.assertLess(np.linalg.norm(lag.lag_s - LAG_S), 1e-2 * np.linalg.norm(LAG_S))

    def test_lost_columns_and_gaps(self):
        all_columns = self.columns(720)
        # A high column is lost: no pair with the older one, and no frame.
        ratio, lag = self.found(self.without(all_columns, [6 * 100, 6 * 200 + 1, 6 * 300 + 4]))
        self.assertEqual(ratio.columns, 3 * 720 - 3)
        self.assertEqual(lag._count, 720 - 2 - 3 * 2)  # two frames are not complete; each part has two frames more than rates
        self.assertLess(np.max(np.abs(ratio.ratio - 1.01)), 1e-12)
        self.assertLess(np.linalg.norm(lag.lag_s - LAG_S), 1e-2 * np.linalg.norm(LAG_S))
        # 2 s are lost, and the clock begins again.
        times = all_columns.time_us.copy()
        times[6 * 400:] -= times[6 * 399]
        ratio, lag = self.found(self.without(Columns(times, *(getattr(all_columns, name) for name in list(Columns.__dataclass_fields__)[1:])), range(6 * 60, 6 * 240)))
        self.assertEqual(lag._count, 540 - 3 * 2)
        self.assertLess(np.linalg.norm(lag.lag_s - LAG_S), 1e-2 * np.linalg.norm(LAG_S))
        self.assertLess(np.max(np.abs(ratio.ratio - 1.01)), 1e-12)


class PickUp(unittest.TestCase):
    def test_blocks_end_when_each_coil_has_enough(self):
        coil = np.concatenate((np.zeros(150, int), np.tile([0, 1, 2], 250)))
        values = np.zeros((len(coil), 2, 3))
        values[:, 0] = coil[:, None] + 1
        values[:150] = 100
        blocks = block_means(coil, values)
        self.assertEqual(blocks.shape, (2, 2, 3, 3))
        np.testing.assert_allclose(blocks[0, 0, :, 0], (150 * 100 + 100) / 250)
        np.testing.assert_allclose(blocks[1, 0], [[1, 2, 3]] * 3)
        self.assertEqual(len(block_means(coil[coil != 1], values[coil != 1])), 0)

    def test_deviation_of_the_mean(self):
        rng = np.random.default_rng(2)
        blocks = 1 + 1e-3 * rng.normal(size=(400, 2, 3, 3))
        self.assertAlmostEqual(mean(blocks, 0, 1)[18], 1e-3 / 20, delta=2e-6)
        self.assertAlmostEqual(mean(blocks, 1e-2, 1)[18], 1e-2, delta=2e-6)
        with self.assertRaisesRegex(ValueError, "the couplings change by"):
            mean(np.array([1.0, 2, 3, 4])[:, None, None, None] * np.ones((4, 2, 3, 3)), 0, 1e-9)


class Command(FolderCase):
    def test_wrong_arguments(self):
        for kind, options, message in (("pick-up", {"distance_m": 0}, "distance_m must be a positive number"), ("pick-up", {"nodes": 3}, "unknown option nodes"),
                                       ("low-band", {"blob": "x"}, "unknown option blob"), ("low-band", {"calibration": self.folder + "/none"}, "none")):
            with self.assertRaisesRegex((ValueError, OSError), message):
                tricoil.calibrate([self.folder], self.path("out.toml"), kind, **{"calibration": self.path("coils.toml"), **options})
        self.assertEqual(os.listdir(self.folder), [])

    def test_a_build_without_calibration_says_so(self):
        with unittest.mock.patch("tricoil._command._tricoil", types.SimpleNamespace(command=unittest.mock.Mock(side_effect=ValueError("--calibration: not built")))):
            for kind in ("low-band", "pick-up", "surroundings"):
                with self.assertRaisesRegex(ValueError, "calibration: not built"):
                    tricoil.calibrate(["x"], "y", kind, calibration="z")


if __name__ == "__main__":
    unittest.main()
