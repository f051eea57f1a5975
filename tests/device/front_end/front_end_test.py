#!/usr/bin/env python3
"""The examples of front ends as devices of the program: poses, faults, watchdog and damaged commands.

  front_end_test.py TRICOIL LINUX_BOARD [QEMU IMAGE]
"""

import contextlib
import csv
import importlib.util
import math
import os
import pathlib
import random
import re
import socket
import statistics
import struct
import subprocess
import sys
import tempfile
import time
import unittest

EXAMPLE = pathlib.Path(__file__).resolve().parents[3] / "board/python/examples/front_end.py"
PROGRAM, LINUX_BOARD, *IMAGE = sys.argv[1:5]
HERE = importlib.util.spec_from_file_location("front_end", EXAMPLE)
example = importlib.util.module_from_spec(HERE)
HERE.loader.exec_module(example)


@contextlib.contextmanager
def device(*words):
    """A running front end, and the pseudo terminal whose name it prints first."""
    with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.STDOUT if "-serial" in words else None, text=True) as running:
        try:
            yield running, re.search(r"/dev/pts/\d+|$", running.stdout.readline())[0] if "udp" not in words[-1] and "tcp" not in words[-1] else ""
        finally:
            running.terminate()


def front_end(*words):
    return device(sys.executable, "-W", "error", str(EXAMPLE), *words)


def free_port(kind):
    with socket.socket(type=kind) as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


