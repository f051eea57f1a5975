"""tricoil bench: rest, pivot, board of known holes, hinge and pendulum, on recordings with known answers."""

import json
import os
import subprocess
import unittest

import numpy as np
from folder_case import FolderCase
import tricoil
from bench_cases import ARM_M, AXIS, DAMPING, HOLES_M, NAMES, OMEGA, TIP_M, board_csv, board_xml, mha, pendulum, pivots_at, poses_of, rests_at
from scipy.spatial.transform import Rotation
from tricoil import _bench

ORDER = (0, 1, 2, 3, 4, 5, 6, 7)
STRAIN = np.diag((1, 1, 0.983))  # distances along z are measured 1.7 % too short


class Files(FolderCase):
    def setUp(self):
        super().setUp()
        self.board = self.write("board.csv", board_csv())

    def write(self, name, text):
        path = os.path.join(self.folder, name)
        with open(path, "w", encoding="utf-8") as file:
            file.write(text)
        return path


class Divots(Files):
    def test_tip_and_divots_are_found_with_honest_uncertainty(self):
        """Squared errors of 20 recordings over their stated variances."""
        squares = []
        for seed in range(20):
            pivot = tricoil.bench(pivots_at(ORDER, seed))["pivot"]
            self.assertEqual(len(pivot["divots"]), 8)
            error = np.array(pivot["tip_m"]) - TIP_M
            self.assertLess(np.linalg.norm(error), 2e-4)
            squares.append(error @ np.linalg.solve(pivot["tip_covariance_m2"], error) / 3)
        self.assertTrue(0.4 < np.mean(squares) < 2, np.mean(squares))

    def test_one_divot_in_which_some_poses_are_wild(self):
        pivot = tricoil.bench(pivots_at((0,), 3, seconds=15, wild=0.1))["pivot"]
        np.testing.assert_allclose(pivot["tip_m"], TIP_M, atol=3e-4)
        self.assertGreater(pivot["outliers"], 5)

    def test_a_scale_on_one_axis_is_named_with_its_uncertainty(self):
        squares = []
        for seed in range(10):
            board = tricoil.bench(pivots_at(ORDER, seed, STRAIN), board=self.board)["board"]
            self.assertEqual([(one["name"], one["board_axis"]) for one in board["strains"]], [("scale z", "x")])
            self.assertGreater(board["rms_m"], 1e-3)
            self.assertLess(board["explained_rms_m"], 3e-4)
            squares.append(((board["strains"][0]["value"] + 0.017) / board["strains"][0]["std"]) ** 2)
        self.assertTrue(0.2 < np.mean(squares) < 2.5, np.mean(squares))
        text = _bench.text(tricoil.bench(pivots_at(ORDER, 1, STRAIN), board=self.board))
        self.assertRegex(text, r"a scale of 1\.\d\d \+- 0\.\d\d % on axis z \(axis x of the board\): distances are measured too short")

    def test_a_strain_of_the_sensors_positions(self):
        """It does not strain the lever to the tip: the tip and the size of the strain are right once both agree."""
        shear = np.eye(3) + 0.01 * np.array(((0, 0, 0), (0, 0, 1), (0, 1, 0)))
        for strain, name, value in ((STRAIN, "scale z", -0.017), (np.diag((1, 1.02, 1)), "scale y", 0.02), (shear, "shear yz", 0.01)):
            squares = []
            for seed in range(6):
                result = tricoil.bench(pivots_at(ORDER, seed, strain, of_sensor=True), board=self.board)
                board = result["board"]
                self.assertEqual([one["name"] for one in board["strains"]], [name])
                squares.append(((board["strains"][0]["value"] - value) / board["strains"][0]["std"]) ** 2)
                self.assertLess(np.linalg.norm(np.array(board["tip_without_strain_m"]) - TIP_M), 2e-4)
            self.assertLess(np.mean(squares), 2.5, (name, squares))
            self.assertIn("without it the tip is ", _bench.text(result))
        self.assertIsNone(tricoil.bench(pivots_at(ORDER, 1, STRAIN), board=self.board)["board"]["tip_without_strain_m"])

    def test_nothing_is_named_where_nothing_is_wrong(self):
        named = [tricoil.bench(pivots_at(ORDER, seed), board=self.board)["board"]["strains"] for seed in range(10)]
        self.assertLessEqual(sum(map(bool, named)), 1)

    def test_exact_poses(self):
        result = tricoil.bench(pivots_at(ORDER, 1, noise_m=0, noise_rad=0, wild=0), board=self.board)
        self.assertLess(result["pivot"]["residual_rms_m"], 1e-9)
        self.assertEqual(result["board"]["strains"], [])
        json.dumps(result, allow_nan=False)

    def test_shear_and_uniform_scale(self):
        shear = np.eye(3) + 0.02 * np.array(((0, 1, 0), (1, 0, 0), (0, 0, 0)))
        for strain, name in ((shear, "shear xy"), (1.02 * np.eye(3), "scale")):
            board = tricoil.bench(pivots_at(ORDER, 2, strain), board=self.board)["board"]
            self.assertEqual(board["strains"][0]["name"], name)
            self.assertAlmostEqual(board["strains"][0]["value"], 0.02, delta=4 * board["strains"][0]["std"])

    def test_holes_in_any_order_and_twice(self):
        order = (5, 0, 3, 7, 2, 6, 1, 4, 0, 5)
        board = tricoil.bench(pivots_at(order, 4), board=self.board)["board"]
        self.assertEqual(board["holes"], [NAMES[n] for n in order])
        self.assertLess(board["repeatability_m"], 5e-4)
        self.assertEqual(board["distances"]["pairs"], 43)  # of 45, without the two of equal holes

    def test_sequence_of_plustoolkit_with_its_configuration(self):
        """Stylus and reference move in the frame of the tracker; the program finds the rest by itself."""
        file = self.write("eight.igs.mha", mha(pivots_at(ORDER, 1, STRAIN), Rotation.from_euler("ZYX", (40, 10, -70), degrees=True), np.array((0.35, -0.15, 0.01))))
        out = os.path.join(self.folder, "points.csv")
        words = ["bench", file, "--sensor", "Stylus", "--relative-to", "Reference", "--board", self.write("phantom.xml", board_xml()), "--out", out]
        done = subprocess.run([os.environ["TRICOIL_PROGRAM"], *words, "--json"], capture_output=True, text=True, check=True)
        result = json.loads(done.stdout)
        self.assertEqual(result["board"]["strains"][0]["name"], "scale z")
        self.assertEqual(result["board"]["holes"], NAMES)
        self.assertEqual(len(tricoil.command("bench", file, sensor="Stylus", relative_to="Reference")["pivot"]["divots"]), 8)
        with open(out, encoding="utf-8") as points:
            self.assertEqual(len(points.readlines()), 9)
        done = subprocess.run([os.environ["TRICOIL_PROGRAM"], "bench", file], capture_output=True, text=True, check=True)
        self.assertIn("StylusToTrackerTransform in the frame of ReferenceToTrackerTransform", done.stdout)
        self.assertRegex(done.stdout, r"pivot +0\.\d\d mm RMS of \d+ poses in 8 divots")
        done = subprocess.run([os.environ["TRICOIL_PROGRAM"], "bench", file, "--relative-to", "Reference"], capture_output=True, text=True, check=False)
        self.assertEqual((done.returncode, done.stderr.count("\n")), (2, 1))
        self.assertIn("choose one with --sensor", done.stderr)

    def test_refused(self):
        mirrored = pivots_at(ORDER, 1)
        mirrored = poses_of(mirrored.time_s, mirrored.position_m * (1, 1, -1), Rotation.from_quat(mirrored.quaternion_wxyz[:, [1, 2, 3, 0]] * (-1, -1, 1, 1)))
        hand = tricoil.run("hand", tracker="direct", duration_s=6, fidelity="columns").poses
        for poses, options, message in (
            (pivots_at(ORDER, 1), {"board": self.write("inch.csv", board_csv("m").replace("x_m,y_m,z_m", "x,y,z"))}, "is the board, or the file of poses, in"),
            (pivots_at(ORDER, 1), {"board": self.board, "holes": "#1,#2"}, "holes: 2 names; 8 points"),
            (pivots_at(ORDER, 1), {"board": self.board, "holes": ",".join(["#9"] * 8)}, "no hole #9"),
            (pivots_at((0, 1), 1), {"board": self.board}, "at least 3"),
            (pivots_at((0, 1, 2), 1), {"board": self.board, "holes": "#1,#1,#1"}, "in fewer than three holes"),
            (mirrored, {"board": self.board}, "mirror image|more than one way"),
            (pivots_at(ORDER, 1), {"segments": "0-6:swing"}, "unknown kind 'swing'"),
            (pivots_at(ORDER, 1), {"segments": "6-0"}, "has 0 poses"),
            (pivots_at(ORDER, 1), {"segments": "x"}, "segments must be FROM-TO"),
            (rests_at([(0.5, 0, 0)]), {"segments": "0-3:pivot"}, "does not determine the tip"),
            (hand, {"segments": "0-6:pivot"}, "the tip is not at rest"),
            (hand, {}, "no rest of the sensor or of a tip"),
        ):
            with self.assertRaisesRegex(ValueError, message):
                tricoil.bench(poses, **options)

    def test_boards_that_cannot_be_read(self):
        for text, message in (("name,x_mm,y_mm\na,1,2\n", "no column z_mm"), ("name,x_mm,y_mm,z_mm\na,1,2,3\n", "has 1 holes"),
                              ("name,x_mm,y_cm,z_mm\na,1,2,3\nb,1,2,4\nc,2,2,2\n", "must be one of"), ("<a><Landmark Name='1' Position='1 2'/></a>", "must be three numbers"),
                              ("<a/>", "no element Landmark"), ("<!DOCTYPE a []><a/>", "document type"), ("<a>", "no XML"),
                              ("name,x_mm,y_mm,z_mm\na,1,2,3\na,1,2,4\nc,2,2,2\n", "hole a is there twice"), ("name,x_mm,y_mm,z_mm\na,1,nan,3\nb,1,2,4\nc,2,2,2\n", "finite|number")):
            with self.assertRaisesRegex(ValueError, message):
                tricoil.bench(pivots_at(ORDER, 1), board=self.write("bad", text))


