"""Ground truth: fusion of poses, joints and an inertial sensor, kinematic chains, files and bad input."""

import importlib.util
import json
import os
import pathlib
import subprocess
import tempfile
import unittest

import numpy as np
import truth_cases as cases
from scipy.spatial.transform import Rotation

import tricoil

HAS_KDL = importlib.util.find_spec("PyKDL") is not None
DH = "joint,type,a_m,alpha_rad,d_m,theta_rad,convention\n"
URDF = """<robot name="arm"><link name="base"/><link name="upper"/><link name="slide"/><link name="tool"/>
<joint name="turn" type="revolute"><parent link="base"/><child link="upper"/><origin xyz="0.1 0.2 0.3" rpy="0.3 -0.5 1.1"/><axis xyz="0 1 1"/></joint>
<joint name="move" type="prismatic"><parent link="upper"/><child link="slide"/><origin xyz="0 0.4 0" rpy="0 0.2 0"/><axis xyz="1 0 0.5"/></joint>
<joint name="end" type="fixed"><parent link="slide"/><child link="tool"/><origin xyz="0.05 0 0.1" rpy="1 0 0"/></joint></robot>"""


class Folder(unittest.TestCase):
    def setUp(self):
        place = tempfile.TemporaryDirectory()
        self.addCleanup(place.cleanup)
        self.folder = pathlib.Path(place.name)

    def write(self, name, text):
        (self.folder / name).write_text(text)
        return str(self.folder / name)


