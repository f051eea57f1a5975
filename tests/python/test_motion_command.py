"""Tables, files and pictures of tricoil motion --poses."""

import json
import os
import tempfile
import unittest

import numpy as np
import tricoil
import tricoil.plot
from motion_cases import FRAME, errors_m, rms, simulated
from tricoil import _motion_command as command
from tricoil._poses import PoseError

CASE = simulated(step=FRAME)


class Files(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.file, self.out, self.picture = (os.path.join(folder.name, name) for name in ("take.csv", "corrected.csv", "error.svg"))
        with open(self.file, "w", encoding="utf-8") as file:
            file.write("time_us,valid,x_mm,y_mm,z_mm,qw,qx,qy,qz\n")
            for row in CASE.poses:
                numbers = [*(1e3 * row["position_m"]), *row["quaternion_wxyz"]]
                file.write(f"{round(1e6 * row['time_s'])},1," + ",".join(f"{number:.9g}" for number in numbers) + "\n")

    def test_corrected_poses_can_be_read(self):
        for smooth in (False, True):
            result = command.run(self.file, "tdm:3/720", out=self.out, smooth=smooth)
            corrected = tricoil.read_poses(self.out)
            self.assertEqual(len(corrected), len(CASE.poses))
            self.assertLess(rms(errors_m(CASE, corrected)), 0.2 * rms(errors_m(CASE)))
            with open(self.out, encoding="utf-8") as file:
                self.assertIn(result["assumed"], file.readline())
        self.assertEqual(sorted(os.listdir(os.path.dirname(self.out))), ["corrected.csv", "take.csv"])

    def test_text_and_json_say_what_was_assumed(self):
        result = command.run(self.file, "liberty,latency=3.5")
        self.assertEqual(json.loads(json.dumps(result, allow_nan=False)), result)
        text = command.text(result)
        self.assertIn("liberty,latency=3.5: S1 S2 S3 in turn, 1.389 ms apart", text)
        self.assertIn("without a reference it cannot be checked", text)

    def test_tables_have_every_pose_once(self):
        result = command.run(self.file, "tdm:3/720")
        for by, intervals in result["tables"].items():
            self.assertEqual(sum(one["poses"] for one in intervals), result["poses"] - result["poses_beside_gaps"], by)
        errors = [one["position_rms_m"] for one in result["tables"]["speed_m_s"]]
        self.assertGreater(errors[-1], errors[0])
        self.assertAlmostEqual(1e3 * result["position_rms_m"], tricoil.motion_error(CASE.poses, "tdm:3/720").rms_mm(), places=3)

    def test_picture(self):
        command.run(self.file, "tdm:3/720", plot=self.picture)
        with open(self.picture, encoding="utf-8") as file:
            picture = file.read()
        self.assertIn("<svg", picture)
        self.assertLess(len(picture), 400_000)

    def test_refused(self):
        for options, message in (
            ({}, "needs --timing"),
            ({"timing": "fit"}, "evaluate --dynamic"),
            ({"timing": "tdm:3/720", "place": "1,0,0"}, "--place: not with --poses"),
            ({"timing": "tdm:3/720", "unit": "km"}, "--unit must be"),
        ):
            with self.assertRaisesRegex(PoseError, message):
                command.run(self.file, **options)


if __name__ == "__main__":
    unittest.main()
