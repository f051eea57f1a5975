"""Tables, files and pictures of tricoil motion --poses."""

import json
import os
import subprocess
import tempfile
import unittest
from unittest import mock

import numpy as np
import tricoil
import tricoil.plot
from motion_cases import FRAME, errors_m, rms, simulated
from tricoil import _motion_command as command

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
            result = command.run_poses(self.file, "tdm:3/720", out=self.out, smooth=smooth)
            corrected = tricoil.read_poses(self.out)
            self.assertEqual(len(corrected), len(CASE.poses))
            self.assertLess(rms(errors_m(CASE, corrected)), 0.2 * rms(errors_m(CASE)))
            with open(self.out, encoding="utf-8") as file:
                self.assertIn(result["assumed"], file.readline())
        self.assertEqual(sorted(os.listdir(os.path.dirname(self.out))), ["corrected.csv", "take.csv"])

    def test_text_and_json_say_what_was_assumed(self):
        result = command.run_poses(self.file, "liberty,latency=3.5")
        self.assertEqual(json.loads(json.dumps(result, allow_nan=False)), result)
        text = command.text(result)
        self.assertIn("liberty,latency=3.5: S1 S2 S3 in turn, 1.389 ms apart", text)
        self.assertIn("without a reference it cannot be checked", text)

    def test_tables_have_every_pose_once(self):
        result = command.run_poses(self.file, "tdm:3/720")
        for by, intervals in result["tables"].items():
            self.assertEqual(sum(one["poses"] for one in intervals), result["poses"] - result["poses_beside_gaps"], by)
        errors = [one["position_rms_m"] for one in result["tables"]["speed_m_s"]]
        self.assertGreater(errors[-1], errors[0])
        self.assertAlmostEqual(1e3 * result["position_rms_m"], tricoil.motion_error(CASE.poses, "tdm:3/720").rms_mm(), places=3)

    def test_picture(self):
        command.run_poses(self.file, "tdm:3/720", plot=self.picture)
        with open(self.picture, encoding="utf-8") as file:
            picture = file.read()
        self.assertIn("<svg", picture)
        self.assertLess(len(picture), 400_000)

    def test_all_outputs_or_none(self):
        out = self.picture + ".csv"
        with mock.patch("tricoil.plot.motion_error", side_effect=ValueError("cannot draw")), self.assertRaisesRegex(ValueError, "cannot draw"):
            command.run_poses(self.file, "tdm:3/720", out=out, plot=self.picture)
        self.assertFalse(os.path.exists(out))

    def test_command_of_the_package(self):
        self.assertEqual(tricoil.command("motion", poses=self.file, timing="tdm:3/720")["timing"], "tdm:3/720")
        with self.assertRaisesRegex(ValueError, "not both"):
            tricoil.command("motion", poses=self.file, trajectory=self.file)

    def test_program(self):
        program = os.environ["TRICOIL_PROGRAM"]
        done = subprocess.run([program, "motion", "--poses", self.file, "--timing", "tdm:3/720", "--json"], capture_output=True, text=True, check=True)
        self.assertEqual(json.loads(done.stdout), command.run_poses(self.file, "tdm:3/720"))
        for words, message in ((["--timing", "fdm"], "--timing requires --poses"), (["--poses", self.file], "needs --timing"),
                               (["--poses", self.file, "--timing", "fdm", "--example", "I"], "--example: not with --poses")):
            done = subprocess.run([program, "motion", *words], capture_output=True, text=True, check=False)
            self.assertEqual((done.returncode, done.stderr.count("\n")), (2, 1))
            self.assertIn(message, done.stderr)

    def test_reader_options_of_two_files(self):
        """One file in mm without a unit, the other with two sensors: each has its own options."""
        other = os.path.join(os.path.dirname(self.file), "reference.csv")
        with open(other, "w", encoding="utf-8") as file:
            file.write("sensor,time,x,y,z,qw,qx,qy,qz\n")
            for row in CASE.poses:
                numbers = ",".join(map(str, [*(1e3 * row["position_m"]), *row["quaternion_wxyz"]]))
                file.writelines(f"{sensor},{1e3 * row['time_s']:.3f},{numbers}\n" for sensor in (1, 2))
        given, reference = command.read_both(self.file, other, {"unit": ",mm", "time_unit": ",ms", "sensor": ",2"})
        np.testing.assert_allclose(given.position_m, reference.position_m, atol=1e-6)
        np.testing.assert_allclose(given.time_s, reference.time_s, atol=2e-6)
        with self.assertRaisesRegex(ValueError, "--unit takes one value, or POSES,REFERENCE"):
            command.read_both(self.file, other, {"unit": "m,mm,mm"})
        self.assertRaisesRegex(TypeError, "timing must be a text", tricoil.motion_error, CASE.poses, None)

    def test_full_and_closed_outputs(self):
        """One line and status 3 if the result cannot be written; the status of bad input stays if nobody can be told."""
        for words, code, lines in (("--timing fdm --out - >/dev/full", 3, 1), ("--timing fdm --json >/dev/full", 3, 1), ("--timing fdm >&-", 3, 1),
                                   ("--timing no 2>/dev/full", 2, 0), ("--timing no 2>&-", 2, 0), ("--timing no >/dev/full 2>&1", 2, 0)):
            done = subprocess.run(["sh", "-c", f'"$TRICOIL_PROGRAM" motion --poses "{self.file}" {words}'], capture_output=True, text=True, check=False)
            self.assertEqual((done.returncode, done.stderr.count("\n"), done.stdout), (code, lines, ""), words + done.stderr)

    def test_refused(self):
        for options, message in (
            ({}, "needs --timing"),
            ({"timing": "fit"}, "needs a reference"),
            ({"timing": "tdm:3/720", "plot": "a.xyz"}, "--plot must end in"),
            ({"timing": "tdm:3/720", "out": "/nowhere/a.csv"}, "cannot write /nowhere/a.csv"),
            ({"timing": "tdm:3/720", "place": "1,0,0"}, "--place: not with --poses"),
            ({"timing": "tdm:3/720", "unit": "km"}, "--unit must be"),
            ({"timing": "fdm,window=50"}, "a window of 50 ms is longer than the pose interval"),
            ({"timing": "fdm,latency=900"}, "latency in ms must be a number of 0 to 100"),
            ({"timing": "tdm:\u00b2/720"}, "give tdm:SLOTS/RATE"),
        ):
            with self.assertRaisesRegex(ValueError, message):
                command.run_poses(self.file, **options)


