"""Sources of poses: simulation, devices, wrong names."""

import os
import pty
import signal
import subprocess
import threading
import time
import unittest

import numpy as np
import tricoil
from tricoil import Flag, _tricoil


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
        self.assertLess(time.monotonic() - begin, 5)

    def test_end_of_poll(self):
        with tricoil.open("sim:still,duration_s=0.01") as source:
            with self.assertRaises(EOFError):
                while True:
                    source.poll()

    def test_tip_and_boresight(self):
        with tricoil.open("sim:still,noise=no") as source:
            with self.assertRaisesRegex(ValueError, "the last polled pose of this sensor is not valid"):
                source.boresight()
            with self.assertRaisesRegex(ValueError, "sensor: must be 0 to 3; is 9"):
                source.boresight(9)
            with self.assertRaisesRegex(ValueError, "tip_m: has shape"):
                source.set_tip([1, 2])
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

    def test_flags_are_those_of_the_tracker(self):
        self.assertEqual([str(flag) for flag in Flag], _tricoil.FLAG_NAMES)
        self.assertEqual([flag.value for flag in Flag], [1 << n for n in range(len(Flag))])

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
            ("sim:hand,mux=cdm", "unknown mux 'cdm'"),
            ("sim:hand,rate_hz=-1", "sim: rate_hz"),
            ("recording:/nowhere", "/nowhere"),
            ("/nowhere/board.toml", "/nowhere/board.toml"),
        ):
            with self.assertRaisesRegex((ValueError, OSError), message):
                tricoil.open(name)
        with self.assertRaisesRegex(ValueError, "direct"):
            tricoil.open("sim:hand", "dircet")


class FrontEnd(unittest.TestCase):
    """A simulated front end that sends columns in real time."""

    def test_a_pause_of_the_program_does_not_delay_later_poses(self):
        program = os.environ["TRICOIL_FRONT_END"]
        front_end = subprocess.Popen(
            [program, "--link", "pty:", "--pace", "real", "--duration", "30", "--mux", "fdm"], stdout=subprocess.PIPE, text=True
        )
        self.addCleanup(front_end.stdout.close)
        self.addCleanup(front_end.wait)
        self.addCleanup(front_end.kill)
        line = next(word for text in front_end.stdout for word in text.split() if word.startswith("/dev/pts/"))
        with tricoil.open(f"serial:{line.rstrip(',;.')}") as source:
            lags = []
            for pose in source:
                lags.append(time.monotonic() - pose.time_s)
                if len(lags) == 250:
                    time.sleep(0.05)  # shorter than the buffer of the pseudo terminal and the watchdog of the coils: the front end does not wait
                if len(lags) == 500:
                    break
        least = min(lags[200:])
        self.assertGreater(lags[250] - least, 0.04, "the pause was seen")
        self.assertLess(min(lags[450:]) - least, 0.02)


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