class Chains(Folder):
    def values(self, names, count=20):
        rng = np.random.default_rng(3)
        return {name: rng.uniform(-3, 3, count) for name in names}

    @unittest.skipUnless(HAS_KDL, "PyKDL is not installed: toolchain/install-deps test installs python3-pykdl")
    def test_denavit_hartenberg_is_that_of_kdl(self):
        import PyKDL
        from tricoil import _chain

        rng = np.random.default_rng(1)
        for convention in ("standard", "modified"):
            rows, kdl = rng.uniform(-2, 2, (7, 4)), PyKDL.Chain()
            for a, alpha, d, theta in rows:
                turning = PyKDL.Segment("", PyKDL.Joint(PyKDL.Joint.RotZ), PyKDL.Frame.DH(a, alpha, d, theta))
                fixed = PyKDL.Segment("", PyKDL.Joint(PyKDL.Joint.Fixed), PyKDL.Frame.DH_Craig1989(a, alpha, d, theta))
                for segment in [turning] if convention == "standard" else [fixed, PyKDL.Segment("", PyKDL.Joint(PyKDL.Joint.RotZ))]:
                    kdl.addSegment(segment)
            lines = [f"j{n},revolute,{','.join(map(repr, row.tolist()))},{convention}" for n, row in enumerate(rows)]
            self.compare(_chain.read_chain(self.write("dh.csv", DH + "\n".join(lines))), kdl, [f"j{n}" for n in range(7)])

    @unittest.skipUnless(HAS_KDL, "PyKDL is not installed: toolchain/install-deps test installs python3-pykdl")
    def test_urdf_is_that_of_kdl(self):
        import PyKDL
        from tricoil import _chain

        kdl = PyKDL.Chain()
        for xyz, rpy, axis, kind in (((0.1, 0.2, 0.3), (0.3, -0.5, 1.1), (0, 1, 1), "Rot"), ((0, 0.4, 0), (0, 0.2, 0), (1, 0, 0.5), "Trans"),
                                     ((0.05, 0, 0.1), (1, 0, 0), None, None)):
            kdl.addSegment(PyKDL.Segment("", PyKDL.Joint(PyKDL.Joint.Fixed), PyKDL.Frame(PyKDL.Rotation.RPY(*rpy), PyKDL.Vector(*xyz))))
            if kind:
                joint = PyKDL.Joint("", PyKDL.Vector(), PyKDL.Vector(*axis), getattr(PyKDL.Joint, kind + "Axis"))
                kdl.addSegment(PyKDL.Segment("", joint))
        self.compare(_chain.read_chain(self.write("arm.urdf", URDF)), kdl, ["turn", "move"])

    def compare(self, chain, kdl, names):
        import PyKDL

        self.assertEqual(chain.wanted(), names)
        values = self.values(names)
        position, turn = chain.pose(values)
        solver, joints, frame = PyKDL.ChainFkSolverPos_recursive(kdl), PyKDL.JntArray(len(names)), PyKDL.Frame()
        for row, matrix in enumerate(turn.as_matrix()):
            for n, name in enumerate(names):
                joints[n] = values[name][row]
            solver.JntToCart(joints, frame)
            np.testing.assert_allclose(position[row], list(frame.p), rtol=0, atol=1e-9)
            np.testing.assert_allclose(matrix, [[frame.M[i, j] for j in range(3)] for i in range(3)], rtol=0, atol=1e-9)

    def test_mimic_and_degrees(self):
        text = URDF.replace('type="prismatic">', 'type="revolute"><mimic joint="turn" multiplier="2" offset="0.1"/>')
        chain = self.write("arm.urdf", text)
        time_s = np.linspace(0, 1, 40)
        rad = cases.table(self.folder / "rad.csv", {"time_s": time_s, "turn": time_s})
        deg = cases.table(self.folder / "deg.csv", {"time_s": time_s, "turn_deg": np.degrees(time_s)})
        one, two = (tricoil.truth([], joints=file, chain=chain) for file in (rad, deg))
        np.testing.assert_allclose(one.poses.position_m, two.poses.position_m, atol=1e-6)

    def test_bad_chains_are_refused(self):
        from tricoil import _chain

        loop = URDF.replace("</robot>", '<joint name="back" type="fixed"><parent link="tool"/><child link="base"/></joint></robot>')
        twice = URDF.replace("</robot>", '<joint name="back" type="fixed"><parent link="base"/><child link="tool"/></joint></robot>')
        for text, link, message in ((loop, "tool", "are a loop"), (loop, None, "loop"), (twice, None, "two parent joints"), (URDF, "hand", "no link hand"),
                                    (URDF.replace('parent link="slide"', 'parent link="slid"'), None, "which is not in the file"),
                                    (URDF.replace("prismatic", "planar"), None, "of type planar"), (URDF.replace("0 1 1", "0 1"), None, "three numbers"),
                                    (URDF[:-8], None, "no XML"), ("<a/>", None, "no URDF"), ("", None, "is empty"),
                                    ("a_m,alpha_rad,d_m\n1,2,3\n", None, "no column theta"), ("a,alpha_rad,d_m,theta_rad\n1,2,3,4\n", None, "no unit"),
                                    (DH + "q,turning,1,2,3,4,standard\n", None, "type must be"), (DH + "q,revolute,1,nan,3,4,standard\n", None, "not finite")):
            with self.subTest(message), self.assertRaisesRegex(ValueError, message):
                _chain.read_chain(self.write("chain", text), link)

    def test_bad_joint_values_are_refused(self):
        chain = self.write("arm.urdf", URDF)
        for text, message in (("time_s,turn\n0,1\n", "no column of joint move"), ("turn,move\n0,1\n", "no column time_s"),
                              ("time_s,turn,move\n0,1,nan\n", "not finite"), ("time_s,turn,move\n0,1,2\n", "1 pose;"),
                              ("time_s,turn,turn_deg,move\n0,1,2,3\n", "two columns of joint turn")):
            with self.subTest(message), self.assertRaisesRegex(ValueError, message):
                tricoil.truth([], joints=self.write("joints.csv", text), chain=chain)


