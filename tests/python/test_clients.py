"""The examples for ROS 2 and Lab Streaming Layer, with stand-ins for the modules of both (stand_ins/)."""

import json
import os
import pathlib
import subprocess
import sys
import time
import unittest

import numpy as np

import tricoil

EXAMPLES = pathlib.Path(__file__).parents[2] / "board/python/examples"
STAND_INS = pathlib.Path(__file__).parent / "stand_ins"
SOURCE = "sim:hand,duration_s=1"


def output_of(program, *arguments, **environment):
    """The ended program."""
    path = os.pathsep.join([str(STAND_INS), os.environ.get("PYTHONPATH", "")])
    done = subprocess.run([sys.executable, "-W", "error", EXAMPLES / program, *arguments], capture_output=True, text=True, timeout=120,
                          env={**os.environ, "PYTHONPATH": path, **environment}, check=False)
    assert done.returncode == 0, done.stderr
    return done


def lines_of(program, *arguments, **environment):
    """What the program prints, parsed."""
    return [json.loads(line) for line in output_of(program, *arguments, **environment).stdout.splitlines()]


def valid_poses(source=SOURCE):
    with tricoil.open(source, "scaat") as poses:
        return [pose for pose in poses if pose.valid]


def vector(fields, names):
    return np.array([fields[name] for name in names])


class Ros2(unittest.TestCase):
    def test_valid_poses_are_published(self):
        begin_s = time.time()
        lines = lines_of("ros2_node.py", STAND_IN_PARAMETERS=json.dumps({"source": SOURCE}))
        poses = valid_poses()
        lines = [line for line in lines if line["topic"] != "/diagnostics"]
        messages = [line["message"] for line in lines if line["topic"] == "sensor_1/pose"]
        transforms = [line["message"] for line in lines if line["topic"] == "/tf"]
        self.assertEqual(len(messages) + len(transforms), len(lines))
        self.assertEqual((len(messages), len(transforms)), (len(poses), len(poses)))
        for pose, message, transform in zip(poses, messages, transforms):
            self.assertEqual(message["header"], transform["header"])
            self.assertEqual((message["header"]["frame_id"], transform["child_frame_id"]), ("tricoil_source", "sensor_1"))
            for at, turn in ((message["pose"]["pose"]["position"], message["pose"]["pose"]["orientation"]),
                             (transform["transform"]["translation"], transform["transform"]["rotation"])):
                np.testing.assert_array_equal(vector(at, "xyz"), pose.position_m)
                np.testing.assert_array_equal(vector(turn, "wxyz"), pose.quaternion_wxyz)
            np.testing.assert_array_equal(message["pose"]["covariance"], pose.covariance.ravel())
        stamps_s = [message["header"]["stamp"]["sec"] + 1e-9 * message["header"]["stamp"]["nanosec"] for message in messages]
        self.assertTrue(all(begin_s - 2 < stamp < time.time() for stamp in stamps_s))  # the simulation is faster than real time

    def test_a_lost_sensor_is_logged(self):
        log = output_of("ros2_node.py", STAND_IN_PARAMETERS=json.dumps({"source": "sim:unplugged,duration_s=3"})).stderr
        self.assertIn("sensor 1: no valid pose: no_sensor", log)

    def test_diagnostics_have_the_flags_of_a_lost_sensor(self):
        """At once: more often than once per second."""
        lines = lines_of("ros2_node.py", STAND_IN_PARAMETERS=json.dumps({"source": "sim:unplugged,duration_s=3"}))
        states = [status for line in lines if line["topic"] == "/diagnostics" for status in line["message"]["status"]]
        self.assertEqual({status["name"] for status in states}, {"tricoil: source", "tricoil: sensor 1"})
        seen = [(status["level"], status["message"]) for status in states if status["name"] == "tricoil: sensor 1"]
        self.assertIn(([0], "tracking"), seen)
        lost = next(n for n, (level, message) in enumerate(seen) if level == [2] and "no_sensor" in message)
        self.assertIn(([0], "tracking"), seen[:lost])
        self.assertTrue(all(status["message"] for status in states))

    def test_diagnostics_name_a_device_that_is_not_there(self):
        with subprocess.Popen([sys.executable, EXAMPLES / "ros2_node.py"], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, env={
                **os.environ, "PYTHONPATH": os.pathsep.join([str(STAND_INS), os.environ.get("PYTHONPATH", "")]),
                "STAND_IN_PARAMETERS": json.dumps({"source": "serial:/dev/no-such-line", "tracker": "direct"})}) as node:
            source, = json.loads(node.stdout.readline())["message"]["status"]
            node.terminate()
        self.assertEqual((source["name"], source["level"]), ("tricoil: source", [2]))
        self.assertTrue(source["message"])

    def test_each_sensor_has_its_topic(self):
        lines = lines_of("ros2_node.py", STAND_IN_PARAMETERS=json.dumps({"source": SOURCE + ",stations=2", "frame_id": "lab"}))
        self.assertEqual({line["topic"] for line in lines}, {"sensor_1/pose", "sensor_2/pose", "/tf", "/diagnostics"})
        self.assertEqual({line["message"]["header"]["frame_id"] for line in lines if line["topic"] != "/diagnostics"}, {"lab"})


class LabStreamingLayer(unittest.TestCase):
    def test_samples_are_poses(self):
        info, *samples = lines_of("lsl_outlet.py", SOURCE)
        self.assertEqual((info["name"], info["type"], info["rate"]), ("tricoil", "MoCap", 240))
        (name, channels), = info["description"]
        self.assertEqual((name, len(channels)), ("channels", 8))
        self.assertEqual(channels[3], ["channel", [["label", "qw"], ["type", "OrientationA"], ["unit", "quaternion"]]])
        with tricoil.open(SOURCE, "scaat") as poses:
            expected = [[*pose.position_m, *pose.quaternion_wxyz, pose.valid] for pose in poses]
        np.testing.assert_array_equal([sample["sample"] for sample in samples], np.array(expected, dtype=float))
        self.assertTrue(all(sample["timestamp"] <= sample["now"] for sample in samples))


if __name__ == "__main__":
    unittest.main()
