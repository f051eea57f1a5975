"""Sensors of one coil in the field of a generator: bound, cold starts, motion error, calibration, files and bad input."""

import json
import os
import pathlib
import subprocess
import tempfile
import unittest

import numpy as np
from scipy.spatial.transform import Rotation

import tricoil
from tricoil import _generator_calibrate, _generator_simulate, _generator_solve

SIDE = (0, 0, 1)


def random_poses(count, seed=1):
    rng = np.random.default_rng(seed)
    position, axis = _generator_simulate._random(count, rng)
    return position, axis, rng


def bound(generator, position, axis, sigma, gain_deviation):
    """Cramer-Rao bound of the position, m: root of the trace."""
    jacobian = generator.field(position, axis)[:, :, 1:] / sigma[:, None, None]
    information = np.einsum("mni,mnj->mij", jacobian, jacobian)
    information[:, 3:, 3:] += np.einsum("mi,mj->mij", axis, axis) / gain_deviation**2
    unit = np.diag([0.1, 0.1, 0.1, 1, 1, 1])
    return np.sqrt(np.trace((unit @ np.linalg.inv(unit @ information @ unit) @ unit)[:, :3, :3], axis1=1, axis2=2))


def measured(generator, count, snr_db, seed, gain_deviation=2e-3):
    """True positions and axes, noisy couplings and sigma. snr_db: a number, or limits of a uniform distribution."""
    position, axis, rng = random_poses(count, seed)
    true = generator.couplings(position, axis, 1 + gain_deviation * rng.normal(size=count))
    db = rng.uniform(*snr_db, count) if np.ndim(snr_db) else np.full(count, float(snr_db))
    sigma = np.sqrt(np.mean(true**2, axis=1)) * 10 ** (-db / 20)
    return position, axis, true + sigma[:, None] * rng.normal(size=true.shape), sigma


class Bound(unittest.TestCase):
    def test_errors_are_at_the_bound(self):
        generator = tricoil.planar_generator()
        for snr_db in (50, 80):
            position, axis, couplings, sigma = measured(generator, 4000, snr_db, 3)
            rows = tricoil.solve_5dof(couplings, generator, sigma, gain=1.0, side=SIDE)
            good = rows["end"] == 0
            self.assertGreater(good.mean(), 0.98)
            error = np.linalg.norm(rows["position_m"] - position, axis=1)[good]
            limit = bound(generator, position, axis, sigma, 2e-3)[good]
            ratio = np.sqrt(np.mean(error**2 / limit**2))
            with self.subTest(snr_db, ratio=ratio):
                self.assertGreater(ratio, 0.97)  # 4000 poses: 1 +- 0.01
                self.assertLess(ratio, 1.05)
                compared = _generator_solve._compared(rows, (position, axis))
                self.assertGreater(compared["nees"], 0.8)
                self.assertLess(compared["nees"], 1.2)

    def test_no_cold_start_is_wrong(self):
        for snr_db in (np.inf, (20, 100)):
            generator = tricoil.planar_generator()
            position, axis, couplings, sigma = measured(generator, 3000, 120 if snr_db == np.inf else snr_db, 5)
            rows = tricoil.solve_5dof(couplings, generator, sigma, gain=1.0, side=SIDE)
            good = rows["end"] == 0
            error = np.linalg.norm(rows["position_m"] - position, axis=1)
            limit = bound(generator, position, axis, sigma, 2e-3)
            with self.subTest(snr_db):
                self.assertEqual(np.sum(good & (error > 8 * limit) & (error > 0.02)), 0)
                self.assertGreater(good.mean(), 0.9 if np.ndim(snr_db) else 0.999)

    def test_rows_that_follow_are_the_same(self):
        generator = tricoil.planar_generator()
        t = np.linspace(0, 6, 200)
        position = np.column_stack((0.1 * np.cos(t), 0.1 * np.sin(t), 0.2 + 0.02 * t))
        couplings = generator.couplings(position, np.tile([0.6, 0, 0.8], (200, 1)))
        cold, warm = (tricoil.solve_5dof(couplings, generator, 1e-8, gain=1.0, side=SIDE, follow=follow) for follow in (False, True))
        np.testing.assert_allclose(cold["position_m"], warm["position_m"], atol=1e-7)
        np.testing.assert_allclose(warm["position_m"], position, atol=1e-7)


