"""tricoil motion --plan: a path for a robot, within its limits."""

import json
import os
import subprocess
import tempfile
import unittest

import numpy as np
import tricoil
from scipy.spatial.transform import Rotation

#: A common arm of six joints.
ARM = """joint,a_m,alpha_deg,d_m,theta_deg,lower,upper,speed
q1,0,90,0.4,0,-170,170,150
q2,0.45,0,0,0,-120,120,150
q3,0.05,90,0,0,-140,140,150
q4,0,-90,0.42,0,-185,185,300
q5,0,90,0,0,-120,120,300
q6,0,0,0.1,0,-350,350,400
"""


class Plan(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.file = os.path.join(folder.name, "plan.csv")

    def planned(self, **options):
        return tricoil.command("motion", plan=self.file, **options), tricoil.read_poses(self.file)

    def test_path_stays_within_limits_and_box(self):
        for options, limits, turns in (({}, (1, 10, 100), (3, 30, 300)), ({"limits": "0.3,2,30", "turn_limits": "1,5,50", "size": "0.2,0.3,0.1", "center": "0.5,0.2,-0.1", "turn": 20},
                                                                          (0.3, 2, 30), (1, 5, 50))):
            result, poses = self.planned(rate_hz=200, **options)
            step = np.diff(poses.position_m, axis=0) * 200
            self.assertLessEqual(np.linalg.norm(step, axis=1).max(), limits[0])
            self.assertLessEqual(np.linalg.norm(np.diff(step, axis=0) * 200, axis=1).max(), limits[1])
            turn = Rotation.from_quat(poses.quaternion_wxyz[:, [1, 2, 3, 0]])
            rate = (turn[1:] * turn[:-1].inv()).as_rotvec() * 200
            self.assertLessEqual(np.linalg.norm(rate, axis=1).max(), turns[0] * 1.001)
            self.assertLessEqual(np.linalg.norm(np.diff(rate, axis=0) * 200, axis=1).max(), turns[1] * 1.05)
            size = np.array([float(one) for one in options.get("size", "0.4,0.4,0.4").split(",")])
            centre = np.array([float(one) for one in options.get("center", "0.6,0,0").split(",")])
            self.assertLessEqual((abs(poses.position_m - centre) - size / 2).max(), 1e-8)
            self.assertLessEqual(np.degrees(turn.magnitude()).max(), options.get("turn", 45) + 1e-6)
            self.assertAlmostEqual(result["duration_s"], poses.time_s[-1] - poses.time_s[0], places=6)

    def test_parts_reach_what_they_name(self):
        """Static grid first; each axis alone, then combined; shares of the speeds; near, middle and far."""
        result, poses = self.planned()
        names = [part["name"] for part in result["parts"]]
        self.assertEqual(names[0], "grid at rest")
        grid = poses.position_m[:round(result["parts"][1]["from_s"] * 100)]
        still = np.append(np.linalg.norm(np.diff(grid, axis=0), axis=1) < 1e-9, False)
        self.assertEqual(len(np.unique(np.round(grid[still], 6), axis=0)), 27)
        by_name = {part["name"]: part for part in result["parts"]}
        for share in (0.25, 0.5, 1):
            for axis in "xyz":
                self.assertAlmostEqual(by_name[f"speed {share:g} m/s, axis {axis}"]["max_speed_m_s"], share, delta=0.03 * share)
                self.assertAlmostEqual(by_name[f"rate {3 * share:g} rad/s, axis {axis}"]["max_rate_rad_s"], 3 * share, delta=0.1 * share)
        one = by_name["oscillation 1 Hz, y"]
        rows = poses.position_m[round(one["from_s"] * 100):round((one["from_s"] + one["duration_s"]) * 100)]
        self.assertLess(np.ptp(rows[:, [0, 2]], axis=0).max(), 1e-8)
        self.assertGreater(np.ptp(rows[:, 1]), 0.2)
        ranges = []
        for place in ("near", "middle", "far"):
            part = by_name[f"combined, {place}"]
            ranges.append(poses.position_m[round(part["from_s"] * 100):round((part["from_s"] + part["duration_s"]) * 100), 0].mean())
        np.testing.assert_allclose(ranges, (0.4, 0.6, 0.8), atol=0.02)

    def test_program_and_trajectory(self):
        program = os.environ["TRICOIL_PROGRAM"]
        done = subprocess.run([program, "motion", "--plan", self.file, "--grid", "2", "--json"], capture_output=True, text=True, check=True)
        self.assertEqual(json.loads(done.stdout)["rate_hz"], 100)
        done = subprocess.run([program, "motion", "--trajectory", self.file, "--loop", "closed"], capture_output=True, text=True, check=True)
        self.assertIn("near field   assumed: (r k)^2 / 2 =", done.stdout)
        self.assertEqual(tricoil.command("motion", trajectory=self.file, rate_hz="120,50", loop="closed")["update_s"], 1 / 120)
        done = subprocess.run([program, "motion", "--plan", "-", "--grid", "2"], capture_output=True, text=True, check=True)
        self.assertTrue(done.stdout.startswith("time_s,") and done.stdout.endswith(",approach\n"), done.stdout[-100:])
        for words, message in ((["--plan", self.file, "--poses", "a.csv"], "--plan: not with"), (["--size", "1,1,1"], "--size requires --plan"), (["--example", "I", "--rate-hz", "240,120"], "--rate-hz A,B requires"),
                               (["--unit", "mm"], "--unit requires --poses"), (["--plan", self.file, "--timing", "fdm"], "--timing requires --poses")):
            done = subprocess.run([program, "motion", *words], capture_output=True, text=True, check=False)
            self.assertEqual((done.returncode, done.stderr.count("\n")), (2, 1), done.stderr)
            self.assertIn(message, done.stderr)

    def arm(self, text=ARM):
        file = os.path.join(os.path.dirname(self.file), "arm.csv")
        with open(file, "w", encoding="utf-8") as out:
            out.write(text)
        return {"chain": file, "start_joints": "0,60,-20,0,70,0", "grid": 2, "size": "0.2,0.2,0.2", "turn": 30, "limits": "0.4,4,40", "turn_limits": "2,20,200", "rate_hz": 50}

    def test_joints_of_a_robot_follow_the_plan_within_their_limits(self):
        options = self.arm()
        result, poses = self.planned(**options)
        with open(self.file, encoding="utf-8") as file:
            self.assertEqual(file.readline(), "time_s,x_m,y_m,z_m,qw,qx,qy,qz,q1,q2,q3,q4,q5,q6,part\n")
        arm = tricoil.truth([], joints=self.file, chain=options["chain"]).poses
        attitude = [Rotation.from_quat(one.quaternion_wxyz[:, [1, 2, 3, 0]]) for one in (poses, arm)]
        np.testing.assert_allclose(arm.time_s, poses.time_s)
        np.testing.assert_allclose((attitude[1][0].inv() * attitude[1]).as_matrix(), attitude[0].as_matrix(), atol=2e-6)
        moved = attitude[1][0].inv().apply(arm.position_m - arm.position_m[0])
        np.testing.assert_allclose(moved, poses.position_m - poses.position_m[0], atol=2e-6)
        for joint, low, high, speed in zip(result["joints"], (-170, -120, -140, -185, -120, -350), (170, 120, 140, 185, 120, 350), (150, 150, 150, 300, 300, 400)):
            self.assertTrue(np.radians(low) <= joint["lowest"] < joint["highest"] <= np.radians(high) and 0 < joint["max_speed"] <= np.radians(speed), joint)

    def test_a_plan_that_a_robot_cannot_follow_is_refused(self):
        for change, options, message in ((("", ""), {"size": "2,2,2", "center": "1.5,0,0"}, "cannot reach the pose at .* mm and .* deg are left"),
                                         (("", ""), {"start_joints": None}, "needs start_joints: the values of q1, q2"),
                                         (("", ""), {"start_joints": "1,2"}, "start_joints must be 6 numbers"), (("", ""), {"chain": None}, "require chain"),
                                         (("", ""), {"link": "hand"}, "leave link out"), (("-350,350", "-350,high"), {}, "'high' in column upper is not a number")):
            with self.subTest(message), self.assertRaisesRegex(ValueError, message):
                self.planned(**{**self.arm(ARM.replace(*change)), **options})
            self.assertFalse(os.path.exists(self.file))

    def test_limits_of_joints_are_named_with_place_and_mend(self):
        from tricoil import _chain, _plan_joints

        start, rows = np.radians([0, 60, -20, 0, 70, 0]), np.linspace(0, 1, 41)[:, None] * [0, 0.1, 0.1, 0, 0, 0.2]
        for change, message in ((("-120,120,150", "55,120,150"), "joint q2 would be at .* deg at .* s .the part.; its limit is 55.0"),
                                (("-120,120,150", "59,120,150"), "its limit is 59.0"),
                                (("150\nq2", "5\nq2"), "joint q1 would need .* its limit is 5.0; give --limits and --turn-limits with at most 0.[0-9]+ of these speeds")):
            chain = _chain.read_chain(self.arm(ARM.replace(*change))["chain"])
            with self.subTest(message), self.assertRaisesRegex(ValueError, message):
                _plan_joints.follow(chain, start, np.zeros(3), rows, 20.0, lambda _: "the part")
        values = _plan_joints.follow(_chain.read_chain(self.arm()["chain"]), start, np.zeros(3), rows, 20.0, str)
        np.testing.assert_allclose(values[0], start, atol=1e-9)

    def test_a_plan_that_cannot_be_is_refused_by_name(self):
        for options, message in (({"size": "0.05,0.4,0.4"}, r"limits: to reach the speed \S+ within 0.05 m \(axis x\), the (acceleration|jerk) must be"),
                                 ({"turn": 5}, "turn_limits: to reach the speed"), ({"center": "0.2,0,0"}, "center, size: the box comes as near as 0 m"),
                                 ({"grid": 1}, "grid must be a whole number"), ({"grid": 12, "limits": "0.01,1,10"}, "grid, limits: the grid alone takes"),
                                 ({"limits": "1,2"}, "limits must be 3 numbers larger than 0, separated by commas; is"),
                                 ({"grid": 2, "turn_limits": "1e-3,1,10"}, "turn_limits: the plan takes more than 3600 s"),
                                 ({"limits": "1,0,1"}, "larger than 0"), ({"rate_hz": 5}, "rate_hz must be 20 to"),
                                 ({"turn": 200}, "turn must be at most 170"), ({"size": "nan,1,1"}, "size must be 3 numbers")):
            with self.assertRaisesRegex(ValueError, message):
                self.planned(**options)
            self.assertFalse(os.path.exists(self.file))


if __name__ == "__main__":
    unittest.main()
