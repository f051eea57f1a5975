"""Drawings: the files are pictures, and show the data that they were given."""

import tempfile
import unittest

import numpy as np
import tricoil
import tricoil.plot


class Plot(unittest.TestCase):
    def test_run(self):
        run = tricoil.run("unplugged", tracker="scaat")
        figure = tricoil.plot.run(run)
        path, error, flags = figure.axes
        drawn = error.lines[0].get_ydata()
        np.testing.assert_array_equal(np.isnan(drawn), ~run.poses["valid"])
        np.testing.assert_allclose(np.nanmax(drawn), 1e3 * run.position_errors_m()[run.poses["valid"]].max())
        self.assertIn("no_sensor", [label.get_text() for label in flags.get_yticklabels()])
        with tempfile.TemporaryFile() as file:
            figure.savefig(file, format="png")
            file.seek(0)
            self.assertEqual(file.read(8), b"\x89PNG\r\n\x1a\n")

    def test_motion(self):
        updates = tricoil.motion("I", duration_s=1)
        figure = tricoil.plot.motion(updates, "I")
        np.testing.assert_array_equal(figure.axes[2].lines[1].get_ydata(), updates["e_beta_rad"][:, 1])

    def test_motion_error(self):
        """Bands and medians of each bin; no legend covers data."""
        run = tricoil.run("hand", mux="tdm", deskew=False, fidelity="columns", duration_s=3)
        result = tricoil.motion_error(run.poses[run.poses["valid"]][2::3], "tdm:3/720")
        for axes in tricoil.plot.motion_error(result).axes:
            highest = max(np.nanmax(line.get_ydata()) for line in axes.lines)
            self.assertGreater(axes.get_ylim()[1], 1.2 * highest)
            self.assertEqual((axes.get_ylim()[0], len(axes.collections)), (0, 1))

    def test_run_without_poses(self):
        run = tricoil.run("still", duration_s=0.1)
        with self.assertRaisesRegex(ValueError, "no poses"):
            tricoil.plot.run(tricoil.Run(run.poses[:0], run.truth[:0], run.summary))


if __name__ == "__main__":
    unittest.main()
