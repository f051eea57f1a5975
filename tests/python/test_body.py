"""Bodies with two or more sensor coils in the field of a generator: accuracy, stated errors, files and bad input."""

import dataclasses
import os
import pathlib
import subprocess
import unittest

import numpy as np
import tricoil
from folder_case import FolderCase
from scipy.spatial.transform import Rotation
from tricoil import _generator_simulate

SIDE = (0, 0, 1)
MOUNTS = _generator_simulate.BODY


def body(mounts=MOUNTS):
    return dataclasses.replace(tricoil.planar_generator(), sensors=mounts)


def measured(generator, count, snr_db, seed=3):
    """True positions and attitudes, noisy couplings (K, M, N) with errors of the gains, and sigma (K, M)."""
    rng = np.random.default_rng(seed)
    position, _ = _generator_simulate._random(count, rng)
    turn = Rotation.random(count, random_state=seed)
    couplings = []
    for mount in generator.sensors.values():
        gain = mount.gain * (1 + 2e-3 * rng.normal(size=count))
        couplings.append(generator.couplings(position + turn.apply(mount.offset_m), turn.apply(mount.axis), gain))
    sigma = np.sqrt(np.mean(np.square(couplings), axis=2)) * 10 ** (-snr_db / 20)
    return position, turn, couplings + sigma[:, :, None] * rng.normal(size=np.shape(couplings)), sigma


def errors(rows, position, turn):
    q = Rotation.from_quat(rows["quaternion_wxyz"][:, [1, 2, 3, 0]])
    return np.hstack((rows["position_m"] - position, (q * turn.inv()).as_rotvec()))


class Body(unittest.TestCase):
    def test_stated_errors_are_the_errors(self):
        beside = {1: tricoil.SensorCoil(0.8, np.array([0, 0.01, 0]), np.array([0, 0, 1.0])), 4: tricoil.SensorCoil(1.3, np.array([0.01, 0, 0]), np.array([0, 0, 1.0]))}
        for mounts in (MOUNTS, beside):  # parallel coils side by side show all angles too
            generator = body(mounts)
            for snr_db in (50, 80):
                position, turn, couplings, sigma = measured(generator, 600, snr_db)
                rows = tricoil.solve_6dof(couplings, generator, list(mounts), sigma, side=SIDE)
                good = rows["end"] == 0
                error = errors(rows, position, turn)[good]
                nees = np.einsum("mi,mij,mj->m", error, np.linalg.inv(rows["covariance"][good]), error) / 6
                with self.subTest(mounts=list(mounts), snr_db=snr_db):
                    self.assertGreater(good.mean(), 0.97)
                    self.assertAlmostEqual(nees.mean(), 1, delta=0.1)
                    self.assertLess(np.linalg.norm(error[:, :3], axis=1).max(), 0.03)

    def test_one_coil_without_a_pose_of_its_own(self):
        """The poses of the other coil and the couplings of this one are enough."""
        generator = body()
        position, turn, couplings, sigma = measured(generator, 200, 60)
        sigma[1] *= 300
        couplings[1] += sigma[1][:, None] * np.random.default_rng(1).normal(size=couplings[1].shape)
        alone = tricoil.solve_5dof(couplings[1], generator, sigma[1], gain=1.0, side=SIDE)
        rows = tricoil.solve_6dof(couplings, generator, [1, 2], sigma, side=SIDE)
        lost = alone["end"] != 0
        self.assertGreater(lost.sum(), 20)
        good = lost & (rows["end"] == 0)
        self.assertGreater(good.sum(), 0.3 * lost.sum())
        deviation = np.sqrt(np.trace(rows["covariance"][good][:, :3, :3], axis1=1, axis2=2))
        self.assertLess(np.median(np.linalg.norm(errors(rows, position, turn)[good, :3], axis=1) / deviation), 2)

    def test_one_record(self):
        generator = body()
        position, turn, couplings, sigma = measured(generator, 1, 80)
        row = tricoil.solve_6dof(couplings[:, 0], generator, (1, 2), float(sigma.max()), side=SIDE)
        self.assertEqual((row.shape, tricoil.ENDS_5DOF[row["end"]]), ((), "converged"))
        np.testing.assert_allclose(row["position_m"], position[0], atol=1e-3)

    def test_bodies_and_shapes_that_cannot_be_are_refused(self):
        line = {1: tricoil.SensorCoil(1, np.zeros(3), np.array([0, 0, 1.0])), 2: tricoil.SensorCoil(1, np.array([0, 0, 0.02]), np.array([0, 0, -1.0]))}
        _, _, couplings, _ = measured(body(), 4, 60)
        for generator, sensors, values, sigma, message in (
                (body(line), (1, 2), couplings, 1e-6, "lie on one line"), (body(), (1,), couplings, 1e-6, "two sensor coils or more"), (body(), (1, 1), couplings, 1e-6, "each once"),
                (body(), (1, 3), couplings, 1e-6, "no mount of sensor coil 3"), (body({**MOUNTS, 2: tricoil.SensorCoil(1)}), (1, 2), couplings, 1e-6, "no mount of sensor coil 2"),
                (body(), (1, 2), couplings[:1], 1e-6, r"has shape \(1, 4, 8\); give"), (body(), (1, 2), couplings[:, :, :5], 1e-6, "has shape"),
                (body(), (1, 2), couplings, np.ones((3, 4)), "sigma: has shape"), (body(), (1, 2), couplings, 0.0, "sigma: must be positive"), (body(), (1, 2), couplings * np.nan, 1e-6, "NaN or infinity")):
            with self.subTest(message), self.assertRaisesRegex(ValueError, message):
                tricoil.solve_6dof(values, generator, sensors, sigma, side=SIDE)