class Along(unittest.TestCase):
    def test_formulas_of_the_paper_along_a_path(self):
        """The paper's example I as a recorded path has the errors that motion() predicts."""
        rows = tricoil.motion("I")
        azimuth, elevation = rows["azimuth_rad"], rows["elevation_rad"]
        direction = np.stack((np.cos(azimuth) * np.cos(elevation), np.sin(azimuth) * np.cos(elevation), -np.sin(elevation)), axis=1)
        path = (rows["time_s"], rows["range_m"][:, None] * direction, np.tile((1.0, 0, 0, 0), (len(rows), 1)))
        along = tricoil.motion_along(path)
        self.assertEqual(len(along), len(rows))
        np.testing.assert_allclose(along["e_rho_m"], rows["e_rho_m"][:, 1], atol=1e-6)
        np.testing.assert_allclose(along["e_alpha_rad"], rows["e_alpha_rad"][:, 1], atol=1e-5)
        two = tricoil.motion_along(path, kappa="two")
        self.assertGreater(abs(two["e_alpha_rad"] - along["e_alpha_rad"]).max(), 1e-3)

    def test_command_reads_a_file_without_time(self):
        with tempfile.TemporaryDirectory() as folder:
            file = os.path.join(folder, "path.csv")
            positions = CASE.poses["position_m"][:200]
            with open(file, "w", encoding="utf-8") as out:
                out.write("x_m,y_m,z_m\n" + "".join(",".join(map(str, position)) + "\n" for position in positions))
            result = tricoil.command("motion", trajectory=file, rate_hz=100, loop="closed", place=(0.5, 0, 0))
            self.assertEqual((result["update_s"], result["updates"], result["placed"]), (1 / 240, 477, True))
            self.assertIn("moved by --place", command.trajectory_text(result))

    def test_path_stays_or_is_placed(self):
        there = tricoil.motion_along(CASE.poses, loop="closed")
        np.testing.assert_allclose(there["position_m"][0], CASE.poses["position_m"][0], atol=1e-9)
        moved = tricoil.motion_along(CASE.poses, place_m=(0.5, 0, 0), rate_hz=100)
        self.assertAlmostEqual(np.median(np.diff(moved["time_s"])), 0.01)
        self.assertLess(np.linalg.norm(moved["position_m"].mean(axis=0) - (0.5, 0, 0)), 0.05)

    def test_refused(self):
        still = CASE.poses.copy()
        still["position_m"] = (0.5, 0, 0)
        for poses, options, message in ((still, {}, "fewer than 8 positions differ"), (CASE.poses, {"rate_hz": 0}, "rate_hz must be positive"),
                                        (CASE.poses, {"rate_hz": 0.01}, "give 1 to 2000000 updates"), (CASE.poses[:0], {}, "fewer than 8"),
                                        (CASE.poses, {"place_m": (1e9, 0, 0)}, "place_m must be at most"),
                                        (CASE.poses, {"kappa": "tow"}, "did you mean 'two'"), (CASE.poses, {"place_m": (1, 2)}, "place_m")):
            with self.assertRaisesRegex(ValueError, message):
                tricoil.motion_along(poses, **options)


if __name__ == "__main__":
    unittest.main()
