"""Verification of moving trackers with known settings against references with their own frame, clock and gaps."""

import json
import os
import subprocess
import sys
import tempfile
import unittest
import unittest.mock

import numpy as np
import tricoil
from tricoil import _naive
from scipy.spatial.transform import Rotation

WORLD = Rotation.from_euler("zyx", [110, 20, -5], degrees=True)
WORLD_M = np.array([2.1, -0.4, 0.9])
MOUNT = Rotation.from_rotvec([-0.6, 0.2, 1.9])
MOUNT_M = np.array([0.05, 0.12, -0.03])
PHASES = np.random.default_rng(4).uniform(0, 6.3, (6, 4))
HZ = np.random.default_rng(5).uniform(0.2, 1.3, (6, 4))


def waves(t, rows):
    return np.stack([np.sin(2 * np.pi * np.outer(t, HZ[n]) + PHASES[n]).sum(axis=1) for n in rows], axis=1)


def truth(t, place=(0.7, 0, 0.1), size_m=0.05):
    """Pose of the sensor in the source frame."""
    return np.array(place) + size_m * waves(t, range(3)), Rotation.from_rotvec(0.3 * waves(t, range(3, 6)))


def wxyz(turn):
    return turn.as_quat()[:, [3, 0, 1, 2]]


def reference(t, noise_m=0.0, place=(0.7, 0, 0.1), size_m=0.05):
    """Pose of the body on which the sensor is mounted, in a frame of its own."""
    p, turn = truth(t, place, size_m)
    body = turn * MOUNT.inv()
    p = WORLD.apply(p - body.apply(MOUNT_M)) + WORLD_M
    return p + noise_m / np.sqrt(3) * np.random.default_rng(6).normal(size=p.shape), wxyz(WORLD * body)


def naive(t, slot_s, order, each_column=False, size_m=0.05):
    """Poses of a tracker with TDM that solves columns of different ages as if they were simultaneous; t: of the newest column."""
    x = np.empty((len(t), 3, 3))
    rows = np.arange(len(t))
    for age in range(3):
        p, turn = truth(t - age * slot_s, size_m=size_m)
        coil = np.array(order)[(rows - age) % 3] if each_column else np.full(len(t), order[2 - age])
        x[rows, :, coil] = tricoil.couplings(p, wxyz(turn))[rows, :, coil]
    solved = tricoil.solve(x, 1e-9)
    return solved["position_m"], Rotation.from_quat(solved["quaternion_wxyz"][:, [1, 2, 3, 0]])


def noisy(p, turn, noise_m=5e-5):
    random = np.random.default_rng(7)
    return p + noise_m * random.normal(size=p.shape), wxyz(Rotation.from_rotvec(1.7e-4 * random.normal(size=p.shape)) * turn)


T = np.arange(0, 24, 1 / 240)
R = np.arange(1, 23, 0.01)


