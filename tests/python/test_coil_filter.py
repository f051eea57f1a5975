"""Filter for sensors of one coil that move while the coils of a generator are measured in turn."""

import itertools
import json
import os
import subprocess
import tempfile
import unittest

import numpy as np
from scipy.spatial.transform import Rotation

import tricoil
from tricoil import _generator, _generator_simulate, _generator_track, _rotation

FRAME_S, SLOT_S, SIDE = 0.025, 0.003, (0, 0, 1)
COIL = {1: tricoil.SensorCoil(1.0, np.zeros(3), np.array([1.0, 0, 0]))}
BODY = _generator_simulate.BODY
WRONG_M = 0.02


def moved(t, speed):
    """Positions (M, 3) and attitudes of a hand: about 0.15 m/s and 0.6 rad/s at speed 1."""
    phase = 2 * np.pi * speed * np.multiply.outer(t, [0.43, 0.37, 0.29]) + [0.3, 1.1, 2.0]
    return [0.0, 0.0, 0.24] + [0.06, 0.05, 0.04] * np.sin(phase), Rotation.from_rotvec(np.cos(phase[:, ::-1]) * [0.25, 0.5, 0.3])


class World:
    """Couplings (K, M, N) with noise, and the true poses of all columns."""

    def __init__(self, speed, mounts=COIL, snr_db=60, frames=600, seed=1):
        self.generator = tricoil.planar_generator()
        if mounts is not COIL:
            object.__setattr__(self.generator, "sensors", mounts)
        slots = SLOT_S * (np.arange(len(self.generator)) - (len(self.generator) - 1) / 2)
        self.times = FRAME_S * (1 + np.arange(frames))[:, None] + slots
        self.position_m, self.turn = moved(self.times.ravel(), speed)
        rng = np.random.default_rng(seed)
        self.couplings, self.sigma = [], []
        for one in mounts.values():
            place = (self.position_m + self.turn.apply(one.offset_m)).reshape(*self.times.shape, 3)
            true = _generator_simulate.couplings_at_slots(self.generator, place, self.turn.apply(one.axis).reshape(place.shape), one.gain)
            sigma = np.sqrt(np.mean(true**2, axis=1, keepdims=True)) * 10 ** (-snr_db / 20)
            self.couplings.append(true + sigma * rng.normal(size=true.shape))
            self.sigma.append(np.broadcast_to(sigma, true.shape))
        self.couplings, self.sigma, self.rng = np.array(self.couplings), np.array(self.sigma), rng
        self.mounts = mounts

    def tracked(self, gain=1.0, **options):
        choice = {"gain": gain} if len(self.mounts) == 1 else {"sensors": list(self.mounts)}
        one = tricoil.CoilFilter(self.generator, FRAME_S, side=SIDE, **choice, **options)
        return one.update(self.times, self.couplings, self.sigma), one

    def score(self, poses):
        """Of valid poses: RMS error (m), NEES, share beyond 5 sigma, and their number."""
        rows = np.searchsorted(self.times.ravel(), poses["time_s"] - 1e-9)
        good = poses["valid"]
        error = (poses["position_m"] - self.position_m[rows])[good]
        covariance = poses["covariance"][good]
        turn = (_rotation.rotations(poses["quaternion_wxyz"]) * self.turn[rows].inv()).as_rotvec()[good]
        if len(self.mounts) == 1:
            axis = self.turn[rows].apply([1.0, 0, 0])[good]
            turn = np.cross(axis, poses["axis"][good])
            across = np.eye(3) - axis[:, :, None] * axis[:, None]
            project = np.zeros((len(axis), 6, 6))
            project[:, :3, :3], project[:, 3:, 3:] = np.eye(3), across
            covariance = project @ covariance @ project
        both, unit = np.hstack((error, turn)), np.array([0.1] * 3 + [1.0] * 3)
        inverse = np.linalg.pinv(covariance / unit / unit[:, None], rcond=1e-9, hermitian=True)
        nees = np.einsum("mi,mij,mj->m", both / unit, inverse, both / unit) / (5 if len(self.mounts) == 1 else 6)
        length, sigma = np.linalg.norm(error, axis=1), np.sqrt(np.trace(covariance[:, :3, :3], axis1=1, axis2=2))
        return np.sqrt(np.mean(length**2)), nees.mean(), np.mean(length > 5 * sigma), int(good.sum())