class MotionError(unittest.TestCase):
    def test_prediction_is_the_error_of_the_simulation(self):
        """Coils in turn, solved as if at once: the first-order error, from the true motion."""
        generator, slot_s = tricoil.planar_generator(), 1e-3
        times = slot_s * (np.arange(8) - 3.5)
        position, axis, rng = random_poses(400, 7)
        velocity, omega = rng.normal(0, 0.1, (400, 3)), rng.normal(0, 1, (400, 3))
        moved = position[:, None] + times[:, None] * velocity[:, None]
        turned = np.stack([Rotation.from_rotvec(omega * dt).apply(axis) for dt in times], axis=1)
        couplings = _generator_simulate.couplings_at_slots(generator, moved, turned, 1.0)
        sigma = 1e-5 * np.sqrt(np.mean(couplings**2, axis=1))
        for gain in (1.0, None):
            error, turn = tricoil.generator_motion_error(generator, position, axis, velocity, np.cross(omega, axis), times, known_gain=gain is not None, sigma=sigma)
            rows = tricoil.solve_5dof(couplings, generator, sigma, gain=gain, side=SIDE)
            actual = rows["position_m"] - position
            small = np.linalg.norm(error, axis=1) < 0.01  # the first order holds
            with self.subTest(gain=gain):
                self.assertGreater(small.mean(), 0.9)
                rms = lambda v: np.sqrt(np.mean(np.sum(v[small] ** 2, axis=1)))
                self.assertLess(abs(rms(error) / rms(actual) - 1), 0.05)
                self.assertLess(rms(actual - error), 0.1 * rms(actual))
                self.assertLess(abs(rms(turn) / rms(rows["axis"] - axis) - 1), 0.05)