class Static(unittest.TestCase):
    """A tracker without motion error: only its noise is left, 0.087 mm."""

    @classmethod
    def setUpClass(cls):
        cls.tracker = (T, *noisy(*truth(T)))
        cls.reference = (R, *reference(R))

    def noise_is_left(self, tracker, reference, **options):
        result = tricoil.verify(tracker, reference, **options)
        self.assertAlmostEqual(1e3 * result["position_rms_m"], 0.0866, delta=0.002)
        self.assertFalse(result["distinguishable"])
        self.assertIn("none", result["multiplexing"])
        return result

    def test_frames_and_mount(self):
        result = self.noise_is_left(self.tracker, self.reference)
        self.assertAlmostEqual(result["time_offset_s"], 0, delta=1e-5)
        np.testing.assert_allclose(np.abs(np.dot(result["q_mount"], MOUNT.as_quat()[[3, 0, 1, 2]])), 1, atol=1e-7)
        np.testing.assert_allclose(result["mount_m"], MOUNT_M, atol=1e-4)
        inverse = WORLD.inv()
        np.testing.assert_allclose(np.abs(np.dot(result["q_world"], inverse.as_quat()[[3, 0, 1, 2]])), 1, atol=1e-7)
        np.testing.assert_allclose(result["world_m"], -inverse.apply(WORLD_M), atol=1e-3)
        self.assertIsNone(result["lag_s"])

    def test_clocks(self):
        for offset, ppm in ((0.4, 40), (10.13, -200), (1764283200.4, 0)):
            with self.subTest(offset=offset):
                result = self.noise_is_left(self.tracker, ((R + offset) if ppm == 0 else (R + offset) * (1 + 1e-6 * ppm), *self.reference[1:]))
                self.assertAlmostEqual(result["clock_rate_ppm"], ppm, delta=1)
        self.noise_is_left(self.tracker, (R + 10.13, *self.reference[1:]), time_offset_s=10)

    def test_outliers_scale_and_gap(self):
        random = np.random.default_rng(8)
        t, p, q = self.tracker
        wrong = random.choice(len(t), 69, replace=False)
        result = self.noise_is_left((t, p + np.isin(np.arange(len(t)), wrong)[:, None] * [0.05, 0, 0], q), self.reference)
        self.assertGreaterEqual(result["outliers"], 60)
        self.assertAlmostEqual(self.noise_is_left((t, 1.005 * p, q), self.reference)["scale_factor"], 1.005, delta=2e-5)
        gap = (R < 8) | (R > 8.6)
        self.assertAlmostEqual(self.noise_is_left(self.tracker, tuple(part[gap] for part in self.reference))["poses_in_gaps"], 148, delta=6)

    def test_positions_only_and_turning_in_place(self):
        t, p, q = self.tracker
        ball = WORLD.apply(truth(R)[0]) + WORLD_M
        self.noise_is_left(self.tracker, (R, ball, None))
        self.noise_is_left((t, p, None), (R, ball, None))
        self.noise_is_left((t, p, None), self.reference)
        still = np.tile([0.6, 0.1, 0], (len(t), 1)) + 5e-5 * np.random.default_rng(9).normal(size=(len(t), 3))
        self.noise_is_left((t, still, q), (R, np.tile(WORLD_M, (len(R), 1)), self.reference[2]))

    def test_latency_needs_a_common_clock(self):
        late = (T, *noisy(*truth(T - 1 / 720)))
        self.assertIsNone(self.noise_is_left(late, self.reference)["lag_s"])
        result = tricoil.verify(late, self.reference, same_clock=True)
        self.assertAlmostEqual(result["lag_s"], 1 / 720, delta=1e-5)
        self.assertGreater(result["position_rms_m"], 4e-4)