class Fusion(Folder):
    def fused(self, case, gap_s, **options):
        """Errors of the hidden poses by the fusion and by a spline, their covariance, and the result."""
        time_s, position, q, *_ = case
        known = ~np.isnan(position[:, 0])
        keep = cases.shown(time_s, known, gap_s)
        optics, imu = cases.files(self.folder, case, keep)
        result = tricoil.truth(optics, imu=imu, **options)
        hidden = known & ~keep & (time_s > time_s[keep][2]) & (time_s < time_s[keep][-3])
        n = np.searchsorted(result.poses.time_s, time_s[hidden] - 1e-6)
        np.testing.assert_allclose(result.poses.time_s[n], time_s[hidden], atol=1e-5)
        return hidden, n, keep, result

    def compare(self, case, gap_s, motion=None):
        """How many times larger the errors of a spline are, in position and rotation; NEES per degree of freedom of the path where poses are hidden.

        motion: the truth; None: the hidden poses are.
        """
        time_s, position, q, *_ = case
        hidden, n, keep, result = self.fused(case, gap_s)
        at, turn = (position[hidden], cases.turns(q[hidden])) if motion is None else motion(time_s[hidden])
        error = cases.errors((result.poses.position_m[n], result.poses.quaternion_wxyz[n]), at, turn)
        by_spline, turned = cases.spline(time_s[keep], position[keep], q[keep], time_s[hidden])
        other = np.hstack((by_spline - at, (turned * turn.inv()).as_rotvec()))
        parts = slice(0, 3), slice(3, 6)
        covariance, first = result.covariance[n], result.streams[0]
        if motion is None:  # the hidden poses have their own noise
            covariance = covariance + np.diag([first["noise_m"] ** 2] * 3 + [first["noise_rad"] ** 2] * 3)
        return [cases.rms(other[:, part]) / cases.rms(error[:, part]) for part in parts], cases.nees(error, covariance), result

    def test_generated_motion(self):
        case, motion = cases.generated()
        for gap_s, least in ((0.2, 3), (0, 1)):
            better, ratio, result = self.compare(case, gap_s, motion)
            with self.subTest(gap_s):
                self.assertGreater(min(better), least)
                self.assertGreater(ratio, 0.6)
                self.assertLess(ratio, 1.4)
                imu = result.inertial
                self.assertAlmostEqual(imu["clock_offset_s"], cases.OFFSET_S, delta=5e-4)
                np.testing.assert_allclose(imu["lever_m"], cases.LEVER_M, atol=4e-3)
                self.assertLess((Rotation.from_quat(np.roll(imu["mount_wxyz"], -1)) * cases.MOUNT.inv()).magnitude(), 0.01)
                self.assertAlmostEqual(imu["gravity_m_s2"], 9.81, delta=0.1)

    def test_size_of_the_accelerations(self):
        """A slow motion shows gravity; a fast one may have much more, but not in another unit."""
        from tricoil._inertial import check_gravity

        direction = np.random.default_rng(5).normal(size=(200, 3))
        direction /= np.linalg.norm(direction, axis=1)[:, None]
        fast = direction * np.linspace(5, 45, 200)[:, None]
        check_gravity(9.8 * direction, "slow")
        check_gravity(fast, "fast")
        for acc in (25 * direction, fast / 9.8, 9.8 * fast):
            with self.assertRaisesRegex(ValueError, "the usual acceleration is"):
                check_gravity(acc, "wrong")

    def test_shocks_between_samples(self):
        """Each is seen by one sample only; the fusion does not trust it."""
        (time_s, position, q, acc, gyro), motion = cases.generated(5.0)
        acc = acc.copy()
        acc[150::160] += [0, 0, 200]
        optics, imu = cases.files(self.folder, (time_s, position, q, acc, gyro), cases.shown(time_s, np.ones(len(time_s), bool), 0.2))
        path = tricoil.truth(optics, imu=imu)
        error = path.poses.position_m - motion(path.poses.time_s)[0]
        self.assertLess(cases.rms(error), 2 * cases.NOISE_M)

    @unittest.skipUnless(cases.recorded(), "TRICOIL_DATA_DIR with fast-motion is not set")
    def test_recorded_motion(self):
        path = next(path for path in cases.recorded() if "07" in path.name)
        case = [part[:3500] for part in cases.load(path)]
        better, ratio, _ = self.compare(case, 0.3)
        self.assertGreater(min(better), 3)
        self.assertLess(ratio, 4)

    def test_given_mounting_and_clock(self):
        case, _ = cases.generated(4.0)
        optics, imu = cases.files(self.folder, case)
        x, y, z, w = cases.MOUNT.as_quat()
        result = tricoil.truth(optics, imu=imu, lever_m=cases.LEVER_M, mount_wxyz=(w, x, y, z))
        np.testing.assert_allclose(result.inertial["lever_m"], cases.LEVER_M, atol=1e-6)
        np.testing.assert_allclose(result.inertial["mount_wxyz"], (w, x, y, z), atol=1e-6)

    def test_a_long_gap_is_not_bridged(self):
        """The path before and after it is as good as elsewhere."""
        case, motion = cases.generated(9.0)
        optics, imu = cases.files(self.folder, case, (case[0] < 5) | (case[0] > 6.6))
        path = tricoil.truth(optics, imu=imu)
        position, _ = motion(path.poses.time_s)
        beside = (abs(path.poses.time_s - 5) < 0.3) | (abs(path.poses.time_s - 6.6) < 0.3)
        self.assertFalse(np.any((path.poses.time_s > 5.01) & (path.poses.time_s < 6.59)))
        self.assertLess(cases.rms((path.poses.position_m - position)[beside]), 2e-4)

    def test_without_inertial_sensor(self):
        (time_s, position, q, *_), motion = cases.generated(5.0)
        for columns in ({"qw,qx,qy,qz": q}, {}):
            file = cases.table(self.folder / "optics.csv", {"time_s": time_s, "x_m,y_m,z_m": position, **columns})
            result = tricoil.truth(file)
            error = result.poses.position_m - motion(result.poses.time_s)[0]
            self.assertLess(cases.rms(error), np.sqrt(3) * cases.NOISE_M)
            self.assertEqual(result.poses.quaternion_wxyz is None, not columns)

    def test_second_stream(self):
        (time_s, position, q, *_), motion = cases.generated(5.0)
        world, place = Rotation.from_rotvec([0.3, 0.2, -1]), np.array([0.4, -0.2, 0.1])
        p, turn = motion(time_s + 0.5)
        noise = np.random.default_rng(2).normal(0, 2e-4, p.shape)
        other = (world * turn).as_quat()[:, [3, 0, 1, 2]]
        first = cases.table(self.folder / "first.csv", {"time_s": time_s, "x_m,y_m,z_m": position, "qw,qx,qy,qz": q})
        second = cases.table(self.folder / "second.csv", {"time_s": time_s, "x_m,y_m,z_m": world.apply(p) + place + noise, "qw,qx,qy,qz": other})
        result = tricoil.truth([first, second])
        self.assertAlmostEqual(result.streams[1]["clock_offset_s"], -0.5, delta=1e-3)
        error = result.poses.position_m - motion(result.poses.time_s)[0]
        self.assertLess(cases.rms(error), np.sqrt(3) * cases.NOISE_M)

    def test_bad_input_is_refused(self):
        case, _ = cases.generated(6.0)
        time_s, position, q, acc, gyro = case
        mirror, inverse = np.array([1, 1, -1]), np.array([1, -1, -1, -1])
        optics, imu = cases.files(self.folder, case)
        other, _ = cases.generated(6.0, seed=7)
        changes = ((case, {"acc_factor": 1 / 9.80665}, "its unit is g"), (case, {"gyro_factor": 180 / np.pi}, "deg/s"),
                   ((time_s, position * mirror, q * np.array([1, -1, -1, 1]), acc, gyro), {}, "mirrored"), ((time_s, position, q * inverse, acc, gyro), {}, "turn the other way"),
                   ((*other[:3], acc, gyro), {}, "do not hold the same motion"), (tuple(part[:1] for part in case), {}, "1 row"))
        for one, factors, message in changes:
            with self.subTest(message), self.assertRaisesRegex(ValueError, message):
                optics, imu = cases.files(self.folder, one, **factors)
                tricoil.truth(optics, imu=imu)
        optics, imu = cases.files(self.folder, case)
        for name, text, message in (("imu", "time_s,a\n0,1\n", "no columns of an inertial sensor"), ("imu", "", "is empty"),
                                    ("imu", pathlib.Path(imu).read_text().replace("\n0.4,", "\n0.4,nan", 1), "not finite|not a number")):
            with self.subTest(message), self.assertRaisesRegex(ValueError, message):
                tricoil.truth(optics, imu=self.write("bad.csv", text))
        rest = np.tile(position[:1], (len(time_s), 1)), np.tile(q[:1], (len(time_s), 1))
        still, only = cases.table(self.folder / "still.csv", {"time_s": time_s, "x_m,y_m,z_m": rest[0], "qw,qx,qy,qz": rest[1]}), {"time_s": time_s + 1.7, "acc_x,acc_y,acc_z": acc}
        alone = cases.table(self.folder / "acc.csv", only)
        fast = cases.table(self.folder / "fast.csv", {"timestamp": 1000 * time_s, "acc_x,acc_y,acc_z": acc, "gyr_x,gyr_y,gyr_z": gyro})
        for poses, sensor, options, message in ((still, imu, {}, "turns too little"), (optics, alone, {"mount_wxyz": (1, 0, 0, 0)}, "no gyroscope"), (optics, fast, {}, "time_ms"),
                                                (optics, alone, {"mount_wxyz": (1, 0, 0, 0), "same_clock": True}, "bias of")):
            with self.subTest(message), self.assertRaisesRegex(ValueError, message):
                tricoil.truth(poses, imu=sensor, **options)
        late = cases.table(self.folder / "late.csv", {"time_s": time_s + 60, "acc_x,acc_y,acc_z": acc, "gyr_x,gyr_y,gyr_z": gyro})
        with self.assertRaisesRegex(ValueError, "does not overlap"):
            tricoil.truth(optics, imu=late, same_clock=True)
        for options, message in (({"lever_m": (0, 0, 0)}, "only with imu"), ({"joints": imu}, "needed together"), ({"imu": imu, "mount_wxyz": (1, 1, 0, 0)}, "length"),
                                 ({"imu": imu, "lever_m": "a,b"}, "lever_m|place")):
            with self.subTest(message), self.assertRaisesRegex(ValueError, message):
                tricoil.truth(optics, **options)


