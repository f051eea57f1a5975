"""Commands of the program from Python."""

import os
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

    def test_the_import_needs_no_scipy(self):
        """Most calls do not use it, and its import takes longer than the package's."""
        light = "import sys, tricoil, tricoil.plot; sys.exit('scipy' in sys.modules)"
        self.assertEqual(subprocess.run([sys.executable, "-c", light], check=False).returncode, 0)

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
        ):
            with self.assertRaisesRegex(ValueError, message):
                tricoil.command(name, **options)
        for words, options, message in (
            (["bench", "a.csv"], {"foo": 1}, "foo: unknown option of bench"), (["calibrate pivot", "a.csv"], {"foo": 1}, "^calibrate pivot: unknown option foo$"),
            (["calibrate wiring", "a.csv"], {}, "^calibrate wiring: needs at$"), (["figures"], {"out": "a", "foo": 1}, "^figures: unknown option foo$"),
            (["motion"], {"trajectory": "a.csv", "foo": 1}, "foo"), (["bench", __file__], {"board": 5}, "^bench: an argument has the wrong type"),
        ):
            with self.assertRaisesRegex(ValueError, message):
                tricoil.command(*words, **options)
        with self.assertRaisesRegex((ValueError, OSError), "nowhere.csv"):
            tricoil.calibrate(["nowhere.csv"], "out.toml")
        with self.assertRaisesRegex((ValueError, OSError), "nowhere"):
            tricoil.evaluate(["nowhere.csv"], "nowhere.toml")
        self.assertFalse(os.path.exists("out.toml"))


class Numbers(unittest.TestCase):
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