class Moving(unittest.TestCase):
    def verify(self, slot_s, order, each_column=False, **options):
        step = slot_s if each_column else 3 * slot_s
        t = np.arange(0.5, 20, step)
        tracker = (t + 0.004, *noisy(*naive(t, slot_s, order, each_column)))
        keep = (R < 9) | (R > 10)
        return tricoil.verify(tracker, (R[keep] * (1 + 5e-5), *(part[keep] for part in reference(R, 3e-4))), **options)

    def test_time_multiplexing(self):
        for slot_s, order, each_column in ((1.4e-3, (0, 1, 2), False), (2.5e-3, (2, 0, 1), False), (1.4e-3, (1, 0, 2), True), (3e-3, (0, 1, 2), True)):
            with self.subTest(slot_s=slot_s, order=order, each_column=each_column):
                result = self.verify(slot_s, order, each_column)
                self.assertIn("TDM", result["multiplexing"])
                self.assertAlmostEqual(result["slot_s"], slot_s, delta=0.02 * slot_s)
                if not each_column:
                    self.assertIn("coils " + " ".join(f"S{coil + 1}" for coil in order), result["multiplexing"])
                self.assertTrue(next(one for one in result["alternatives"] if one["name"] == "no skew")["rejected"])
                if result["distinguishable"]:
                    self.assertGreater(result["r2"], 0.95)

    def test_ball_on_a_lever(self):
        """The tracker's own attitude, which its motion error turns, replaces that of the reference."""
        t = np.arange(0.5, 20, 3 * 2e-3)
        p, turn = truth(R)
        result = tricoil.verify((t, *noisy(*naive(t, 2e-3, (0, 1, 2)))), (R, WORLD.apply(p + turn.apply([0.1, -0.2, 0.15])) + WORLD_M, None))
        self.assertAlmostEqual(result["slot_s"], 2e-3, delta=2e-5)
        self.assertLess(result["left_rms_m"], 1e-4)
        np.testing.assert_allclose(result["mount_m"], [-0.1, 0.2, -0.15], atol=1e-3)

    def test_turning_in_place(self):
        """All that the positions move is the motion error."""
        t = np.arange(0.5, 20, 3 * 1.4e-3)
        result = tricoil.verify((t, *noisy(*naive(t, 1.4e-3, (0, 1, 2), size_m=0))), (R, *reference(R, size_m=0)))
        self.assertIn("coils S1 S2 S3", result["multiplexing"])
        self.assertAlmostEqual(result["slot_s"], 1.4e-3, delta=2e-5)
        self.assertGreater(result["motion_error_m"], 1e-3)
        self.assertGreater(result["r2"], 0.99)

    def test_intervals_are_those_of_poses(self):
        """Resamples without a pose of the band count for nothing; a band in one block has no interval."""
        by = self.verify(1.4e-3, (0, 1, 2))["by"]
        intervals = [(band["left_rms_m"], band["left_interval_m"]) for name in by for band in by[name]]
        for left_m, ends in intervals:
            if ends[0] is not None:
                self.assertGreater(ends[0], 0.3 * left_m)
        self.assertGreater(sum(ends[0] is not None for _, ends in intervals), 5)

    def test_rounded_times_are_rebuilt(self):
        t = np.arange(0.5, 20, 3 * 1.4e-3)
        p, q = noisy(*naive(t, 1.4e-3, (0, 1, 2)))
        result = tricoil.verify((np.round(t, 3), p, q), (R, *reference(R)))
        self.assertAlmostEqual(result["slot_s"], 1.4e-3, delta=2e-5)
        self.assertLess(result["left_rms_m"], 1e-4)
        self.assertIn("rounded to 1 ms", " ".join(result["notes"]))

    def test_latency_with_a_common_clock(self):
        result = self.verify(2.5e-3, (2, 0, 1), same_clock=True)
        self.assertAlmostEqual(result["lag_s"], 0.004, delta=1e-4)
        self.assertGreater(result["lag_std_s"], 9e-6 * result["clock_rate_std_ppm"])  # at the first pose, 9.75 s before the middle

    def test_own_tracker(self):
        """Poses after each column, without correction of the skew; the true pose is the reference."""
        with tempfile.TemporaryDirectory() as folder:
            out = os.path.join(folder, "run.csv")
            tricoil.command("run", scenario="hand", mux="tdm", tracker="direct", no_deskew=True, fidelity="columns", duration=8, out=out)
            poses = tricoil.read_poses(out)
            with open(out, encoding="utf-8") as file:
                lines = [line.strip().split(",") for line in file if not line.startswith("#")]
            names = [lines[0].index(name) for name in ("time_us", "true_x_m", "true_y_m", "true_z_m", "true_qw", "true_qx", "true_qy", "true_qz")]
            true = np.array([[float(fields[n]) for n in names] for fields in lines[1::3]])
            result = tricoil.verify(poses, (1e-6 * true[:, 0], true[:, 1:4], true[:, 4:]), same_clock=True)
        self.assertAlmostEqual(result["slot_s"], 1 / 720, delta=2e-6)
        self.assertAlmostEqual(result["lag_s"], 0, delta=1e-5)
        self.assertGreater(result["r2"], 0.99)
        self.assertGreater(result["motion_error_m"], 1e-3)


