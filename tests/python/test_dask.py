"""Sweeps on a Dask cluster of two worker processes on this machine."""

import json
import os
import tempfile
import time
import unittest

import tricoil
from distributed import Client, LocalCluster

GRID = {"tracker": ["direct", "scaat"], "seed": range(4)}


def measure(tracker, seed):
    run = tricoil.run("hand", duration_s=0.7, tracker=tracker, seed=seed)
    return {"rms_mm": run.rms_mm(), "path_m": run.poses["position_m"], "covariance": run.poses["covariance"][-1]}


def process(n):
    time.sleep(0.05)
    return os.getpid()


def fails_for_two(n):
    if n == 2:
        raise RuntimeError("two")
    return n * n


def waits_in_reverse(n):
    time.sleep(0.1 * (3 - n))
    return n


class Dask(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = cls.enterClassContext(tempfile.TemporaryDirectory())
        cluster = LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None, local_directory=cls.folder)
        client = Client(cls.enterClassContext(cluster))
        cls.executor = cls.enterClassContext(client).get_executor()

    def test_table_equals_the_local_one_bit_for_bit(self):
        local, remote = tricoil.sweep(measure, GRID), tricoil.sweep(measure, GRID, self.executor)
        self.assertEqual(len(local[0]), 8)
        self.assertEqual(json.dumps(local), json.dumps(remote))  # numbers as text that is unique to each value

    def test_both_workers_compute(self):
        table, _ = tricoil.sweep(process, {"n": range(20)}, self.executor)
        processes = {row["result"] for row in table}
        self.assertEqual(len(processes), 2)
        self.assertNotIn(os.getpid(), processes)

    def test_failures_are_collected(self):
        table, failures = tricoil.sweep(fails_for_two, {"n": range(4)}, self.executor)
        self.assertEqual([row["result"] for row in table], [0, 1, 9])
        ((point, error),) = failures
        self.assertEqual(point, {"n": 2})
        self.assertIn("RuntimeError: two", error)

    def test_resumes(self):
        path = os.path.join(self.folder, "sweep.jsonl")
        self.assertEqual(len(tricoil.sweep(fails_for_two, {"n": [0, 1]}, resume=path)[0]), 2)
        table, failures = tricoil.sweep(fails_for_two, {"n": range(4)}, self.executor, resume=path)
        self.assertEqual(([row["result"] for row in table], len(failures)), ([0, 1, 9], 1))
        with open(path, encoding="utf-8") as file:
            self.assertEqual(sorted(json.loads(line)["point"]["n"] for line in file), [0, 1, 3], "only new points were computed")

    def test_order_is_that_of_the_grid(self):
        table, _ = tricoil.sweep(waits_in_reverse, {"n": range(4)}, self.executor)
        self.assertEqual([row["result"] for row in table], [0, 1, 2, 3])


if __name__ == "__main__":
    unittest.main()
