"""Commands of the program from Python."""

import ast
import importlib.util
import os
import pathlib
import signal
import subprocess
import sys
import tempfile
import threading
import unittest
from unittest import mock

import numpy as np
import tricoil
from tricoil import _program
from tricoil._number_text import number_text


class Command(unittest.TestCase):
    def test_result_is_that_of_the_program(self):
        result = tricoil.command("motion", example="III", passes=2, form="vectors", loop="closed")
        self.assertEqual(result["updates"], 2400)
        self.assertEqual(tricoil.command("run", scenario="still", duration=1)["scenario"], "still")

    def test_options_of_every_kind(self):
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "poses.csv")
            places = {}
            for tip in (np.array([0, 0, 0]), (0, 0, 0.1)):
                tricoil.command("run", scenario="still", duration=1, out=path, no_noise=True, hemisphere=(1, 0, 0), tip=tip)
                table = np.genfromtxt(path, delimiter=",", names=True)
                places[tuple(tip)] = np.array([table[name][-1] for name in ("x_m", "y_m", "z_m")])
            self.assertAlmostEqual(np.linalg.norm(np.subtract(*places.values())), 0.1, places=6)
            faults = tricoil.command("run", duration=1, fault=["metal:0.3,0.1,0,0.02@0-1", "metal:0.3,-0.1,0,0.02@0-1"])
            self.assertGreater(faults["poses_distorted"], 0)

    def test_ctrl_c(self):
        timer = threading.Timer(0.3, lambda: os.kill(os.getpid(), signal.SIGINT))
        timer.start()
        with self.assertRaises(KeyboardInterrupt):
            tricoil.command("run", duration=100000)
        timer.join()

    def test_ctrl_c_of_an_evaluation_and_the_last_versions_kinds(self):
        rng = np.random.default_rng(3)
        position_m, q = rng.uniform(0.2, 0.4, (40, 3)), rng.normal(size=(40, 4))
        q /= np.linalg.norm(q, axis=1, keepdims=True)
        rows = np.column_stack((position_m, q, [tricoil.couplings(*pose).ravel() for pose in zip(position_m, q)]))
        with tempfile.TemporaryDirectory() as folder:
            short, long, out = (os.path.join(folder, name) for name in ("short.csv", "long.csv", "coils.toml"))
            for path, count in ((short, 1), (long, 1000)):
                np.savetxt(path, np.tile(rows, (count, 1)), delimiter=",", comments="", header="x_m,y_m,z_m,qw,qx,qy,qz,x11,x12,x13,x21,x22,x23,x31,x32,x33")
            of_kind = tricoil.command("calibrate free-motion", short, out=out)
            self.assertEqual(tricoil.calibrate([short], out, free_motion=True), of_kind)
            self.assertEqual(tricoil.command("calibrate", short, out=out, free_motion=True), of_kind)
            with self.assertRaisesRegex(ValueError, "each is a calibration of its own"):
                tricoil.command("calibrate", short, out=out, free_motion=True, grid=True)
            tricoil.calibrate([short], out, model="concentric")
            timer = threading.Timer(0.1, lambda: os.kill(os.getpid(), signal.SIGINT))
            timer.start()  # the thread runs as soon as the call lets it
            with self.assertRaises(KeyboardInterrupt):
                tricoil._tricoil.evaluate([long], out, "", "", [], "refined", True)
            timer.join()

    def test_the_import_needs_no_scipy(self):
        """Most calls do not use it, and its import takes longer than the package's."""
        light = "import sys, tricoil, tricoil.plot; sys.exit('scipy' in sys.modules)"
        self.assertEqual(subprocess.run([sys.executable, "-c", light], check=False).returncode, 0)

    def test_every_public_name_is_there_for_people_and_for_type_checkers(self):
        tree = ast.parse(pathlib.Path(tricoil.__file__).read_text(encoding="utf-8"))
        (block,) = (node for node in tree.body if isinstance(node, ast.If))
        typed = {one.module: " ".join(sorted(name.asname or "" for name in one.names)) for one in block.body}
        self.assertEqual(typed, {module: " ".join(sorted(names.split())) for module, names in tricoil._NAMES.items()})
        for name in tricoil.__all__:
            self.assertIsNotNone(getattr(tricoil, name))
        self.assertEqual(set(tricoil.__all__), {name for name in dir(tricoil) if not name.startswith("__") or name == "__version__"})

    def test_missing_packages_are_named(self):
        for name, missing, message in (("motion", {"numpy"}, "motion: needs NumPy: install the package python3-numpy"),
                                       ("bench", {"scipy"}, "bench: needs NumPy and SciPy: install the packages python3-numpy and python3-scipy")):
            with mock.patch.object(importlib.util, "find_spec", lambda module, missing=missing: None if module in missing else True), \
                    mock.patch.object(_program, "refuse", side_effect=SystemExit) as refuse, mock.patch.dict(os.environ), self.assertRaises(SystemExit):
                _program.start(name, ["--"])
            refuse.assert_called_once_with(message, 3)

    def test_an_interpreter_without_numpy_is_named(self):
        code = "import sys; sys.modules['numpy'] = None; import tricoil"
        done = subprocess.run([sys.executable, "-c", code], check=False, capture_output=True, text=True)
        last = done.stderr.splitlines()[-1]
        self.assertIn("ImportError: tricoil needs NumPy", last)
        self.assertIn(sys.executable, last)
        code = "import sys; sys.version_info = type('v', (), {'major': 3, 'minor': 99})(); sys.path.pop(0); from tricoil import _interpreter"
        done = subprocess.run([sys.executable, "-c", code], check=False, capture_output=True, text=True)
        self.assertIn("was built for Python 3.", done.stderr.splitlines()[-1])

    def test_bad_input(self):
        for name, options, message in (
            ("rnu", {}, "unknown command 'rnu'; did you mean 'run'"),
            ("run", {"rate_hz": "x"}, "rate_hz"),
            ("run", {"colour": 1}, "colour.*; see tricoil run --help"),
            ("run", {"help": True}, "tricoil run --help"),
            ("run", {"duration": -1}, "^duration "),
            ("motion", {"example": "IV"}, "IV"),
            ("calibrate  stage", {"out": "c.toml"}, "^calibrate stage needs files$"),
            ("calibrate stage --json", {"out": "c.toml"}, "options are arguments of their own"),
            (" ", {}, "is no command"),
        ):
            with self.assertRaisesRegex(ValueError, message):
                tricoil.command(name, **options)
        for words, options, message in (
            (["bench", "a.csv"], {"foo": 1}, "foo: unknown option of bench"), (["calibrate pivot", "a.csv"], {"foo": 1}, "^calibrate pivot: unknown option foo$"),
            (["calibrate wiring", "a.csv"], {}, "^calibrate wiring: needs at$"), (["figures"], {"out": "a", "foo": 1}, "^figures: unknown option foo$"),
            (["motion"], {"trajectory": "a.csv", "foo": 1}, "foo"), (["bench", __file__], {"board": 5}, "^bench: an argument has the wrong type"),
            (["convert", "."], {"to": "mat"}, "^convert: the poses need a file; add out$"), (["convert", "."], {"to": "rests", "out": "-"}, "add out$"),
            (["convert", __file__], {"to": "motive"}, "add out$"), (["calibrate grid", "a.csv"], {"out": "b"}, "^calibrate grid: needs spacing_mm$"),
            (["calibrate grid", "a.csv"], {"out": "b", "spacing_mm": "x"}, "^spacing_mm needs a number; got x$"),
            (["calibrate stage", "a.csv"], {"out": "b", "model": "finit"}, "unknown model 'finit'; did you mean 'finite'"),
            *((["calibrate stage", "a.csv"], {"out": "b", name: 3}, f"^unknown {name} '3'; choices: ") for name in ("model", "fixtures", "stage")),
            (["calibrate grid", "a.csv"], {"out": "b", "spacing_mm": 50, "model": 3}, "^unknown model '3'"), (["calibrate free-motion", "a.csv"], {"out": "b", "model": 3}, "^unknown model '3'"),
            (["evaluate", "a\udcff.csv"], {"calibration": "b\udcff.toml"}, r"^b\\xff\.toml: cannot be opened"),
        ):
            with self.assertRaisesRegex(ValueError, message):
                tricoil.command(*words, **options)
        with self.assertRaisesRegex((ValueError, OSError), "nowhere.csv"):
            tricoil.calibrate(["nowhere.csv"], "out.toml")
        with self.assertRaisesRegex((ValueError, OSError), "nowhere"):
            tricoil.evaluate(["nowhere.csv"], "nowhere.toml")
        self.assertFalse(os.path.exists("out.toml"))


class Numbers(unittest.TestCase):
    def test_a_number_that_looks_like_zero(self):
        self.assertEqual([number_text(x, "+.1f") for x in (0.04, -0.04, 0.0, -1.26)], ["+0.04", "-0.04", "+0.0", "-1.3"])
        self.assertEqual(number_text(0.004, ">8.1f"), "   0.004")
        self.assertEqual(number_text(None, ">8.1f"), "     nan")

    def test_a_calculation_that_fails_is_one_line(self):
        """In the package and in the program: also an error that is no ValueError."""
        for error in (np.linalg.LinAlgError("SVD did not converge"), OverflowError("too large"), ZeroDivisionError("division by zero")):
            with mock.patch("tricoil._bench.run", side_effect=error), self.assertRaisesRegex(ValueError, f"the calculation fails with these numbers .{error}."):
                tricoil.command("bench", "a.csv")
            with mock.patch.object(_program, "start", side_effect=error), mock.patch.object(_program, "refuse") as refuse, \
                    mock.patch.object(sys, "argv", ["", "bench"]), mock.patch("signal.signal"):
                _program.main()
            self.assertRegex(refuse.call_args.args[0], "^the calculation fails")


if __name__ == "__main__":
    unittest.main()