class Rests(Files):
    def test_jitter_and_drift(self):
        one = tricoil.bench(rests_at([(0.5, 0.1, 0)], drift_m_s=2e-5, seconds=30))["rests"]
        self.assertEqual(len(one), 1)
        self.assertAlmostEqual(one[0]["jitter_rms_m"], 1e-4 * np.sqrt(3), delta=1e-5)
        self.assertAlmostEqual(one[0]["jitter_rms_rad"], 3e-4 * np.sqrt(3), delta=3e-5)
        self.assertLess(abs(one[0]["drift_m_per_s"] - 2e-5), 4 * one[0]["drift_std_m_per_s"])
        still = tricoil.bench(rests_at([(0.5, 0.1, 0)], seconds=30))["rests"][0]
        self.assertLess(still["drift_m_per_s"], 4 * still["drift_std_m_per_s"])

    def test_sensor_in_the_holes_of_a_board(self):
        """Hummel's board: the sensor rests in the holes, without a tip; also positions only."""
        places = HOLES_M[[0, 3, 5, 6, 2]] + (0.4, 0, 0)
        board = self.board
        poses = rests_at(places)
        result = tricoil.bench(poses, board=board)
        self.assertEqual(len(result["rests"]), 5)
        self.assertEqual(result["board"]["holes"], ["#1", "#4", "#6", "#7", "#3"])
        self.assertLess(abs(result["board"]["distances"]["trueness_m"]), 1e-4)
        only = tricoil.Poses(poses.time_s, poses.position_m)
        self.assertEqual(tricoil.bench(only, board=board)["board"]["holes"], result["board"]["holes"])
        held = tricoil.bench(poses, board=board, tip_m=(0.05, 0, 0))["board"]
        self.assertAlmostEqual(held["distances"]["rms_m"], result["board"]["distances"]["rms_m"], delta=2e-5)

    def test_order_of_a_regular_grid_must_be_given(self):
        grid = [(x, y, 0) for x in range(4) for y in range(4)]
        board = self.write("grid.csv", "name,x_mm,y_mm,z_mm\n" + "".join(f"{'ABCD'[x]}{y},{50 * x},{50 * y},0\n" for x, y, _ in grid))
        poses = rests_at(0.05 * np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (2, 1, 0)]) + (0.3, 0, 0))
        with self.assertRaisesRegex(ValueError, "more than one way"):
            tricoil.bench(poses, board=board)
        self.assertEqual(tricoil.bench(poses, board=board, holes="A0,B0,B1,A1,C1")["board"]["holes"][4], "C1")