class Moving(unittest.TestCase):
    def test_error_is_far_below_that_of_simultaneous_columns(self):
        for speed, factor in ((0.5, 2), (1, 4), (3, 8)):
            world = World(speed)
            rms, nees, beyond, count = world.score(world.tracked()[0])
            rows = tricoil.solve_5dof(world.couplings[0], world.generator, world.sigma[0], gain=1.0, side=SIDE)
            middle = moved(world.times.mean(axis=1), speed)[0]
            error = np.linalg.norm(rows["position_m"] - middle, axis=1)
            naive = np.sqrt(np.mean(error[error < 0.1] ** 2))  # most are refused: their couplings fit no pose
            with self.subTest(speed, rms=rms, naive=naive, nees=nees):
                self.assertGreater(naive, factor * rms)
                self.assertTrue(0.75 < nees < 1.25)
                self.assertLess(beyond, 1e-3)
                self.assertGreater(count, 0.97 * world.times.size)

    def test_gain_is_estimated(self):
        world = World(1)
        poses, _ = world.tracked(gain=None)
        rms, nees, beyond, _ = world.score(poses)
        self.assertTrue(rms < 0.6e-3 and 0.75 < nees < 1.25 and beyond < 1e-3, (rms, nees, beyond))
        last = poses[-1]
        self.assertLess(abs(last["gain"] - 1), 5 * last["gain_deviation"])
        self.assertLess(last["gain_deviation"], 2e-3)

    def test_body_of_two_coils(self):
        world = World(1, BODY)
        poses, _ = world.tracked()
        rms, nees, beyond, count = world.score(poses)
        self.assertTrue(rms < 0.4e-3 and 0.7 < nees < 1.25 and beyond < 1e-3, (rms, nees, beyond))
        self.assertGreater(count, 0.97 * world.times.size)
        self.assertFalse((poses["flags"] & tricoil.Flag.ROLL_UNDEFINED).any())

    def test_roll_is_undefined(self):
        world = World(0.5, frames=50)
        poses, _ = world.tracked()
        self.assertTrue((poses["flags"][poses["valid"]] & tricoil.Flag.ROLL_UNDEFINED).all())
        turned = poses["covariance"][poses["valid"]][-1][3:, 3:]
        axis = poses["axis"][-1]
        self.assertAlmostEqual(axis @ turned @ axis, np.pi**2 / 3, delta=0.01)  # of any angle


class Disturbed(unittest.TestCase):
    def test_outliers_are_refused_and_flagged(self):
        world = World(0.5)
        hit = world.rng.random(world.times.shape) < 0.02
        world.couplings[0] += hit * 100 * world.sigma[0]
        poses, one = world.tracked()
        rms, nees, beyond, count = world.score(poses)
        self.assertGreater(one.counters["outliers"], 0.9 * hit.sum())
        self.assertTrue(rms < 0.6e-3 and 0.7 < nees < 1.4 and beyond < 1e-3, (rms, nees, beyond))
        refused = np.isin(poses["time_s"], world.times[hit])
        self.assertGreater((poses["flags"][refused] & tricoil.Flag.UNCONFIRMED > 0).mean(), 0.9)
        self.assertGreater(count, 0.8 * world.times.size)

    def test_lost_columns(self):
        world = World(0.5)
        world.couplings[0][world.rng.random(world.times.shape) < 0.2] = np.nan
        rms, nees, beyond, count = world.score(world.tracked()[0])
        self.assertTrue(rms < 0.6e-3 and 0.75 < nees < 1.25 and beyond < 1e-3, (rms, nees, beyond))
        self.assertGreater(count, 0.7 * world.times.size)

    def test_recovery_after_a_gap(self):
        for frames, starts in ((2, 1), (20, 2)):
            world = World(0.5, frames=200)
            world.couplings[0][100:100 + frames] = np.nan
            poses, one = world.tracked()
            rms, _, beyond, _ = world.score(poses)
            with self.subTest(frames):
                self.assertEqual(one.counters["starts"], starts)
                after = poses[poses["time_s"] > world.times[100 + frames + 4, 0]]
                self.assertTrue(after["valid"].mean() > 0.95 and rms < 1e-3 and beyond < 1e-3)

    def test_a_jump_is_a_loss(self):
        world, other = World(0.1, frames=100), World(0.1, frames=100, seed=2)
        shifted, turn = moved(other.times.ravel(), 0.1)
        shifted = (shifted + [0.04, -0.05, 0.02]).reshape(*world.times.shape, 3)
        jumped = _generator_simulate.couplings_at_slots(world.generator, shifted, turn.apply([1.0, 0, 0]).reshape(shifted.shape), 1.0)
        world.couplings[0][50:] = jumped[50:]
        poses, one = world.tracked()
        self.assertGreaterEqual(one.counters["losses"], 1)
        last = poses[-1]
        self.assertTrue(last["valid"] and np.linalg.norm(last["position_m"] - shifted[-1, -1]) < 2e-3)


