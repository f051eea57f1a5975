"""Simulated runs and recordings."""

import os
import signal
import subprocess
import sys
import tempfile
import threading
import time
import unittest

import numpy as np
import tricoil


class Run(unittest.TestCase):
    def test_gives_poses_truth_and_summary(self):
        run = tricoil.run("hand", duration_s=2, tracker="scaat")
        self.assertEqual(len(run.poses), len(run.truth))
        self.assertGreater(len(run.poses), 450)
        self.assertEqual(run.summary["scenario"], "hand")
        scored = run.poses["valid"] & (run.poses["time_s"] >= 0.5)
        self.assertTrue(scored.any())
        self.assertAlmostEqual(run.rms_mm(), 1e3 * run.summary["position_rms_m"], delta=1e-6)
        errors = run.position_errors_m()[scored]
        sigma = np.sqrt(np.trace(run.poses["covariance"][scored][:, :3, :3], axis1=1, axis2=2))
        self.assertLess(np.mean(errors > 5 * sigma), 0.01)
        self.assertLess(run.orientation_errors_rad()[scored].max(), 0.1)

    def test_equal_seeds_give_equal_poses(self):
        a, b, c = (tricoil.run("circle", duration_s=0.5, seed=seed).poses for seed in (3, 3, 4))
        np.testing.assert_array_equal(a["position_m"], b["position_m"])
        self.assertTrue((a["position_m"] != c["position_m"]).any())

    def test_columns_have_the_errors_of_samples(self):
        samples, columns = (tricoil.run("hand", duration_s=10, fidelity=fidelity) for fidelity in ("samples", "columns"))
        self.assertEqual(len(columns.poses), len(samples.poses))
        self.assertAlmostEqual(columns.rms_mm() / samples.rms_mm(), 1, delta=0.1)

    def test_couplings_of_a_pose_solve_to_it(self):
        poses = tricoil.run("circle", duration_s=0.5, noise=False).poses
        poses = poses[poses["valid"]]
        rows = tricoil.solve(poses["couplings"], 1e-6, hemisphere=poses["position_m"][0])
        np.testing.assert_allclose(rows["position_m"], poses["position_m"], atol=1e-9)

    def test_recording_holds_the_same_poses(self):
        with tempfile.TemporaryDirectory() as folder:
            place = os.path.join(folder, "take")
            run = tricoil.run("hand", duration_s=0.5, record=place)
            loaded = tricoil.load(place)
            np.testing.assert_array_equal(loaded["position_m"], run.poses["position_m"])
            with tricoil.open(f"recording:{place}") as source:
                replayed = [pose.position_m for pose in source]
            np.testing.assert_array_equal(replayed, run.poses["position_m"])

    def test_bad_input_names_the_argument(self):
        for arguments, message in (
            ({"scenario": "hnd"}, "hand"),
            ({"mux": "fdn"}, "unknown mux 'fdn'; did you mean 'fdm'"),
            ({"tracker": "skaat"}, "scaat"),
            ({"fidelity": "colums"}, "unknown fidelity 'colums'; did you mean 'columns'"),
            ({"rate_hz": -1}, "^rate_hz"),
            ({"duration_s": float("inf")}, "^duration_s"),
            ({"predict_s": 0.01}, "^predict_s: tracker direct estimates no velocity; use tracker scaat"),
            ({"faults": "metal:sphere,material=unobtainium,radius_m=0.1,position_m=1/0/0"}, "unobtainium"),
        ):
            with self.assertRaisesRegex(ValueError, message):
                tricoil.run(**arguments)
        for arguments, message in (({"seed": -1}, "^seed: must be"), ({"hemisphere": [1, 2]}, "^hemisphere: has shape")):
            with self.assertRaisesRegex(ValueError, message):
                tricoil.run(**arguments)

    def test_ctrl_c_ends_a_run(self):
        for _ in range(2):  # the first leaves Python's handlers as they were
            timer = threading.Timer(0.5, lambda: os.kill(os.getpid(), signal.SIGINT))
            timer.start()
            with self.assertRaises(KeyboardInterrupt):
                tricoil.run("still", duration_s=1e6)
            timer.join()

    def test_runs_in_threads_leave_signals_alone(self):
        threads = [threading.Thread(target=tricoil.run, kwargs={"duration_s": d}) for d in (2, 4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        with self.assertRaises(KeyboardInterrupt):
            os.kill(os.getpid(), signal.SIGINT)
            time.sleep(5)

    def test_own_signal_handler_is_called(self):
        called = []
        before = signal.signal(signal.SIGUSR1, lambda *_: called.append(True))
        self.addCleanup(signal.signal, signal.SIGUSR1, before)
        timer = threading.Timer(0.1, lambda: os.kill(os.getpid(), signal.SIGUSR1))
        timer.start()
        tricoil.run("still", duration_s=30)
        timer.join()
        self.assertEqual(called, [True])

    def test_lost_recording_is_an_error(self):
        program = "import resource, signal, sys, tricoil; signal.signal(signal.SIGXFSZ, signal.SIG_IGN); " + (
            "resource.setrlimit(resource.RLIMIT_FSIZE, (300000, 300000)); tricoil.run('hand', duration_s=5, record=sys.argv[1])"
        )
        with tempfile.TemporaryDirectory() as folder:
            done = subprocess.run([sys.executable, "-c", program, os.path.join(folder, "take")], capture_output=True, text=True)
        self.assertEqual(done.returncode, 1)
        self.assertIn("OSError", done.stderr)
        self.assertIn("recording ended early", done.stderr)


if __name__ == "__main__":
    unittest.main()