class Files(unittest.TestCase):
    def setUp(self):
        place = tempfile.TemporaryDirectory()
        self.addCleanup(place.cleanup)
        self.folder = pathlib.Path(place.name)

    def path(self, name):
        return str(self.folder / name)

    def simulated(self, **options):
        _generator_simulate.run(out=self.path("coil.csv"), save=self.path("g.toml"), **options)
        return self.path("coil.csv"), self.path("g.toml")

    def test_simulated_calibrated_and_solved(self):
        table, _ = self.simulated(count=400, snr_db=80)
        result, _ = _generator_calibrate.run([table], out=self.path("c.toml"))
        self.assertLess(result["residual"], 1e-3)
        solved, rows = _generator_solve.run([table], generator=self.path("c.toml"), side=SIDE, out=self.path("p.csv"))
        self.assertEqual(solved["solved"], 400)
        self.assertLess(solved["truth"]["position_rms_m"], 5e-4)
        again = np.genfromtxt(self.path("p.csv"), delimiter=",", names=True, dtype=None, encoding=None)
        np.testing.assert_allclose(again["x_m"], rows["position_m"][:, 0], rtol=1e-8)
        self.assertTrue(np.isnan(again["roll_rad"]).all())
        _generator_solve.run([table], generator=self.path("c.toml"), side=SIDE, out=self.path("p.jsonl"))
        first = json.loads((self.folder / "p.jsonl").read_text().splitlines()[0])
        self.assertIsNone(first["roll_rad"])
        self.assertEqual(first["status"], "converged")

    def test_poses_that_do_not_determine_the_coils_are_refused(self):
        generator = tricoil.planar_generator()
        position, axis, rng = random_poses(60)
        line, plane = position[:1] + np.linspace(0, 0.2, 60)[:, None] * [1, 0.3, 0.2], position * [1, 1, 0] + [0, 0, 0.2]
        for name, p, n, message in (("one pose", position[:1], axis[:1], "do not determine"), ("line", line, axis[:1], "do not determine"),
                                    ("plane", plane, [[0, 0, 1.0]], "both sides"), ("plane, inclined", plane, axis, None), ("few", position[:8], axis[:8], "at least 12")):
            p, n = (np.broadcast_to(v, (len(p) if name == "few" else 60, 3)) for v in (p, n))
            c = generator.couplings(p, n)
            c *= 1 + 1e-4 * rng.normal(size=c.shape)
            np.savetxt(self.path("poses.csv"), np.hstack((p, n, c)), delimiter=",", header="x_m,y_m,z_m,nx,ny,nz," + ",".join(generator.names), comments="")
            with self.subTest(name):
                if message is None:
                    _generator_calibrate.run([self.path("poses.csv")], out=self.path("c.toml"))
                    continue
                with self.assertRaisesRegex(ValueError, f"poses.csv: .*{message}"):
                    _generator_calibrate.run([self.path("poses.csv")], out=self.path("c.toml"))

    def test_gains_that_differ_and_a_misfit_by_degrees_of_freedom(self):
        generator = tricoil.planar_generator()
        for gains, message in (((1, 30.0), None), ((0.01, 1), None), ((1, -1.0), "sensor coil 2 is reversed")):
            position, axis, rng = random_poses(48)
            sensor = np.arange(48) % 2
            c = generator.couplings(position, axis, np.array(gains)[sensor])
            c += 1e-3 * np.linalg.norm(c, axis=1, keepdims=True) * rng.normal(size=c.shape)
            np.savetxt(self.path("two.csv"), np.column_stack((position, axis, sensor + 1, c)), delimiter=",", header="x_m,y_m,z_m,nx,ny,nz,sensor," + ",".join(generator.names), comments="")
            run = lambda: _generator_calibrate.run([self.path("two.csv")], out=self.path("c.toml"), model="dipole")
            with self.subTest(gains):
                if message:
                    self.assertRaisesRegex(ValueError, message, run)
                    continue
                found = run()[1]
                self.assertAlmostEqual(found.sensors[2].gain / found.sensors[1].gain / (gains[1] / gains[0]), 1, delta=0.01)
                self.assertAlmostEqual(np.sqrt(np.mean(found.misfit**2)), 1e-3, delta=1e-4)  # 48 rows, 49 unknowns of 384: without them 7 % less

    def test_wrong_noise_and_coils_are_one_clear_line(self):
        generator = tricoil.planar_generator()
        couplings = generator.couplings(*random_poses(3)[:2])
        for options, message in (({"sigma": -1e-6}, "sigma: must be from 0"), ({"sigma": 1e300}, "sigma: must be from 0"), ({"sigma": [1e-6] * 4}, "sigma: has shape"),
                                 ({"sigma": 1e-6, "used": [True] * 7}, "used: has shape"), ({"sigma": 1e-6, "used": [1.0] * 8}, "used: has shape")):
            with self.subTest(options), self.assertRaisesRegex(ValueError, message):
                tricoil.solve_5dof(couplings, generator, **options)

    def test_rows_of_couplings_are_equal_or_one(self):
        generator = tricoil.planar_generator()
        position, axis, _ = random_poses(4)
        every = generator.couplings(position, axis[:1], [1, 2, 3, 4])
        np.testing.assert_allclose(every[2], 3 * generator.couplings(position[2], axis[0])[0])
        self.assertEqual(generator.couplings(position[:1], axis).shape, (4, 8))
        for wrong in ((position, axis[:3]), (position, axis, [1, 2]), (position, axis, [[1]])):
            self.assertRaisesRegex(ValueError, "same number, or one", generator.couplings, *wrong)
        for wrong in ((position, axis[:1]), (position.ravel(), axis), (position[:, :2], axis)):
            self.assertRaisesRegex(ValueError, "same shape", generator.field, *wrong)

    def test_mounts_crosstalk_and_sizes_are_estimated(self):
        """Two coils on a body that turns in all directions: their offsets and axes are unknown."""
        rng = np.random.default_rng(4)
        planar = tricoil.planar_generator(6)
        true = tricoil.Generator(planar.names, planar.position_m, planar.moment, np.full(6, -4e-4), 0.01 * rng.normal(size=(6, 6)) * (1 - np.eye(6)))
        body, turn = rng.uniform((-0.15, -0.15, 0.12), (0.15, 0.15, 0.4), (300, 3)), Rotation.random(300, random_state=2)
        offset, axis = np.array([[0.01, -0.02, 0.005], [0, 0.015, 0.02]]), np.array([[0.6, 0.8, 0], [0, 0, -1.0]])
        lines = ["x_m,y_m,z_m,qw,qx,qy,qz,sensor," + ",".join(true.names)]
        for sensor in (0, 1):
            c = true.couplings(body + turn.apply(offset[sensor]), turn.apply(axis[sensor]), 1.1 - 0.2 * sensor)
            c *= 1 + 1e-5 * rng.normal(size=c.shape)
            for p, (x, y, z, w), row in zip(body, turn.as_quat(), c):
                lines.append(",".join(map(repr, map(float, [*p, w, x, y, z]))) + f",{sensor + 1}," + ",".join(map(repr, row.tolist())))
        (self.folder / "two.csv").write_text("\n".join(lines) + "\n")
        result, generator = _generator_calibrate.run([self.path("two.csv")], out=self.path("c.toml"), model="full")
        self.assertLess(result["residual"], 5e-4)
        np.testing.assert_allclose(generator.sensors[1].offset_m, offset[0], atol=5e-4)
        np.testing.assert_allclose(generator.crosstalk, np.linalg.inv(np.eye(6) + np.linalg.inv(np.eye(6) + true.crosstalk) - np.eye(6)) - np.eye(6), atol=3e-3)
        solved, _ = _generator_solve.run([self.path("two.csv")], generator=self.path("c.toml"), side=SIDE)
        self.assertGreater(solved["solved"], 590)
        self.assertLess(solved["truth"]["position_rms_m"], 3e-4)

    def test_mountings_of_one_source_by_the_program(self):
        """Two files of a stage: a generator of six coils, by the program."""
        rng = np.random.default_rng(6)
        stage = np.column_stack((rng.uniform(-50, 50, (150, 3)), np.zeros((150, 2)), rng.choice([0, 90, 180, 45], 150)))
        for name, middle in (("soA", (0.02, -0.2, 0)), ("soB", (-0.06, -0.24, 0.03))):
            places = np.array(middle) + rng.uniform(-0.03, 0.03, (3, 3))
            source = tricoil.Generator(("1", "2", "3"), places, 1e-3 * (np.eye(3) + 0.1 * rng.normal(size=(3, 3))))
            turn = Rotation.from_euler("Z", stage[:, 5], degrees=True)
            sensors = [source.couplings(stage[:, :3] / 1e3 + turn.apply(offset), turn.apply(axis)) for offset, axis in (((0.01, 0, 0), (1, 0, 0)), ((0, 0.01, 0.01), (0, 1, 0)),
                                                                                                              ((0, 0, 0), (0, 0, 1)))]
            lines = ["\t".join([*(f"{v:.5f}" for v in pose), *(f"{sensor[n, coil]:+.12f}+0.000000000i" for sensor in sensors for coil in range(3))]) for n, pose in enumerate(stage)]
            (self.folder / f"{name}_seX_md.dat").write_text("\n".join(lines) + "\n")
        run = lambda *words: subprocess.run([os.environ["TRICOIL_PROGRAM"], "generator", *words, "--json"], cwd=self.folder, capture_output=True, text=True, check=False)
        done = run("calibrate", "soA_seX_md.dat", "soB_seX_md.dat", "--out", "c.toml", "--model", "dipole")
        self.assertEqual(done.stderr, "")
        self.assertLess(json.loads(done.stdout)["residual"], 1e-3)
        solved = json.loads(run("solve", "soB_seX_md.dat", "soA_seX_md.dat", "--generator", "c.toml", "--side", "0,1,0").stdout)
        self.assertEqual(solved["truth"]["wrong"], 0)
        self.assertGreater(solved["solved"], 430)
        self.assertLess(solved["truth"]["position_rms_m"], 5e-4)

    def along_a_path(self):
        t = np.arange(0, 4, 0.01)
        q = Rotation.from_rotvec(np.column_stack((np.sin(t), 0.5 * np.cos(t), t / 4))).as_quat()[:, [3, 0, 1, 2]]
        table = np.column_stack((t, 0.1 * np.sin(t), 0.1 * np.cos(1.3 * t), 0.03 * np.sin(0.7 * t), q))
        np.savetxt(self.path("path.csv"), table, delimiter=",", header="time_s,x_m,y_m,z_m,qw,qx,qy,qz", comments="")
        return self.simulated(path=self.path("path.csv"), slot_s=0.003, rate_hz=40, snr_db=100)

    def test_the_predicted_motion_error_is_that_of_the_solved_rows_and_used_coils(self):
        table, generator = self.along_a_path()
        solve = lambda name, **more: _generator_solve.run([name], generator=generator, side=SIDE, sigma=2e-3, slot_s=0.003, **more)[0]
        lines = (self.folder / "coil.csv").read_text().splitlines()
        for n in (20, 21, 60):  # couplings that fit no pose
            lines[n] = ",".join([*lines[n].split(",")[:-8], *["0.1", "-0.3", "0.2", "0.4"] * 2])
        (self.folder / "damaged.csv").write_text("\n".join(lines) + "\n")
        whole, damaged = (solve(name, gain=1, out=self.path("p.jsonl"))["motion"]["position_rms_m"] for name in (table, self.path("damaged.csv")))
        self.assertLess(abs(damaged / whole - 1), 0.05)
        self.assertEqual(sum(json.loads(line)["motion_error_m"] is None for line in (self.folder / "p.jsonl").read_text().splitlines()), 3)
        fewer = solve(table, gain=1, without="c1,c2")
        self.assertLess(abs(fewer["motion"]["position_rms_m"] / fewer["truth"]["position_rms_m"] - 1), 0.05)
        unknown = solve(table)["motion"]
        text = (self.folder / "g.toml").read_text()
        (self.folder / "g.toml").write_text(text + "\n[[sensor]]\nnumber = 7\ngain = 1\n")  # of another sensor coil
        self.assertEqual(solve(table)["motion"], unknown)
        for wrong in (1e9, -0.003, float("nan")):
            self.assertRaisesRegex(ValueError, "--slot-s: must be from 0 to 1", _generator_solve.run, [table], generator=generator, slot_s=wrong)

    def test_time_slots_along_a_path(self):
        table, generator = self.along_a_path()
        result, _ = _generator_solve.run([table], generator=generator, side=SIDE, gain=1, sigma=2e-3, slot_s=0.003)
        self.assertGreater(result["solved"], 0.95 * result["poses"])
        self.assertLess(abs(result["motion"]["position_rms_m"] / result["truth"]["position_rms_m"] - 1), 0.05)

    def test_bad_input_is_one_line(self):
        table, generator = self.simulated(count=20)
        seventeen = (self.folder / "g.toml").read_text() + "".join(f'\n[[coil]]\nname = "d{n}"\nposition_m = [0, 0, {n}]\nmoment = [0, 0, 1]\n' for n in range(9))
        (self.folder / "many.toml").write_text(seventeen)
        text = (self.folder / "coil.csv").read_text()
        other = text.replace("c8", "c9", 1)
        (self.folder / "other.csv").write_text(other)
        rows = text.splitlines()
        (self.folder / "silent.csv").write_text("\n".join([rows[0]] + [",".join([*row.split(",")[:9], "0", *row.split(",")[10:]]) for row in rows[1:]]) + "\n")
        (self.folder / "fewer.csv").write_text("\n".join(row.rsplit(",", 1)[0] for row in rows) + "\n")
        (self.folder / "empty.toml").write_text("a = 1\n")
        (self.folder / "short.csv").write_text("time_s,x_m,y_m,z_m,qw,qx,qy,qz\n" + "".join(f"{0.01 * n},0,0,{0.01 * n},1,0,0,0\n" for n in range(4)))
        solve, simulate = _generator_solve.run, lambda **options: _generator_simulate.run(out=self.path("x.csv"), **options)
        for call, message in (
            (lambda: solve([table], generator=generator, gain=0), "--gain: must be positive"),
            (lambda: solve([table], generator=generator, without="c1,c2,c3"), "fewer equations than unknowns"),
            (lambda: solve([table], generator=generator, without="c1,c2,c3,c4", gain=1), "fewer equations than unknowns"),
            (lambda: solve([table], generator=generator, without="c99"), "c99: is not a coil"),
            (lambda: solve([table], generator=self.path("many.toml")), "many.toml: a generator has 1 to 16 coils; there are 17"),
            (lambda: solve([self.path("other.csv")], generator=generator), "other.csv: no couplings of coil c8"),
            (lambda: solve([self.path("fewer.csv")], generator=generator), "fewer.csv: no couplings of coil c8"),
            (lambda: solve([self.path("silent.csv")], generator=generator), "coil c3 is silent in every row"),
            (lambda: solve([table], generator=self.path("empty.toml")), "empty.toml: no generator"),
            (lambda: solve([table]), "--generator FILE is needed"),
            (lambda: solve([table], generator=generator, side="0,0"), "--side must be 3 numbers"),
            (lambda: solve([table], generator=generator, slot_s=0.001), "--slot-s: needs a column time_s"),
            (lambda: _generator_calibrate.run([self.path("silent.csv")], out=self.path("c.toml")), "coil c3 is silent"),
            (lambda: _generator_calibrate.run([table], out=self.path("c.toml"), model="best"), "--model must be"),
            (lambda: simulate(coils=17), "--coils: must be from 1 to 16"),
            *((lambda db=db: simulate(snr_db=db), "--snr-db: must be from -100 to 400") for db in ("nan", 1e9, -400)),
            *((lambda name=name: simulate(**{name: 0.01}), "only with --path") for name in ("slot_s", "place", "rate_hz")),
            (lambda: simulate(generator=generator, coils=3), "--coils: the generator has its own"),
            (lambda: simulate(path=self.path("short.csv"), count=3), "--count: only without --path"),
            (lambda: simulate(path=self.path("short.csv"), slot_s=0.01, rate_hz=10), "short.csv: lasts 0.03 s, less than the slots"),
        ):
            with self.subTest(message), self.assertRaisesRegex(ValueError, message):
                call()

    def test_the_file_of_a_generator_is_checked(self):
        _, path = self.simulated(count=20)
        text = (self.folder / "g.toml").read_text()
        with_sensor = text + "[[sensor]]\nnumber = 1\ngain = 1.0\n"
        for damaged, message in (
            ("crosstalk = {a = 1}\n" + text, "crosstalk must be 8 rows"),
            ("crosstalk = [[\"1\"]]\n" + text, "crosstalk must be 8 rows"),
            ("colour = 1\n" + text, "unknown key colour"),
            ("a." * 200_000 + "a = 1\n" + text, "more than 16 parts"),
            ("a = " + "[" * 5000 + "\n" + text, "no TOML file"),
            ("#" * (4 << 20) + "\n" + text, "longer than 4 MiB"),
            ("left_handed_stage = 1\n" + text, "must be true or false"),
            (text.replace("misfit = 0", "misfitt = 0", 1), "coil c1: unknown key misfitt"),
            (text.replace("misfit = 0", "misfit = -1", 1), "misfit of the generator: .*not negative"),
            (text.replace("position_m = [", "position_m = [\"0\", ", 1), "position_m must be 3 numbers"),
            (text.replace("octupole_m2 = 0", "octupole_m2 = \"0\"", 1), "octupole_m2 must be a number"),
            (with_sensor + "offset_m = [0, 0, 0]\n", "needs offset_m and axis, or neither"),
            (with_sensor + "offset_m = [0, 0, 0]\naxis = [0, 0, 2]\n", "axis has length 2, not 1"),
            (with_sensor + "gian = 2\n", "unknown key gian"),
            (with_sensor + "[[sensor]]\nnumber = 1\ngain = 2\n", "same number"),
        ):
            (self.folder / "damaged.toml").write_text(damaged)
            with self.subTest(message), self.assertRaisesRegex(ValueError, f"damaged.toml: .*{message}"):
                tricoil.read_generator(self.path("damaged.toml"))
        names = ('a"b', "c\\d", "e\tf\x7f", "µ")
        (self.folder / "names.toml").write_text(_generator_simulate.to_toml(tricoil.Generator(names, np.zeros((4, 3)), np.ones((4, 3)))), encoding="utf-8")
        self.assertEqual(tricoil.read_generator(self.path("names.toml")).names, names)

    def test_another_order_of_coils_fits_no_pose(self):
        """The names say the order; couplings behind exchanged names fit nowhere."""
        table, generator = self.simulated(count=50)
        text = (self.folder / "coil.csv").read_text()
        (self.folder / "exchanged.csv").write_text(text.replace("c1,c2", "c2,c1", 1))
        result, _ = _generator_solve.run([self.path("exchanged.csv")], generator=generator, side=SIDE, gain=1)
        self.assertEqual(result["solved"], 0)
        self.assertIn("same order", result["notes"][0])

    def test_the_program(self):
        program = os.environ["TRICOIL_PROGRAM"]
        run = lambda *words: subprocess.run([program, "generator", *words], cwd=self.folder, capture_output=True, text=True, check=False)
        self.assertEqual(run("simulate", "--save", "g.toml", "--out", "coil.csv", "--count", "50").returncode, 0)
        done = run("solve", "coil.csv", "--generator", "g.toml", "--side", "0,0,1", "--json")
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        self.assertEqual(json.loads(done.stdout)["solved"], 50)
        self.assertEqual(json.loads(done.stdout), tricoil.command("generator solve", self.path("coil.csv"), generator=self.path("g.toml"), side=SIDE))
        refused = run("solve", "coil.csv", "--generator", "g.toml", "--gain", "0")
        self.assertEqual(refused.returncode, 2)
        self.assertEqual(refused.stderr.count("\n"), 1)


if __name__ == "__main__":
    unittest.main()