class Command(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        times = np.arange(0, 8, 0.01)
        position, turn = moved(times, 1)
        with open(self.path("path.csv"), "w") as file:
            file.write("time_s,x_m,y_m,z_m,qw,qx,qy,qz\n")
            for t, p, q in zip(times, position, _rotation.wxyz(turn)):
                file.write(",".join(f"{v:.9g}" for v in (t, *p, *q)) + "\n")
        _generator_simulate.run(out=self.path("c.csv"), save=self.path("g.toml"), path=self.path("path.csv"), slot_s=SLOT_S, place="0,0,0.24")

    def path(self, name):
        return os.path.join(self.folder.name, name)

    def track(self, **options):
        return _generator_track.run([self.path("c.csv")], **{"generator": self.path("g.toml"), "side": SIDE, "slot_s": SLOT_S, **options})

    def test_result_and_files(self):
        result, _ = self.track(out=self.path("p.jsonl"), gain=1)
        truth = result["truth"]
        self.assertEqual((result["roll"], result["starts"], result["losses"], truth["wrong"]), ("undefined", 1, 0, 0))
        self.assertTrue(truth["position_rms_m"] < 0.5e-3 and 0.7 < truth["nees"] < 1.3, truth)
        with open(self.path("p.jsonl")) as file:
            rows = [json.loads(line) for line in file]
        self.assertEqual(len(rows), result["poses"])
        self.assertIsNone(rows[-1]["roll_rad"])
        self.assertIn("roll_undefined", rows[-1]["flag_names"])
        self.track(out=self.path("p.csv"), gain=1)
        with open(self.path("p.csv")) as file:
            lines = file.read().splitlines()
        self.assertIn("rotation about the axis of the coil is undefined", lines[0])
        poses = tricoil.read_poses(self.path("p.csv"))
        self.assertGreater(len(poses), 0.95 * result["poses"])

    def test_body(self):
        _generator_simulate.run(out=self.path("c.csv"), save=self.path("g.toml"), path=self.path("path.csv"), slot_s=SLOT_S, place="0,0,0.24", body=True)
        result, _ = self.track(body=True)
        self.assertTrue(result["roll"] == "determined" and result["truth"]["position_rms_m"] < 0.5e-3 and result["truth"]["wrong"] == 0, result)

    def test_bad_input(self):
        refused = lambda says, **options: self.assertRaisesRegex(ValueError, says, self.track, **options)
        refused("--slot-s SECONDS is needed", slot_s=None)
        refused("--generator FILE is needed", generator=None)
        refused("is --slot-s right", slot_s=0.03)
        refused("fewer equations than unknowns", without="c1,c2,c3,c4")
        refused("gain: must be positive", gain=0)
        refused("--without c9: is not a coil", without="c9")
        refused("not with --body", body=True, gain=1)
        refused("two sensor coils or more", body=True)
        with open(self.path("c.csv")) as file:
            lines = file.read().splitlines()
        for name, changed, says in (("time_s", [line.split(",", 1)[1] for line in lines], "a column time_s is needed"),
                                    ("order", [lines[0], lines[2], lines[1], lines[3]], "time_s must increase"),
                                    ("coil", [lines[0].replace("c8", "c9"), *lines[1:]], "no couplings of coil c8")):
            with open(self.path("c.csv"), "w") as file:
                file.write("\n".join(changed) + "\n")
            with self.subTest(name):
                refused(says)

    def test_no_two_coils_may_be_exchanged(self):
        world = World(0.5, frames=120)
        straight = world.couplings
        for one, other in itertools.combinations(range(len(world.generator)), 2):
            world.couplings = straight.copy()
            world.couplings[:, :, [one, other]] = straight[:, :, [other, one]]
            poses, _ = world.tracked()
            error = np.linalg.norm(poses["position_m"] - world.position_m[np.searchsorted(world.times.ravel(), poses["time_s"] - 1e-9)], axis=1)
            with self.subTest(f"{one}, {other}"):
                self.assertEqual(np.sum(poses["valid"] & (error > WRONG_M)), 0)

    def test_other_order_and_flat_coils(self):
        with open(self.path("c.csv")) as file:
            lines = file.read().splitlines()
        with open(self.path("c.csv"), "w") as file:  # two coils are exchanged
            file.write("\n".join([lines[0].replace("c2", "c0").replace("c5", "c2").replace("c0", "c5"), *lines[1:]]) + "\n")
        result, _ = self.track(gain=1)
        self.assertTrue(result["valid"] < 0.1 * result["poses"] and "in the same order" in result["notes"][0], result)
        flat = tricoil.Generator(tuple(f"c{n + 1}" for n in range(8)), tricoil.planar_generator().position_m, np.tile([0, 0, 5e-3], (8, 1)))
        with open(self.path("g.toml"), "w") as file:
            file.write(_generator.to_toml(flat))
        _generator_simulate.run(out=self.path("c.csv"), generator=self.path("g.toml"), path=self.path("path.csv"), slot_s=SLOT_S, place="0,0,0.24")
        result, _ = self.track(gain=1, side=None)
        self.assertTrue(result["valid"] == 0 and "--side" in result["notes"][0], result)
        result, _ = self.track(gain=1)
        self.assertTrue(result["truth"]["wrong"] == 0 and result["truth"]["position_rms_m"] < 1e-3, result)

    def test_arguments(self):
        generator = tricoil.planar_generator()
        wrong = lambda says, **options: self.assertRaisesRegex(ValueError, says, tricoil.CoilFilter, generator, **{"frame_s": FRAME_S, **options})
        wrong("gain: must be positive", gain=0.0)
        wrong("frame_s and gain_deviation", frame_s=0)
        wrong("side: must be three", side=(0, 0, 0))
        wrong("sensors: a body needs two", sensors=[1])
        wrong("no mount of sensor coil 3", sensors=[3, 4])
        wrong("used: give True or False", used=[True])
        one = tricoil.CoilFilter(generator, FRAME_S, gain=1.0)
        world = World(0.5, frames=4)
        self.assertRaisesRegex(ValueError, "times_s, couplings: have shapes", one.update, world.times[:, :4], world.couplings, world.sigma)
        self.assertRaisesRegex(ValueError, "sigma: must be positive", one.update, world.times, world.couplings, 0.0)
        self.assertRaisesRegex(ValueError, "times_s: must not decrease", one.update, world.times[::-1], world.couplings, world.sigma)

    @unittest.skipUnless("TRICOIL_PROGRAM" in os.environ, "needs the program")
    def test_live_in_the_chain(self):
        program, track = os.environ["TRICOIL_PROGRAM"], [os.environ["TRICOIL_PROGRAM"], "generator", "track", "-", "--generator", self.path("g.toml"), "--slot-s", "0.003", "--side", "0,0,1", "--gain", "1", "--out", "-"]
        with open(self.path("c.csv")) as couplings:
            lines = subprocess.run(track, stdin=couplings, capture_output=True, text=True, check=True).stdout
        done = subprocess.run([program, "run", "--device", "poses:-", "--out", self.path("out.csv"), "--json"], input=lines, capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stderr)
        result = json.loads(done.stdout.splitlines()[-1])
        refused = subprocess.run([program, "run", "--device", "couplings:-", "--calibration", self.path("g.toml")], stdin=subprocess.DEVNULL, capture_output=True, text=True)
        self.assertEqual((refused.returncode, "is a generator for sensors of one coil" in refused.stderr), (2, True), refused.stderr)
        with open(self.path("poses.toml"), "w") as file:
            file.write('device = "poses:-"\n')
        for words, source in itertools.product((["run", "--record", self.path("take")], ["serve", "--web", "0", "--record-folder", self.folder.name]),
                                               (["--device", "poses:-"], ["--config", self.path("poses.toml")])):
            refused = subprocess.run([program, words[0], *source, *words[1:]], stdin=subprocess.DEVNULL, capture_output=True, text=True)
            self.assertEqual((refused.returncode, "poses have no columns" in refused.stderr), (2, True), refused.stderr)
        self.assertEqual(result["flags_seen"].split(", ")[-1], "roll_undefined", result)
        with open(self.path("out.csv")) as file:
            self.assertIn("roll_undefined", file.read().splitlines()[-1])


if __name__ == "__main__":
    unittest.main()
