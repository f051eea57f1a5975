"""tricoil convert of a file of poses: each form is read again as it was written."""

import json
import os
import subprocess
import unittest
from unittest import mock

import numpy as np
from folder_case import FolderCase
import tricoil
from scipy.spatial.transform import Rotation
from tricoil import _convert, _mat_poses, _rests
from tricoil._mat_file import read_mat

RATE_HZ = 50.0


def poses(sensor="1"):
    t = 12.34 + np.arange(200) / RATE_HZ
    position = np.stack((0.5 + 0.1 * np.sin(t), 0.2 * np.cos(1.3 * t), 0.05 * t), axis=1)
    turns = Rotation.from_rotvec(np.stack((np.sin(0.7 * t), 2 * np.cos(0.4 * t), 0.3 * t), axis=1))
    return tricoil.Poses(t, position, turns.as_quat()[:, [3, 0, 1, 2]], "given", sensor=sensor)


class Convert(FolderCase):
    def write(self, name, text):
        path = os.path.join(self.folder, name)
        with open(path, "w", encoding="utf-8") as file:
            file.write(text)
        return path

    def assert_equal(self, given, read, time=True):
        np.testing.assert_allclose(read.position_m, given.position_m, atol=1e-9)
        if time:
            np.testing.assert_allclose(read.time_s, given.time_s, atol=1e-8)
        else:  # frame numbers: without their origin
            np.testing.assert_allclose(np.diff(read.time_s), np.diff(given.time_s), atol=1e-9)
        if given.quaternion_wxyz is None:
            self.assertIsNone(read.quaternion_wxyz)
        else:
            np.testing.assert_allclose(abs(np.sum(read.quaternion_wxyz * given.quaternion_wxyz, axis=1)), 1, atol=1e-12)

    def test_round_trip_of_every_form_and_unit(self):
        given = poses()
        for form, units in (("csv", ("m", "cm", "mm", "in")), ("jsonl", ("m", "cm", "mm", "in")), ("motive", ("m", "cm", "mm")), ("polhemus", ("m", "cm", "mm", "in")),
                            ("ndi", ("mm",)), ("mha", ("mm",))):
            for unit in units:
                with self.subTest(form=form, unit=unit):
                    file = self.write(f"take.{form}", _convert.converted(given, form, unit))
                    read = tricoil.read_poses(file, rate_hz=RATE_HZ if form == "ndi" else None)
                    self.assert_equal(given, read, time=form != "ndi")
                    self.assertEqual(read.notes, ())

    def test_angles_have_the_given_order(self):
        """Without its quaternions the table of angles alone has the attitudes."""
        given = poses()
        for axes in ("zyx", "xyz", "zxz"):
            lines = _convert.converted(given, "csv", "mm", axes).splitlines()
            self.assertIn(axes.upper(), lines[0])
            fields = [line.split(",") for line in lines[1:]]
            file = self.write("angles.csv", "".join(",".join(row[:4] + row[8:]) + "\n" for row in fields))
            self.assert_equal(given, tricoil.read_poses(file, rotation=axes.upper()))

    def test_positions_only(self):
        given = tricoil.Poses(poses().time_s, poses().position_m)
        for form in ("csv", "jsonl", "motive"):
            self.assert_equal(given, tricoil.read_poses(self.write("marker", _convert.converted(given, form))))
        for form in ("polhemus", "ndi", "mha"):
            with self.assertRaisesRegex(ValueError, "has positions only"):
                _convert.converted(given, form)

    def test_program_and_package(self):
        source, out = self.write("take.csv", _convert.converted(poses(), "csv", "cm")), os.path.join(self.folder, "motive.csv")
        program = [os.environ["TRICOIL_PROGRAM"], "convert"]
        done = subprocess.run([*program, source, "--to", "motive", "--units", "mm", "--out", out], capture_output=True, text=True, check=True)
        self.assertIn("200 poses as motive", done.stdout)
        self.assert_equal(poses(), tricoil.read_poses(out))
        self.assertEqual(tricoil.command("convert", source, to="ndi", out=out)["poses"], 200)
        done = subprocess.run([*program, source, "--to", "polhemus"], capture_output=True, text=True, check=True)
        self.assertEqual(done.stdout.count("\n"), 201)
        take = os.path.join(self.folder, "take")
        tricoil.run("hand", duration_s=0.5, record=take, fidelity="columns")
        for words, message in (([source, "--to", "mat"], "--to mat: only of a recording's folder"), ([source, "--to", "ndi", "--units", "in"], "give --units mm"),
                               ([source, "--to", "motive", "--euler", "zyx"], "--euler: only with --to csv"), ([source, "--to", "csv", "--out", source], "is also an input file"),
                               ([source, "--json"], "--json: the poses need a file"), ([source, "--boresight"], "--boresight: only of a recording's folder"),
                               ([source, "--to", "csv", "--euler", "zzy"], "--euler must be three axes"),
                               (["nosuch", "--to", "motive"], "nosuch: does not exist"), ([take, "--unit", "mm"], "--unit: only of a file of poses"),
                               ([take, "--sensor", "1"], "--sensor: only of a file of poses"), ([take, "--rate-hz", "100"], "--rate-hz: only of a file of poses"),
                               ([take, "--to", "ndi"], "is written from a file of poses")):
            done = subprocess.run([*program, *words], capture_output=True, text=True, check=False)
            self.assertEqual((done.returncode, done.stderr.count("\n")), (2, 1), done.stderr)
            self.assertIn(message, done.stderr)

    def test_own_mcap_is_read(self):
        take, out = os.path.join(self.folder, "take"), os.path.join(self.folder, "take.mcap")
        run = tricoil.run("hand", duration_s=1, record=take, fidelity="columns")
        tricoil.command("convert", take, to="mcap", out=out)
        read = tricoil.read_poses(out)
        valid = run.poses[run.poses["valid"]]
        np.testing.assert_allclose(read.position_m, valid["position_m"], atol=1e-6)
        with open(out, "rb") as file:
            data = file.read()
        for content, message in ((data[:len(data) // 2], "cut off"), (data[:8], "no messages"), (data.replace(b"tricoil.Pose", b"another.Pose"), "no messages")):
            with open(out, "wb") as file:
                file.write(content)
            with self.assertRaisesRegex(ValueError, message):
                tricoil.read_poses(out)

    def test_mat_has_every_field_and_the_matrices(self):
        """Units and angles are of the fields, not of the matrices."""
        take, out = os.path.join(self.folder, "take"), os.path.join(self.folder, "take.mat")
        run = tricoil.run("hand", duration_s=1, record=take, faults=["unplugged@0.5-0.8"])
        tricoil.command("convert", take, to="mat", out=out, units="mm", euler="zyx")
        tricoil.command("convert", take, to="full", out=os.path.join(self.folder, "take.jsonl"), units="mm", euler="zyx")
        with open(out, "rb") as file:
            poses = read_mat(file.read())["poses"]
        with open(os.path.join(self.folder, "take.jsonl"), encoding="utf-8") as lines:
            rows = [json.loads(line) for line in lines]
        self.assertEqual(set(poses), rows[0].keys() - {"flag_names"})
        known = np.array([row["position_mm"] is not None for row in rows])
        self.assertTrue(0 < known.sum() < len(rows))
        for name in rows[0].keys() - {"flag_names", "covariance", "couplings"}:
            expected = np.full(poses[name].shape, np.nan)
            for n, row in enumerate(rows):
                if row[name] is not None:
                    expected[n] = row[name]
            np.testing.assert_array_equal(poses[name], expected, name)
        covariance = poses["covariance"]
        np.testing.assert_array_equal(covariance, covariance.swapaxes(0, 1))
        np.testing.assert_allclose(covariance[:, :, known], np.moveaxis(run.poses["covariance"][known], 0, 2), rtol=1e-14)
        np.testing.assert_array_equal(covariance[:, :, ~known], np.where(np.eye(6), np.inf, 0)[:, :, None].repeat((~known).sum(), axis=2))
        np.testing.assert_array_equal(np.moveaxis(poses["couplings"], 2, 0), run.poses["couplings"])

    def test_mat_of_no_pose_and_of_too_many(self):
        take, out = os.path.join(self.folder, "take"), os.path.join(self.folder, "take.mat")
        tricoil.run("hand", duration_s=0.5, record=take, fidelity="columns")
        with mock.patch.object(_mat_poses, "MOST_POSES", 10), self.assertRaisesRegex(ValueError, "at most 10 poses; use to csv or mcap"):
            tricoil.command("convert", take, to="mat", out=out)
        self.assertFalse(os.path.exists(out))
        with open(os.path.join(take, "recording.json"), encoding="utf-8") as file:
            description = {**json.load(file), "complete": False}
        with open(os.path.join(take, "recording.json"), "w", encoding="utf-8") as file:
            json.dump(description, file)
        with open(os.path.join(take, "poses.csv"), "w", encoding="utf-8"):
            pass
        tricoil.command("convert", take, to="mat", out=out)
        with open(out, "rb") as file:
            poses = read_mat(file.read())["poses"]
        self.assertEqual((poses["std_m_rad"].shape, poses["covariance"].shape), ((0, 6), (6, 6, 0)))

    def test_rests(self):
        take, out = os.path.join(self.folder, "take"), os.path.join(self.folder, "rests.csv")
        tricoil.run("still", duration_s=1, record=take, fidelity="columns")
        self.assertEqual(tricoil.command("convert", take, to="rests", out=out)["rests"], 1)
        with open(out, encoding="utf-8") as file:
            self.assertTrue(file.readline().startswith("rest,start_s,duration_s,x11,x12,"))
        for options, message in (({"units": "mm"}, "units: not with to rests, which defines its own units"), ({"euler": "zyx"}, "euler: not with to rests, which has no angles"),
                                 ({"boresight": True}, "tip, relative_to, align and boresight: not with to rests, which has couplings, not poses"),
                                 ({"out": os.path.join(take, "rests.csv")}, "lies in the folder of the recording")):
            with self.assertRaisesRegex(ValueError, message):
                tricoil.command("convert", take, **{"to": "rests", "out": out, **options})
        path = os.path.join(take, "recording.json")
        with open(path, encoding="utf-8") as file:
            description = json.load(file)
        description["source"]["wiring_file"] = "wiring.toml"
        for trackers, message in ((description["trackers"], None), (None, "the device computed the poses"), ({"calibration": {}}, "recorded with a calibration")):
            with open(path, "w", encoding="utf-8") as file:
                json.dump({**description, "trackers": trackers}, file)
            if message is None:
                tricoil.command("convert", take, to="rests", out=out)
                with open(out, encoding="utf-8") as file:
                    self.assertEqual(file.readline(), "# wiring corrected\n")
                continue
            with self.assertRaisesRegex(ValueError, message):
                _rests._described(take)

    def test_binary_formats_are_named(self):
        for content, message in ((b"\x02\x50" + bytes(600), "is C3D"), (b"#ROSBAG V2.0\n", "is a rosbag"), (b"SQLite format 3\x00" + bytes(100), "is a rosbag")):
            path = os.path.join(self.folder, "binary")
            with open(path, "wb") as file:
                file.write(content)
            with self.assertRaisesRegex(ValueError, message):
                tricoil.read_poses(path)

    def test_uneven_poses_have_no_frame_numbers(self):
        given = poses()
        uneven = tricoil.Poses(given.time_s + 0.4 / RATE_HZ * np.sin(np.arange(200)), given.position_m, given.quaternion_wxyz)
        with self.assertRaisesRegex(ValueError, "not equally spaced"):
            _convert.converted(uneven, "ndi")


if __name__ == "__main__":
    unittest.main()
