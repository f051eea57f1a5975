"""Progress of long calls: drawn on a terminal only. Ctrl-C ends the calls."""

import os
import pty
import signal
import subprocess
import sys
import tempfile
import time
import unittest

import numpy as np
import tricoil

COUPLINGS = "x = tricoil.couplings(numpy.random.default_rng(1).uniform(0.2, 1, (200000, 3)))"
CALLS = {
    "run": "tricoil.run('hand', duration_s=1)",
    "solve": f"{COUPLINGS}; tricoil.solve(x, 1e-6)",
    "motion": "tricoil.motion('I', rate_hz=1e5, duration_s=1)",
    "sweep": "tricoil.sweep(abs, [], concurrent.futures.ThreadPoolExecutor(1)); tricoil.sweep(one, {'x': range(9)}, concurrent.futures.ThreadPoolExecutor(1))",
}
PROGRAM = """
import concurrent.futures, numpy, time, tricoil, tricoil._progress
tricoil._progress._QUIET_S = 0  # also for short calls
def one(x):
    time.sleep(0.02)
    tricoil.run('hand', duration_s=0.1)
"""


def run(call):
    """Text that a program writes to a terminal that is its standard error."""
    master, slave = pty.openpty()
    process = subprocess.Popen([sys.executable, "-c", PROGRAM + call], stderr=slave)
    os.close(slave)
    text = b""
    while True:
        try:
            part = os.read(master, 65536)
        except OSError:  # Linux: the other end is closed
            break
        text += part
    os.close(master)
    return process.wait(), text.decode()


class Progress(unittest.TestCase):
    def test_is_drawn_and_cleared_on_a_terminal(self):
        for name, call in CALLS.items():
            status, text = run(call)
            self.assertEqual(status, 0, text)
            self.assertRegex(text, r"\r\x1b\[K\[[#.]{16}\]", name)
            self.assertTrue(text.endswith("\r\x1b[K"), repr(text[-80:]))

    def test_sweep_draws_one_bar(self):
        _, text = run(CALLS["sweep"])
        self.assertRegex(text, r"\] sweep \d+%, \d+ s left")
        self.assertNotIn("mm", text, "the runs in the threads draw no view of their own")

    def test_is_silent_without_a_terminal_and_on_request(self):
        done = subprocess.run([sys.executable, "-c", PROGRAM + "\n".join(CALLS.values())], capture_output=True, text=True)
        self.assertEqual((done.returncode, done.stdout, done.stderr), (0, "", ""))
        self.assertEqual(run(CALLS["motion"].replace(")", ", progress=False)"))[1], "")

    def test_lost_terminal_does_not_end_the_call(self):
        call = "import os, sys; sys.stderr = os.fdopen(os.open('/dev/full', os.O_WRONLY), 'w', closefd=False); "
        status, _ = run(f"{call}rows = tricoil.motion('I', rate_hz=1e5, duration_s=0.5, progress=True); os._exit(len(rows) != 50001)")
        self.assertEqual(status, 0)


class CtrlC(unittest.TestCase):
    """A timer of wall time, with the handler of Ctrl-C, interrupts the call. The wall time of a call is never less than its processor
    time, so the signal comes before the end of the call on a slow machine too.
    """

    def setUp(self):
        self.addCleanup(signal.signal, signal.SIGALRM, signal.signal(signal.SIGALRM, signal.default_int_handler))

    def assert_ends(self, call):
        for _ in range(2):  # the first call also pays for memory
            began = time.process_time()
            call()
            whole_s = time.process_time() - began
        began = time.process_time()
        signal.setitimer(signal.ITIMER_REAL, whole_s / 8)
        with self.assertRaises(KeyboardInterrupt):
            call()
        self.assertLess(time.process_time() - began, 0.8 * whole_s)

    def test_ends_motion(self):
        self.assert_ends(lambda: tricoil.motion("I", rate_hz=1e5, duration_s=2))

    def test_ends_solve_and_couplings(self):
        positions = np.random.default_rng(1).uniform(0.2, 1, (1_000_000, 3))
        matrices = tricoil.couplings(positions)
        self.assert_ends(lambda: tricoil.solve(matrices, 1e-6))
        self.assert_ends(lambda: tricoil.couplings(np.tile(positions, (4, 1))))

    def test_ends_load(self):
        with tempfile.TemporaryDirectory() as folder:
            take = os.path.join(folder, "take")
            tricoil.run("hand", duration_s=60, fidelity="columns", record=take)
            self.assert_ends(lambda: tricoil.load(take))


if __name__ == "__main__":
    unittest.main()
