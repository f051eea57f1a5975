"""Many runs."""

import concurrent.futures
import json
import os
import pathlib
import tempfile
import unittest

import numpy as np
import tricoil


def measure(tracker, seed):
    run = tricoil.run("hand", duration_s=0.7, tracker=tracker, seed=seed)
    return {"rms_mm": run.rms_mm(), "valid": int(run.poses["valid"].sum())}


def fails_for_two(n):
    if n == 2:
        raise RuntimeError("two")
    return n * n


def dies_for_two(n):
    if n == 2:
        os._exit(1)
    return n


def gives_arrays(n, place):
    return {"squares": np.arange(2) * n**2, "place": place.name}


GRID = {"tracker": ["direct", "scaat"], "seed": [1, 2]}


class Sweep(unittest.TestCase):
    def test_table_is_in_the_order_of_the_grid_and_does_not_depend_on_the_executor(self):
        table, failures = tricoil.sweep(measure, GRID)
        self.assertEqual(failures, [])
        self.assertEqual([(row["tracker"], row["seed"]) for row in table], [("direct", 1), ("direct", 2), ("scaat", 1), ("scaat", 2)])
        with concurrent.futures.ThreadPoolExecutor(2) as executor:
            self.assertEqual(tricoil.sweep(measure, GRID, executor), (table, []))
        self.assertEqual(table[0], {"tracker": "direct", "seed": 1, **measure("direct", 1)})

    def test_collects_failures(self):
        table, failures = tricoil.sweep(fails_for_two, [{"n": n} for n in range(4)])
        self.assertEqual([row["result"] for row in table], [0, 1, 9])
        (point, error), = failures
        self.assertEqual(point, {"n": 2})
        self.assertIn("RuntimeError: two", error)

    def test_a_process_that_dies_is_a_failure(self):
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "sweep.jsonl")
            table, failures = tricoil.sweep(dies_for_two, {"n": range(200)}, resume=path)
            self.assertEqual(len(table) + len(failures), 200)
            self.assertIn({"n": 2}, [point for point, _ in failures])
            self.assertIn("BrokenProcessPool", failures[0][1])
            again, failures = tricoil.sweep(dies_for_two, [{"n": n} for n in range(200) if n != 2], resume=path)
            self.assertEqual((len(again), failures), (199, []))

    def test_bad_input(self):
        for function, grid, error, message in (
            (3, {"n": [1]}, TypeError, "function: 3 cannot be called"),
            (lambda n: n, {"n": [1]}, ValueError, "function: .*lambda.* cannot be sent to another process"),
            (fails_for_two, {"n": 3}, TypeError, "grid: the values of n are 3"),
            (fails_for_two, {"n": "direct"}, TypeError, "grid: the values of n are 'direct'"),
        ):
            with self.assertRaisesRegex(error, message):
                tricoil.sweep(function, grid)
        with concurrent.futures.ThreadPoolExecutor(1) as executor:
            self.assertEqual(tricoil.sweep(lambda n: n, {"n": [1]}, executor), ([{"n": 1, "result": 1}], []))

    def test_resumes(self):
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "sweep.jsonl")
            tricoil.sweep(fails_for_two, {"n": [1, 2]}, resume=path)
            with open(path, "a", encoding="utf-8") as file:
                file.write('{"function": "fails_for_two", "point": {"n": 3}, "resu')  # killed while writing
            with open(path, encoding="utf-8") as file:
                text = file.read().replace('"result": 1}', '"result": 100}')
            with open(path, "w", encoding="utf-8") as file:
                file.write(text)
            table, failures = tricoil.sweep(fails_for_two, {"n": [1, 2, 3]}, resume=path)
            self.assertEqual([row["result"] for row in table], [100, 9])
            self.assertEqual(len(failures), 1)
            with open(path, encoding="utf-8") as file:
                self.assertEqual([json.loads(line)["point"]["n"] for line in file], [1, 3])

    def test_resumes_points_and_results_of_any_kind(self):
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "sweep.jsonl")
            grid = {"n": np.arange(1, 3), "place": [pathlib.Path("/a")]}
            first = tricoil.sweep(gives_arrays, grid, resume=path)
            size = os.path.getsize(path)
            self.assertEqual(tricoil.sweep(gives_arrays, grid, resume=path), first)
            self.assertEqual(os.path.getsize(path), size, "nothing was computed again")
            self.assertEqual([row["squares"] for row in first[0]], [[0, 1], [0, 4]])
            with self.assertRaisesRegex(ValueError, "of the function gives_arrays, not fails_for_two"):
                tricoil.sweep(fails_for_two, {"n": [1]}, resume=path)

    def test_refuses_a_file_that_is_no_sweep(self):
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "notes.txt")
            for text, message in (("hello\n", "notes.txt:1: not a line of a sweep"), ("hello", "notes.txt: not the file of a sweep")):
                with open(path, "w", encoding="utf-8") as file:
                    file.write(text)
                with self.assertRaisesRegex(ValueError, message):
                    tricoil.sweep(fails_for_two, {"n": [1]}, resume=path)
                with open(path, encoding="utf-8") as file:
                    self.assertEqual(file.read(), text)


if __name__ == "__main__":
    unittest.main()
