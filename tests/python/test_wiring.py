"""Coil and polarity of each channel: found, written, read, and corrected wherever couplings enter."""

import itertools
import json
import os
import subprocess
import unittest

import numpy as np
from folder_case import FolderCase
import tricoil
from tricoil._wiring_command import ORDERS, identify

AT = (0.4, 0.2, 0.1)
IDEAL = tricoil.couplings(AT, [1, 0, 0, 0])
WIRING = tricoil.Wiring((2, -1, 3), (-3, 1, 2))


def matrix(order):
    """Written out, not by the package: row of a channel, column of its coil."""
    m = np.zeros((3, 3))
    for channel, coil in enumerate(order):
        m[channel, abs(coil) - 1] = 1 if coil > 0 else -1
    return m


def channels_of(x, wiring):
    return matrix(wiring.sensor) @ x @ matrix(wiring.source).T


def table(rows, names="x11,x12,x13,x21,x22,x23,x31,x32,x33"):
    return names + "\n" + "".join(",".join(map(repr, np.ravel(row).tolist())) + "\n" for row in rows)


class Identification(unittest.TestCase):
    def test_every_order_and_sign(self):
        rng = np.random.default_rng(63)
        for sensor, source in list(itertools.product(ORDERS, ORDERS))[::29]:
            x = channels_of(IDEAL, tricoil.Wiring(sensor, source)) + 0.02 * np.linalg.norm(IDEAL) * rng.normal(size=(3, 3))
            found, misfit, second = identify(x[None], AT)
            self.assertLess(misfit, 0.3)
            self.assertGreater(second, 1.5 * misfit + 0.02)
            signs = {tuple(np.sign(found.sensor) * np.sign(sensor)), tuple(np.sign(found.source) * np.sign(source))}
            self.assertIn(signs, ({(1, 1, 1)}, {(-1, -1, -1)}))  # all six reversed have the same couplings
            np.testing.assert_array_equal(np.abs([found.sensor, found.source]), np.abs([sensor, source]))
            self.assertLessEqual(sum(coil < 0 for coil in found.sensor + found.source), 3)

    def test_directions_that_do_not_tell(self):
        for at, message in (((1, 0, 0), "several wirings"), ((1, 1, 0.5), "several wirings"), ((0, 0, 0), "not zero"), ("1,2", "X,Y,Z")):
            with self.assertRaisesRegex(ValueError, f"--at.*{message}"):
                identify(IDEAL[None], at)

    def test_noise_has_no_wiring(self):
        noise = np.random.default_rng(1).normal(size=(1, 3, 3))
        _, misfit, second = identify(noise, AT)
        self.assertFalse(misfit < 0.3 and second > 1.5 * misfit + 0.02)