class Command(FolderCase):
    def setUp(self):
        super().setUp()
        self.toml, self.csv, self.out = (self.path(name) for name in ("body.toml", "coils.csv", "body.csv"))

    def write(self, name, text):
        with open(self.path(name), "w", encoding="utf-8") as file:
            file.write(text)
        return self.path(name)

    def program(self, *words):
        return subprocess.run([os.environ["TRICOIL_PROGRAM"], "generator", *words], capture_output=True, text=True, check=False)

    def simulated(self, *words):
        done = self.program("simulate", "--body", "--out", self.csv, "--save", self.toml, "--count", "60", *words)
        self.assertEqual(done.returncode, 0, done.stderr)

    def test_from_simulation_to_poses_that_other_commands_read(self):
        time_s = np.arange(0, 2, 0.02)
        turn = Rotation.from_rotvec(np.outer(np.sin(time_s), [0.3, -0.2, 0.5])).as_quat()[:, [3, 0, 1, 2]]
        path = self.write("path.csv", "time_s,x_m,y_m,z_m,qw,qx,qy,qz\n" + "".join(
            ",".join(map(repr, [t, 0.1 * np.sin(3 * t), 0.05 * t, 0.02, *q])) + "\n" for t, q in zip(time_s.tolist(), turn.tolist())))
        done = self.program("simulate", "--body", "--out", self.csv, "--save", self.toml, "--path", path)
        self.assertEqual(done.returncode, 0, done.stderr)
        done = self.program("solve", self.csv, "--body", "--generator", self.toml, "--side", "0,0,1", "--out", self.out)
        self.assertRegex(done.stdout, r"(\d+) of \1 poses of the body solved, by sensor coils 1, 2\n.*\n  against the truth: 0\.\d+ mm RMS .* 0 wrong")
        poses = tricoil.read_poses(self.out)
        self.assertEqual(poses.quaternion_wxyz.shape, (len(poses.time_s), 4))
        self.assertGreater(len(poses.time_s), 70)
        self.assertTrue(np.all(poses.deviation > 0))

    def test_result_of_the_package(self):
        self.simulated()
        result = tricoil.command("generator solve", self.csv, generator=self.toml, body=True, side="0,0,1", out=self.out + ".jsonl")
        self.assertEqual((result["poses"], result["sensors"], result["truth"]["wrong"]), (60, [1, 2], 0))
        self.assertLess(result["truth"]["position_rms_m"], 1e-3)
        self.assertEqual(pathlib.Path(self.out + ".jsonl").read_text().count('"status": "converged"'), result["solved"])

    def test_tables_that_cannot_be_are_refused(self):
        self.simulated()
        lines = pathlib.Path(self.csv).read_text().splitlines(True)
        half, late = self.write("half.csv", "".join(lines[:-3])), self.write("one.csv", "".join(lines[:61]))
        timed = "".join([f"time_s,{lines[0]}", *(f"{n % 60 + (n == 90)},{line}" for n, line in enumerate(lines[1:]))])
        coils = self.write("coils.toml", pathlib.Path(self.toml).read_text().split("[[sensor]]")[0])
        solve = ("solve", "--body", "--generator", self.toml)
        for words, message in (((*solve, half), "sensor coil 1 has 60 rows, 2 has 57"), ((*solve, late), "needs rows of two sensor coils"),
                               ((*solve, self.write("timed.csv", timed)), "row 31 of sensor coil 2 has the time 31 s"),
                               ((*solve, self.csv, "--gain", "1"), "--gain: not with --body"), ((*solve, self.csv, "--slot-s", "0.001"), "--slot-s: not with --body"),
                               (("solve", "--body", "--generator", coils, self.csv), "no mount of sensor coil 1"),
                               (("simulate", "--body", "--generator", coils, "--out", self.out), "has no sensor coil with a place in a body")):
            done = self.program(*words)
            with self.subTest(message):
                self.assertEqual((done.returncode, done.stderr.count("\n")), (2, 1), done.stderr)
                self.assertIn(message, done.stderr)
        self.assertFalse(os.path.exists(self.out))


@unittest.skipUnless(os.environ.get("TRICOIL_DATA_DIR"), "TRICOIL_DATA_DIR with ilemt-mountings is not set")
class Recorded(FolderCase):
    def test_three_coils_in_the_field_of_nine(self):
        folder = pathlib.Path(os.environ["TRICOIL_DATA_DIR"], "ilemt-mountings")
        of = lambda kind: [str(folder / f"{one}_seYoutZup_{kind}.dat") for one in ("soYoutZup", "soXinYup", "soXoutZup")]
        toml = self.path("nine.toml")
        tricoil.command("generator calibrate", *of("md"), out=toml)
        truth = tricoil.command("generator solve", *of("ld"), generator=toml, body=True)["truth"]
        self.assertEqual(truth["wrong"], 0)
        self.assertLess(truth["position_rms_m"], 0.25e-3)
        self.assertLess(truth["rotation_rms_deg"], 0.1)
        self.assertTrue(0.8 < truth["nees"] < 1.4, truth)


if __name__ == "__main__":
    unittest.main()