class Tracked(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.poses = os.path.join(folder.name, "poses.csv")

    def words(self, name, duration_s):
        return [PROGRAM, "run", "--device", name, "--duration", str(duration_s), "--hemisphere", "1,0,0", "--confined", "--tracker", "scaat", "--out", self.poses]

    def expect_circle(self, least):
        """Valid poses on the example's circle: x = 0.4 m, 0.1 m about it, no rotation."""
        with open(self.poses, encoding="utf-8") as file:
            rows = [row for row in csv.DictReader(file) if row["valid"] == "1"]
        self.assertGreater(len(rows), least)
        position = [[float(row[name]) for name in ("x_m", "y_m", "z_m")] for row in rows]
        self.assertLess(statistics.median(math.hypot(x - 0.4, math.hypot(y, z) - 0.1) for x, y, z in position), 1e-4)
        self.assertGreater(max(y for _, y, _ in position) - min(y for _, y, _ in position), 0.05)  # it moves
        self.assertGreater(statistics.median(float(row["qw"]) for row in rows), 0.999999)

    def expect_tracked(self, running):
        with running as (_, line):
            done = subprocess.run(self.words(f"serial:{line}", 3), capture_output=True, text=True, timeout=60, check=False)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertLessEqual(int(re.search(r"(\d+) messages refused", done.stdout)[1]), 1)  # one that was cut when the line was opened
        self.expect_circle(200)

    def test_python_on_a_line(self):
        self.expect_tracked(front_end("serial:pty"))

    def test_cpp_on_linux(self):
        self.expect_tracked(device(LINUX_BOARD))

    def test_a_stuck_converter_is_reported_and_ends(self):
        with front_end("serial:pty", "--fault") as (_, line):
            done = subprocess.run(self.words(f"serial:{line}", 5), capture_output=True, text=True, timeout=60, check=False)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("the device reports: samples were lost, or a converter is stuck", done.stderr)
        with open(self.poses, encoding="utf-8") as file:
            valid = [row["valid"] for row in csv.DictReader(file)]
        self.assertIn("0", valid[300:])
        self.assertEqual(valid[-1], "1")

    def test_over_tcp(self):
        port = free_port(socket.SOCK_STREAM)
        with subprocess.Popen(self.words(f"columns:tcp:{port}", 3), stdout=subprocess.DEVNULL) as tracker:
            while tracker.poll() is None:  # at first it does not listen
                with front_end(f"tcp:localhost:{port}") as (running, _):
                    running.wait()
                time.sleep(0.1)
        self.assertEqual(tracker.returncode, 0)
        self.expect_circle(200)

    def test_over_udp(self):
        port = free_port(socket.SOCK_DGRAM)
        with front_end(f"udp:localhost:{port}"):
            done = subprocess.run(self.words(f"columns:udp:{port}", 3), stdout=subprocess.DEVNULL, timeout=60, check=False)
        self.assertEqual(done.returncode, 0)
        self.expect_circle(200)


class Commands:
    """Of a host that is not the program."""

    def setUp(self):
        running = self.front_end()
        _, path = running.__enter__()
        self.addCleanup(running.__exit__, None, None, None)
        self.line = example.open_line(path)
        self.addCleanup(os.close, self.line)
        self.received, self.is_first = b"", True

    def command(self, opcode, argument=0, request=7):
        os.write(self.line, example.framed(struct.pack("<BBIqBBHI", 3, 1, 0, 0, opcode, 0, request, argument)))

    def answer(self, kind, accept=lambda fields: True, patience_s=60):
        """Fields of the next message of this type that is accepted; None: none."""
        end = time.monotonic() + patience_s
        while time.monotonic() < end:
            frame, zero, rest = self.received.partition(b"\0")
            if not zero:
                with contextlib.suppress(BlockingIOError):
                    self.received += os.read(self.line, 4096)
                time.sleep(0.005)
                continue
            self.received = rest
            message = example.unframed(frame)
            if message is None:
                self.assertTrue(self.is_first)  # cut when the line was opened
            elif message[1] == kind and accept(fields := struct.unpack(example.LAYOUT[kind], message[14:])):
                return fields
            self.is_first = False
        return None

    def first_column(self, coil):
        """A slow processor may miss the time of its watchdog before its first column: start again."""
        for _ in range(60):
            self.command(example.START)
            column = self.answer(example.COLUMN, lambda fields: fields[1] == coil, patience_s=1)
            if column is not None:
                return column
        return self.fail("no column")

    def test_identity(self):
        self.command(example.HELLO, 3 | 3 << 8)
        role, oldest, newest, *_ = self.answer(example.IDENTIFY)
        self.assertEqual((role, oldest, newest), (1, 3, 3))

    def test_answers(self):
        for opcode, argument, result in ((example.START, 1, example.REFUSED), (10, 0, example.UNKNOWN), (example.STOP, 0, example.DONE)):
            self.command(opcode, argument)
            self.assertEqual(self.answer(example.ACK)[:3], (opcode, result, 7))

    def test_a_silent_host_stops_the_measurement(self):
        self.first_column(1)
        state, coil, faults, *_ = self.answer(example.STATUS, lambda fields: fields[2])
        self.assertEqual((state, coil, faults), (0, 0, example.HOST_SILENT))

    def test_columns(self):
        """Of the circle: the coupling of the first coils is constant."""
        sensor, coil, flags, sequence, first, *_ = self.first_column(1)
        r_squared = 0.4**2 + 0.1**2
        self.assertAlmostEqual(first, 6.75e-3 / r_squared**1.5 * (1.5 * 0.4**2 / r_squared - 0.5), delta=1e-5)
        self.assertEqual((sensor, coil, flags), (0, 1, 0))
        self.assertGreater(sequence, 0)

    def test_damaged_commands_are_unreadable(self):
        os.write(self.line, b"\x05\x01\0\xff\xff\0" + random.Random(1).randbytes(300) + b"\0")
        self.assertEqual(self.answer(example.ACK)[:2], (0, example.UNREADABLE))
        self.command(example.STOP)
        self.assertIsNotNone(self.answer(example.ACK, lambda fields: fields[:2] == (example.STOP, example.DONE)))


class PythonCommands(Commands, unittest.TestCase):
    def front_end(self):
        return front_end("serial:pty")


class CppCommands(Commands, unittest.TestCase):
    def front_end(self):
        return device(LINUX_BOARD)

    def test_a_full_line_takes_whole_messages(self):
        """Of a host that does not read for a while."""
        self.command(example.HELLO, 3 | 3 << 8)
        self.answer(example.IDENTIFY)
        for request in range(2000):
            with contextlib.suppress(BlockingIOError):
                self.command(example.HELLO, 3 | 3 << 8, request)
            if request % 50 == 0:
                time.sleep(0.01)
        text = self.received
        for _ in range(100):
            with contextlib.suppress(BlockingIOError):
                text += os.read(self.line, 65536)
            time.sleep(0.01)
        frames = text.split(b"\0")[:-1]
        self.assertGreater(len(frames), 50)
        self.assertEqual([frame for frame in frames if example.unframed(frame) is None], [])


@unittest.skipUnless(len(IMAGE) == 2, "no compiler for the Cortex-M, or no emulator")
class CortexMCommands(Commands, unittest.TestCase):
    """Without the program: on a busy machine the emulated processor does not keep up with a host in real time."""

    def front_end(self):
        qemu, image = IMAGE
        return device(qemu, "-machine", "mps2-an386", "-display", "none", "-monitor", "none", "-serial", "pty", "-kernel", image)


class Words(unittest.TestCase):
    def test_wrong_links(self):
        for words in ([], ["can:can0"], ["serial:/dev/null"], ["serial:/nowhere"], ["tcp:localhost:x"], ["tcp:localhost:1"]):
            done = subprocess.run([sys.executable, EXAMPLE, *words], capture_output=True, text=True, timeout=20, check=False)
            self.assertEqual((done.returncode, done.stderr.count("\n")), (1, 1), words)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=2)
