"""Sources of poses: simulation, devices, wrong names."""

import os
import pty
import signal
import threading
import time
import unittest

import numpy as np
import tricoil
from tricoil import Flag


class Simulation(unittest.TestCase):
    def test_iterates_to_its_end(self):
        poses = list(tricoil.open("sim:hand,duration_s=1"))
        self.assertGreater(len(poses), 220)
        self.assertTrue(all(a.time_s < b.time_s for a, b in zip(poses, poses[1:])))
        last = poses[-1]
        self.assertTrue(last.valid)
        self.assertEqual(last.covariance.shape, (6, 6))
        self.assertLess(last.position_std_m.max(), 0.01)
        np.testing.assert_allclose(np.linalg.norm(last.quaternion_wxyz), 1, atol=1e-12)

    def test_equals_run(self):
        run = tricoil.run("hand", duration_s=1, mux="tdm", tracker="scaat", seed=5)
        poses = list(tricoil.open("sim:hand,duration_s=1,mux=tdm,seed=5", "scaat"))
        np.testing.assert_array_equal([pose.position_m for pose in poses], run.poses["position_m"])

    def test_real_time(self):
        begin = time.monotonic()
        list(tricoil.open("sim:still,duration_s=0.5,realtime=yes"))
        self.assertGreaterEqual(time.monotonic() - begin, 0.4)

    def test_tip_and_boresight(self):
        with tricoil.open("sim:still,noise=no") as source:
            with self.assertRaisesRegex(ValueError, "no valid pose yet"):
                source.boresight()
            before = next(pose for pose in source if pose.valid)
            source.boresight()
            source.set_tip([0, 0, 0.1])
            after = next(source)
        np.testing.assert_allclose(after.quaternion_wxyz, [1, 0, 0, 0], atol=1e-6)
        self.assertAlmostEqual(np.linalg.norm(after.position_m - before.position_m), 0.1, places=6)

    def test_hemisphere(self):
        with tricoil.open("sim:still") as source:
            first = next(pose for pose in source if pose.valid)
            source.set_hemisphere(-first.position_m)
            second = next(source)
        np.testing.assert_allclose(second.position_m, -first.position_m, atol=1e-3)

    def test_flags(self):
        poses = list(tricoil.open("sim:unplugged"))
        self.assertTrue(any(Flag.NO_SENSOR in pose.flags for pose in poses))
        self.assertEqual(str(Flag.NO_SENSOR | Flag.STALE), "no_sensor, stale")
        self.assertEqual(str(Flag(0)), "")

    def test_closed(self):
        source = tricoil.open("sim:still")
        source.close()
        with self.assertRaisesRegex(ValueError, "closed"):
            next(source)
        source.close()


class Names(unittest.TestCase):
    def test_wrong_names(self):
        for name, message in (
            ("nonsense", "unknown source of poses 'nonsense'; use can:INTERFACE"),
            ("sim:hnd", "did you mean 'hand'"),
            ("sim:hand,sed=2", "did you mean 'seed'"),
            ("sim:hand,seed=two", "seed=two: not a valid number"),
            ("sim:hand,seed", "not KEY=VALUE"),
            ("recording:/nowhere", "/nowhere"),
            ("/nowhere/board.toml", "/nowhere/board.toml"),
        ):
            with self.assertRaisesRegex((ValueError, OSError), message):
                tricoil.open(name)
        with self.assertRaisesRegex(ValueError, "direct"):
            tricoil.open("sim:hand", "dircet")


class Device(unittest.TestCase):
    def setUp(self):
        self.master, slave = pty.openpty()
        self.name = f"serial:{os.ttyname(slave)}"
        os.close(slave)
        self.addCleanup(os.close, self.master)

    def test_that_says_nothing(self):
        with tricoil.open(self.name) as source:
            self.assertIsNone(source.poll(0.1))
            self.assertNotEqual(source.status, "")
            with self.assertRaisesRegex(ValueError, "timeout_s"):
                source.poll(float("nan"))

    def test_that_is_missing(self):
        with tricoil.open("serial:/dev/no-such-line") as source:
            self.assertIsNone(source.poll(0.05))
            self.assertIn("/dev/no-such-line", source.status)

    def test_ctrl_c_ends_the_wait(self):
        timer = threading.Timer(0.3, lambda: os.kill(os.getpid(), signal.SIGINT))
        timer.start()
        with tricoil.open(self.name) as source, self.assertRaises(KeyboardInterrupt):
            next(source)
        timer.join()


if __name__ == "__main__":
    unittest.main()