class Files(FolderCase):
    def setUp(self):
        super().setUp()
        self.out = os.path.join(self.folder, "wiring.toml")

    def file(self, name, text):
        path = os.path.join(self.folder, name)
        with open(path, "w", encoding="utf-8") as file:
            file.write(text)
        return path

    def program(self, *words):
        return subprocess.run([os.environ["TRICOIL_PROGRAM"], *words], capture_output=True, text=True, check=False)

    def test_command_says_why_it_ends_with_1_and_writes_the_wiring(self):
        frames = self.file("frames.csv", table([channels_of(IDEAL, WIRING)] * 2))
        done = self.program("calibrate", "wiring", "--at", "0.4,0.2,0.1", frames)
        self.assertEqual(done.returncode, 1)
        self.assertIn("sensor: channel 1 = coil 2, channel 2 = coil 1 reversed, channel 3 = coil 3\n", done.stdout)
        self.assertRegex(done.stderr, r"^tricoil: the wiring is not straight: .*--wiring FILE \(exit code 1\)\n$")
        done = self.program("calibrate", "wiring", "--at", "0.4,0.2,0.1", "--out", self.out, frames)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        self.assertEqual(tricoil.read_wiring(self.out), WIRING)
        found = tricoil.command("calibrate wiring", frames, at=AT)
        self.assertEqual((found["certain"], found["straight"]), (True, False))
        done = self.program("calibrate", "wiring", "--at", "0.4,0.2,0.1", "--out", self.out + "2",
                            self.file("noise.csv", table([np.array([[1, 2, 3], [4, 5, 6], [7, 8, 10]])])))
        self.assertEqual(done.returncode, 1)
        self.assertRegex(done.stderr, r"^tricoil: no wiring fits clearly better .*2 is not written \(exit code 1\)\n$")
        self.assertFalse(os.path.exists(self.out + "2"))
        for words, message in (((frames, frames), "given twice"), (("--out", frames, frames), "is also an input file"),
                               ((self.file("one.csv", "x11,x12\n1,2\n"),), "one.csv:1: no column x13"),
                               ((self.file("dead.csv", table([IDEAL, 0 * IDEAL])),), "dead.csv:3: the couplings are zero"),
                               ((self.file("empty.csv", table([])),), "empty.csv: holds no column frames")):
            done = self.program("calibrate", "wiring", "--at", "0.4,0.2,0.1", *words)
            self.assertEqual(done.returncode, 2, done.stderr)
            self.assertIn(message, done.stderr)
            self.assertEqual(done.stderr.count("\n"), 1)

    def test_wrong_files_are_refused_by_both_readers(self):
        frames = self.file("frames.csv", table([IDEAL]))
        for text in ("", "sensor = [1, 2, 3]\n", "sensor = [1, 2, 2]\nsource = [1, 2, 3]\n", "sensor = [0, 2, 3]\nsource = [1, 2, 3]\n",
                     "sensor = [1, 2, 3, 1]\nsource = [1, 2, 3]\n", "sensor = [1, 2, 4]\nsource = [1, 2, 3]\n",
                     "sensor = [1, 2, 3]\nsource = [1, 2, 3]\nother = 1\n", "sensor = 1\nsource = [1, 2, 3]\n", "sensor = [123]\nsource = [1, 2, 3]\n",
                     "sensor = [1 2 3]\nsource = [1, 2, 3]\n", "sensor = [1.5, 2, 3]\nsource = [1, 2, 3]\n"):
            path = self.file("wrong.toml", text)
            with self.assertRaisesRegex(ValueError, "wrong.toml"):
                tricoil.read_wiring(path)
            done = self.program("calibrate", "free-motion", "--wiring", path, "--out", self.out, frames)
            self.assertEqual(done.returncode, 2, text)
            self.assertRegex(done.stderr, "^tricoil: [^\n]*wrong.toml[^\n]*\n$")

    def test_a_run_says_whether_the_wiring_is_confirmed(self):
        """Two reversed coils give a valid, wrong pose."""
        frames = self.file("frames.csv", table([IDEAL * [[1], [-1], [-1]]] * 30))
        self.file("wiring.toml", "sensor = [1, -2, -3]\nsource = [1, 2, 3]\n")
        run = ("run", "--device", f"couplings:{frames},rate_hz=100,sigma=1e-6", "--hemisphere", "1,0,0")
        for words, confirmed in ((run, False), ((*run, "--wiring", self.out), True)):
            done = self.program(*words)
            self.assertEqual((done.returncode, "not confirmed: two coils" in done.stdout), (0, not confirmed), done.stderr)
            closing = self.program(*words, "--json").stdout.splitlines()[-1]  # after lines of poses and state
            self.assertIs(json.loads(closing)["wiring_confirmed"], confirmed)

    def test_lists_over_several_lines_are_read(self):
        path = self.file("wiring.toml", "# by hand\nsensor = [\n  2,\n  -1,  # reversed\n  3,\n]\nsource = [-3, 1,\n 2]\n")
        self.assertEqual(tricoil.read_wiring(path), WIRING)

    def test_couplings_are_corrected_where_they_enter(self):
        """Results with exchanged channels and --wiring are those with straight channels."""
        rng = np.random.default_rng(5)
        poses = []
        for _ in range(60):
            q = rng.normal(size=4)
            poses.append((rng.uniform(0.2, 0.4, 3), q / np.linalg.norm(q)))
        x = [tricoil.couplings(*pose) for pose in poses]
        self.file("wiring.toml", "sensor = [2, -1, 3]  # as found\nsource = [-3, 1, 2]\n")
        names = "x_m,y_m,z_m,qw,qx,qy,qz,x11,x12,x13,x21,x22,x23,x31,x32,x33"

        def stage(of):
            return table([np.concatenate((*pose, np.ravel(of(one)))) for pose, one in zip(poses, x)], names)

        def live(of):
            rows = [np.concatenate(([10_000 * n, 1e-6], np.ravel(of(one)))) for n, one in enumerate([x[0]] * 20)]
            return table(rows, "time_us,sigma,x11,x12,x13,x21,x22,x23,x31,x32,x33")

        straight, crossed = (lambda m: m), (lambda m: channels_of(m, WIRING))
        cases = {
            "stage": (stage, ("calibrate", "stage", "--model", "concentric", "--out", "{out}", "{data}")),
            "free-motion": (stage, ("calibrate", "free-motion", "--out", "{out}", "{data}")),
            "live": (live, ("run", "--device", "couplings:{data},mux=fdm", "--out", "{out}")),
        }
        for name, (data, words) in cases.items():
            results = []
            for of, wiring in ((straight, ()), (crossed, ("--wiring", self.out))):
                path, out = self.file("data.csv", data(of)), os.path.join(self.folder, f"{name}{len(results)}")
                done = self.program(*(word.format(data=path, out=out) for word in words), *wiring)
                self.assertEqual(done.returncode, 0, (name, done.stderr))
                with open(out, encoding="utf-8") as file:
                    results.append([float(number) for number in re_numbers(file.read())])
            np.testing.assert_allclose(results[1], results[0], rtol=1e-6, atol=1e-9, err_msg=name)
            path = self.file("data.csv", data(crossed))
            done = self.program(*(word.format(data=path, out=out + "2") for word in words))
            other = []
            if done.returncode == 0:
                with open(out + "2", encoding="utf-8") as file:
                    other = [float(number) for number in re_numbers(file.read())]
            self.assertFalse(len(other) == len(results[0]) and np.allclose(other, results[0], rtol=1e-3), name)
        key = self.program("run", "--device", f"couplings:{self.file('data.csv', live(crossed))},mux=fdm,wiring={self.out}", "--out", "-")
        with open(os.path.join(self.folder, "live1"), encoding="utf-8") as file:
            self.assertEqual(key.stdout, file.read())
        self.assertRegex(self.program("run", "--wiring", self.out).stderr, "^tricoil: --wiring: only with a device")
        self.assertRegex(self.program("calibrate", "stage", "--wiring", self.out, "--out", "a", "--blob", "b", path).stderr, "^tricoil: --blob: not with --wiring")

    def refused(self, message, *words):
        done = self.program(*words)
        self.assertEqual((done.returncode, done.stderr.count("\n")), (2, 1), (words, done.stderr))
        self.assertIn(message, done.stderr)

    def test_no_output_replaces_an_input_or_another_output(self):
        wiring = "sensor = [2, -1, 3]\nsource = [-3, 1, 2]\n"
        frames = "time_us,sigma,x11,x12,x13,x21,x22,x23,x31,x32,x33\n" + "".join(
            ",".join(map(repr, [10_000 * n, 1e-6, *np.ravel(IDEAL).tolist()])) + "\n" for n in range(20))
        data = self.file("frames.csv", frames)
        self.file("wiring.toml", wiring)
        errors = os.path.join(self.folder, "errors")
        os.mkdir(errors)
        poses = self.file(os.path.join("errors", "pose_errors.csv"), frames)
        cal, both = self.file("cal.toml", "cal"), os.path.join(self.folder, "both")
        is_input = "is also an input file"
        for kind, more in (("stage", ()), ("converters", ()), ("grid", ("--spacing-mm", "40")), ("free-motion", ()), ("surroundings", ("--calibration", cal))):
            self.refused(is_input, "calibrate", kind, *more, "--wiring", self.out, "--out", self.out, data)
        self.refused(is_input, "evaluate", "--calibration", cal, "--out", errors, poses)
        run = ("run", "--duration", "1")
        for name in (f"couplings:{data}", f"couplings:{data},mux=fdm"):
            self.refused(is_input, *run, "--device", name, "--out", data)
        self.refused(is_input, *run, "--device", f"couplings:{data},mux=fdm", "--wiring", self.out, "--out", self.out)
        self.refused(is_input, *run, "--calibration", cal, "--couplings", cal)
        for one, other in itertools.combinations(("--out", "--couplings", "--record-wav"), 2):
            self.refused("name the same file", *run, one, both, other, os.path.join(self.folder, ".", "both"))
        both += ".svg"
        for words, (one, other) in ((("motion", "--poses", data, "--timing", "fdm"), ("--out", "--plot")), (("truth", data), ("--out", "--plot")), (("generator", "simulate"), ("--out", "--save"))):
            self.refused(f"{one} and {other} name the same file", *words, one, both, other, os.path.join(self.folder, ".", "both.svg"))
        self.refused(is_input, "motion", "--plan", cal, "--chain", cal, "--start-joints", "1")
        self.assertFalse({"both", "both.svg"} & set(os.listdir(self.folder)))
        for path, text in ((self.out, wiring), (data, frames), (poses, frames), (cal, "cal")):
            with open(path, encoding="utf-8") as file:
                self.assertEqual(file.read(), text)
        done = self.program(*run, "--out", "/dev/null", "--couplings", "/dev/null")
        self.assertEqual(done.returncode, 0, done.stderr)

    def test_a_wiring_is_corrected_once(self):
        self.file("wiring.toml", "sensor = [2, -1, 3]\nsource = [-3, 1, 2]\n")
        names = "time_us,sigma,x11,x12,x13,x21,x22,x23,x31,x32,x33"
        rows = table([np.concatenate(([10_000 * n, 1e-6], np.ravel(channels_of(IDEAL, WIRING)))) for n in range(200)], names)
        data, take, rests = self.file("frames.csv", rows), os.path.join(self.folder, "take"), os.path.join(self.folder, "rests.csv")
        for words in (("run", "--device", f"couplings:{data},mux=fdm", "--wiring", self.out, "--record", take, "--out", "-"),
                      ("convert", take, "--to", "rests", "--out", rests)):
            done = self.program(*words)
            self.assertEqual(done.returncode, 0, done.stderr)
        second = "its wiring is corrected already; leave out --wiring"
        self.refused(f"rests.csv: {second}", "calibrate", "free-motion", "--wiring", self.out, "--out", "a.toml", rests)
        self.refused(f"rests.csv: {second}", "calibrate", "grid", "--nodes", "1,1,1", "--spacing-mm", "40", "--wiring", self.out, "--out", "a.toml", rests)
        straight = [np.concatenate(([10_000 * n, 1e-6], np.ravel(IDEAL))) for n in range(200)]
        corrected = self.file("corrected.csv", "# wiring corrected\n" + table(straight, names))
        self.refused("corrected.csv:1: the wiring is corrected already", "run", "--device", f"couplings:{corrected},mux=fdm", "--wiring", self.out, "--out", "-")
        done = self.program("run", "--device", f"couplings:{corrected},mux=fdm", "--out", "-")
        self.assertEqual(done.returncode, 0, done.stderr)
        stage = self.file("stage.csv", "# wiring corrected\n" + table([[0.4, 0.2, 0.1, 1, 0, 0, 0, *np.ravel(IDEAL)]],
                                                                     "x_m,y_m,z_m,qw,qx,qy,qz,x11,x12,x13,x21,x22,x23,x31,x32,x33"))
        self.refused(f"stage.csv: {second}", "calibrate", "stage", "--wiring", self.out, "--out", "a.toml", stage)

    def test_a_configuration_names_the_wiring_beside_it(self):
        self.file("wiring.toml", "sensor = [2, -1, 3]\nsource = [-3, 1, 2]\n")
        names = "time_us,sigma,x11,x12,x13,x21,x22,x23,x31,x32,x33"
        data = self.file("frames.csv", table([np.concatenate(([10_000 * n, 1e-6], np.ravel(channels_of(IDEAL, WIRING)))) for n in range(20)], names))
        config = self.file("board.toml", f'device = "couplings:{data},mux=fdm,wiring=wiring.toml"\n')
        done = self.program("run", "--config", config, "--out", "-")
        self.assertEqual(done.returncode, 0, done.stderr)

    def test_columns_in_turn_keep_their_times(self):
        """Channels of the source are measured in turn, whatever coils they drive."""
        def at(time):
            angle = 0.05 * time
            q = np.array([np.cos(angle), 0.6 * np.sin(angle), 0.5 * np.sin(1.7 * angle), 0.4 * np.cos(2.3 * angle)])
            return tricoil.couplings([0.4 + 0.05 * np.sin(1.3 * angle), 0.1 * np.cos(angle), 0.1], q / np.linalg.norm(q))

        def frame(n, wiring):
            return np.column_stack([channels_of(at(n + channel / 3), wiring)[:, channel] for channel in range(3)])

        self.file("wiring.toml", "sensor = [2, -1, 3]\nsource = [-3, 1, 2]\n")
        misfits = []
        for wiring, path in ((tricoil.Wiring(), None), (WIRING, self.out)):
            data = self.file("data.csv", table([frame(n, wiring) for n in range(200)]))
            found = tricoil.calibrate([data], os.path.join(self.folder, "cal.toml"), "free-motion", column_skew=1 / 3, wiring=path)
            misfits.append(found["misfit_after"])
        self.assertLess(misfits[0], 1e-3)
        self.assertLess(misfits[1], 1.5 * misfits[0])

    def test_of_the_package(self):
        straight, crossed = tricoil.Filter("direct"), tricoil.Filter("direct", wiring=WIRING)
        x = tricoil.couplings([0.3, 0.2, 0.1], [0.9, 0.1, 0.3, 0.3])
        channels = channels_of(x, WIRING)
        np.testing.assert_allclose(WIRING.of_coils(channels), x)
        order = [abs(coil) - 1 for coil in WIRING.source]
        for n in range(6):
            channel = n % 3
            expected = straight.update(0.01 * (n // 3), order[channel], x[:, order[channel]], 1e-6)
            found = crossed.update(0.01 * (n // 3), channel, channels[:, channel], 1e-6)
        np.testing.assert_allclose(found.position_m, expected.position_m)
        np.testing.assert_allclose(found.quaternion_wxyz, expected.quaternion_wxyz)
        with self.assertRaisesRegex(ValueError, "each coil once"):
            tricoil.Wiring((1, 1, 3))


def re_numbers(text):
    import re

    return re.findall(r"(?<![\w.])-?\d+\.?\d*(?:e-?\d+)?(?![\w.])", text)


if __name__ == "__main__":
    unittest.main()