class Turns(unittest.TestCase):
    def test_hinge_and_pendulum(self):
        one = tricoil.bench(pendulum())["hinges"]
        self.assertEqual(len(one), 1)
        hinge, swing = one[0], one[0]["pendulum"]
        self.assertLess(np.arccos(abs(np.dot(hinge["axis"], AXIS))), 1e-3)
        self.assertAlmostEqual(hinge["axial_rms_m"], 1e-4, delta=1e-5)  # noise of the position, without that of the attitude at the arm
        self.assertAlmostEqual(hinge["radial_rms_m"], 1e-4, delta=1e-5)
        self.assertAlmostEqual(hinge["radius_m"], np.linalg.norm(ARM_M - AXIS * (AXIS @ ARM_M)), delta=1e-4)
        self.assertLess(abs(swing["period_s"] - 2 * np.pi / OMEGA), 5 * swing["period_std_s"])
        self.assertLess(swing["period_std_s"], 1e-3)
        self.assertLess(abs(swing["damping_per_s"] - DAMPING), 5 * swing["damping_std_per_s"])

    def test_a_late_pendulum_differs_where_it_is_fast(self):
        """A tracker with a lag that depends on the speed leaves more where the pendulum is fast."""
        poses = pendulum()
        twice = Rotation.from_quat(poses.quaternion_wxyz[:, [1, 2, 3, 0]])
        rate = np.gradient((twice * twice[0].inv()).as_rotvec() @ AXIS, poses.time_s)
        late = poses_of(poses.time_s, poses.position_m, Rotation.from_rotvec(0.004 * np.abs(rate)[:, None] * AXIS) * twice)
        swing = tricoil.bench(late)["hinges"][0]["pendulum"]
        self.assertGreater(swing["residual_fast_rad"], 1.15 * swing["residual_slow_rad"])
        clean = tricoil.bench(poses)["hinges"][0]["pendulum"]
        self.assertAlmostEqual(clean["residual_fast_rad"] / clean["residual_slow_rad"], 1, delta=0.1)
        self.assertGreater(swing["residual_rms_rad"], 4 * clean["residual_rms_rad"])

    def test_given_segments(self):
        poses = pendulum()
        self.assertIsNotNone(tricoil.bench(poses, segments="1-12:pendulum")["hinges"][0]["pendulum"])
        self.assertEqual(len(tricoil.bench(poses, segments="1-6:hinge,6-12")["hinges"]), 2)

    def test_few_poses(self):
        poses = pendulum()
        few = poses_of(poses.time_s[::60], poses.position_m[::60], Rotation.from_quat(poses.quaternion_wxyz[::60][:, [1, 2, 3, 0]]))
        for kind in ("hinge", "pendulum"):
            with self.assertRaisesRegex(ValueError, f"the {kind} from .* s has 12 poses; at least 20 are needed"):
                tricoil.bench(few, segments=f"0-{few.time_s[11] - few.time_s[0]}:{kind}")


if __name__ == "__main__":
    unittest.main()