class Patterns(unittest.TestCase):
    def test_each_has_its_own_name(self):
        self.assertEqual(len({str(pattern) for pattern in _naive.patterns(T)}), 18)


class Unsolved(unittest.TestCase):
    """A pose that the model cannot solve has no predicted error; it is not an error of zero."""

    def test_has_no_error(self):
        t = T[:9]
        p, turn = truth(t)
        aged = object.__new__(_naive.AgedCouplings)
        aged.time_s, aged.scale, aged.position, aged.turn = t, 1.0, p, turn
        x = np.array(tricoil.couplings(p, wxyz(turn)))
        x[3] = 0
        aged.ages = [x] * 3
        error, turned = aged.error(_naive.patterns(T)[0])
        self.assertEqual(list(np.flatnonzero(~_naive.is_known(error))), [3])
        self.assertLess(turned.magnitude().max(), 1e-3)

    def test_is_left_out(self):
        error_of = _naive.AgedCouplings.error

        def with_unsolved(aged, pattern):
            error, turn = error_of(aged, pattern)
            return np.where((np.rint(1e4 * aged.time_s) % 7 == 0)[:, None], np.nan, error), turn

        with unittest.mock.patch.object(_naive.AgedCouplings, "error", with_unsolved):
            result = Moving.verify(self, 2.5e-3, (2, 0, 1))
        self.assertIn("coils S3 S1 S2", result["multiplexing"])
        self.assertAlmostEqual(result["slot_s"], 2.5e-3, delta=5e-5)
        self.assertGreater(result["r2"], 0.95)