class Program(Folder):
    def run_program(self, *words):
        return subprocess.run([os.environ["TRICOIL_PROGRAM"], *words], capture_output=True, text=True, check=False)

    def test_out_is_read_by_evaluate_and_motion(self):
        case, motion = cases.generated(5.6)
        optics, imu = cases.files(self.folder, case, cases.shown(case[0], np.ones(len(case[0]), bool), 0.2))
        out, plot = str(self.folder / "path.csv"), str(self.folder / "path.svg")
        done = self.run_program("truth", optics, "--imu", imu, "--out", out, "--plot", plot, "--json")
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        found = json.loads(done.stdout)
        path = tricoil.read_poses(out)
        self.assertEqual(len(path), found["poses"])
        self.assertGreater(found["bridged"], 100)
        self.assertAlmostEqual(np.sqrt(np.mean(np.sum(path.deviation[:, :3] ** 2, axis=1))), found["position_deviation_m"], delta=1e-8)
        self.assertIn("<svg", pathlib.Path(plot).read_text())
        time_s = np.arange(0.5, 5, 1 / 120)
        p, turn = motion(time_s)
        tracker = (time_s, p + np.random.default_rng(1).normal(0, 2e-4, p.shape), turn.as_quat()[:, [3, 0, 1, 2]])
        verified = tricoil.verify(tracker, path)
        self.assertAlmostEqual(verified["time_offset_s"], 0, delta=1e-3)
        self.assertGreater(verified["reference_deviation_m"], 0)
        self.assertLess(verified["motion_error_m"], 2e-4)

    def test_bad_input_ends_with_2_and_one_line(self):
        case, _ = cases.generated(4.0)
        optics, imu = cases.files(self.folder, case, gyro_factor=180 / np.pi)
        for words in (["truth"], ["truth", optics, "--imu", imu], ["truth", str(self.folder / "none.csv")], ["truth", optics, "--plot", "a.txt"]):
            done = self.run_program(*words)
            self.assertEqual((done.returncode, done.stdout, done.stderr.count("\n")), (2, "", 1), done)


if __name__ == "__main__":
    unittest.main()
