"""Commands of the program from Python."""

import os
import tempfile
import unittest

import numpy as np
import tricoil


class Command(unittest.TestCase):
    def test_result_is_that_of_the_program(self):
        result = tricoil.command("motion", example="III", passes=2, form="vectors", loop="closed")
        self.assertEqual(result["updates"], 2400)
        self.assertEqual(tricoil.command("run", scenario="still", duration=1)["scenario"], "still")

    def test_options_of_every_kind(self):
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "poses.csv")
            tricoil.command("run", duration=1, out=path, no_noise=True, hemisphere=(1, 0, 0), tip=(0, 0, 0.1))
            table = np.genfromtxt(path, delimiter=",", names=True)
            self.assertGreater(len(table), 200)

    def test_bad_input(self):
        for name, options, message in (
            ("rnu", {}, "unknown command 'rnu'; did you mean 'run'"),
            ("run", {"rate_hz": "x"}, "rate_hz"),
            ("run", {"colour": 1}, "colour"),
            ("motion", {"example": "IV"}, "IV"),
        ):
            with self.assertRaisesRegex(ValueError, message):
                tricoil.command(name, **options)
        with self.assertRaisesRegex((ValueError, OSError), "nowhere.csv"):
            tricoil.calibrate(["nowhere.csv"], "out.toml")
        with self.assertRaisesRegex((ValueError, OSError), "nowhere"):
            tricoil.evaluate(["nowhere.csv"], "nowhere.toml")
        self.assertFalse(os.path.exists("out.toml"))


if __name__ == "__main__":
    unittest.main()