class BadInput(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.tracker = (T, *noisy(*truth(T)))
        cls.reference = (R, *reference(R))

    def refused(self, pattern, tracker=None, reference=None, **options):
        with self.assertRaisesRegex(ValueError, pattern):
            tricoil.verify(tracker or self.tracker, reference or self.reference, **options)

    def test_the_true_reason(self):
        t, p, q = self.tracker
        u, r, s = self.reference
        self.refused("do not hold the same motion", reference=(u, r[::-1], s[::-1]))
        self.refused("is mirrored relative to the tracker", reference=(u, WORLD.apply(truth(R)[0]) * [1, 1, -1], s))
        self.refused("quaternions turn the other way", reference=(u, r, s * [1, -1, -1, -1]))
        self.refused("is the unit mm", reference=(u, 1e3 * r, s))
        self.refused("slower than the motion", reference=(np.arange(1, 23, 0.25), *reference(np.arange(1, 23, 0.25))))
        five_hz = np.arange(1, 23, 0.2)
        self.refused(r"slower than the motion: between its samples it is wrong by [1-9]", reference=(five_hz, *reference(five_hz)))
        self.refused("does not move", tracker=(t, np.tile(p[:1], (len(t), 1)), np.tile(q[:1], (len(t), 1))))
        self.refused("1 pose; at least 20", reference=(u[:1], r[:1], s[:1]))
        self.refused("row 7: the position is not finite", tracker=(t, np.where(np.arange(len(t))[:, None] == 7, np.nan, p), q))
        self.refused("quaternion has length 2", tracker=(t, p, 2 * q))
        self.refused("time_offset_s must be a finite number of seconds, at most 1e\\+12", time_offset_s=1e300)
        self.refused("time_offset_s: with this clock the reference ends", time_offset_s=500)
        self.refused(r"the motions agree at \+7\.13", reference=(u + 10.13, r, s), time_offset_s=3)
        self.refused("^same_clock: cannot be right; the motions agree at", reference=(u + 1, r, s), same_clock=True)
        self.refused("^same_clock: with this clock the reference", reference=(u + 500, r, s), same_clock=True)

    def test_types(self):
        with self.assertRaises(TypeError):
            tricoil.evaluate(["a", "b"], dynamic=True, colour="red")
        with self.assertRaisesRegex(ValueError, "takes two files"):
            tricoil.evaluate(["a"], dynamic=True)
        with self.assertRaisesRegex(ValueError, "no calibration"):
            tricoil.evaluate(["a", "b"], "cal.toml", dynamic=True)


@unittest.skipUnless("TRICOIL_PROGRAM" in os.environ, "needs the program")
class Program(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        t, u = np.arange(0, 8, 1 / 120), np.arange(0, 8, 0.01)
        cls.files = [cls.write("truth.csv", u, *reference(u)), cls.write("poses.csv", t, *noisy(*truth(t)))]

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    @classmethod
    def write(cls, name, t, p, q):
        path = os.path.join(cls.folder.name, name)
        np.savetxt(path, np.column_stack((t, 1e3 * p, q)), delimiter=";", header="time_s;x_mm;y_mm;z_mm;qw;qx;qy;qz", comments="", fmt="%.9f")
        return path

    def run_program(self, *words, **more):
        return subprocess.run([os.environ["TRICOIL_PROGRAM"], "evaluate", "--dynamic", *words], capture_output=True, text=True, check=False, cwd=self.folder.name, **more)

    def test_text_json_and_files(self):
        text = self.run_program("truth.csv", "poses.csv")
        self.assertEqual(text.stderr, "")
        self.assertRegex(text.stdout, r"position +RMS 0\.08\d mm")
        self.assertRegex(text.stdout, r"latency +not observable without a common clock")
        result = json.loads(self.run_program("--json", "--out", "out", *self.files).stdout)
        self.assertEqual(result, tricoil.evaluate(self.files, dynamic=True))
        with open(os.path.join(self.folder.name, "out", "dynamic_errors.csv"), encoding="utf-8") as file:
            self.assertEqual(len(file.readlines()), 1 + result["poses"] + result["outliers"])
        self.assertTrue(os.path.exists(os.path.join(self.folder.name, "out", "dynamic_errors.svg")))
        again = self.run_program("--json", "--csv-only", "--out", "out", *self.files)
        self.assertEqual((again.stderr, json.loads(again.stdout)), ("", result))
        self.assertEqual(os.listdir(os.path.join(self.folder.name, "out")), ["dynamic_errors.csv"])  # no picture of older errors

    def test_bad_input_is_one_line(self):
        for words, pattern in ((("truth.csv", "missing.csv"), "missing.csv: No such file"), (("truth.csv", "poses.csv", "--sensor", "3"), "leave --sensor out"),
                               (("truth.csv", "poses.csv", "--time-offset", "soon"), "--time-offset must be a number"),
                               (("truth.csv", "poses.csv", "--unit", "mile"), "--unit must be m, cm, mm or in"), (("truth.csv",), "takes two files"),
                               (("truth.csv", "poses.csv", "--wiring", "truth.csv"), "no calibration and no wiring")):
            done = self.run_program(*words)
            self.assertEqual(done.returncode, 2)
            self.assertEqual(done.stdout, "")
            self.assertRegex(done.stderr, r"\Atricoil: [^\n]*" + pattern + r"[^\n]*\n\Z")

    def test_imports_nothing_of_the_users_folders(self):
        for module in ("numpy", "json", "tricoil", "scipy"):
            with open(os.path.join(self.folder.name, module + ".py"), "w", encoding="utf-8") as file:
                file.write("raise SystemExit('imported from the current folder')\n")
        environment = {**os.environ, "PYTHONPATH": self.folder.name, "PATH": self.folder.name}
        self.assertEqual(self.run_program("truth.csv", "poses.csv", env=environment).returncode, 0)


if __name__ == "__main__":
    sys.exit(unittest.main())
