#!/usr/bin/env python3
"""Tests `compare`: it must report a changed bit, a NaN, missing and extra lines.
  comparison_test.py PROGRAM [ARGUMENT...]
"""

import pathlib
import subprocess
import sys
import unittest

COMPARE = pathlib.Path(__file__).resolve().parent / "compare"
RESULTS = []


def compare(lines, arithmetics="double,float,fixed"):
    command = [COMPARE, arithmetics, "printf", "%s\n", "\n".join(lines)]
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True)
    return done.returncode, done.stdout + done.stderr


def with_line(solver, part, change):
    """The results with the first line of that kind changed by `change`; if `change` returns None, the line is removed."""
    lines = list(RESULTS)
    n = next(n for n, line in enumerate(lines) if line.split()[2:4] == [solver, part])
    changed = change(lines[n].split())
    lines[n : n + 1] = [] if changed is None else [" ".join(changed)]
    return lines


class Comparison(unittest.TestCase):
    def refused(self, lines, saying):
        status, text = compare(lines)
        self.assertEqual(status, 1, text)
        self.assertIn(saying, text)
        self.assertNotIn("Traceback", text)

    def test_what_is_right_passes(self):
        self.assertEqual(compare(RESULTS)[0], 0)
        self.assertEqual(compare([line for line in RESULTS if "-double" not in line], "float,fixed")[0], 0)

    def test_a_changed_bit(self):
        self.refused(with_line("direct-fixed", "column1", lambda f: [*f[:4], str(int(f[4]) ^ 1), *f[5:]]), "not the same bits")

    def test_a_changed_float(self):
        self.refused(with_line("direct-float", "column1", lambda f: [*f[:4], "0x3f000000", *f[5:]]), "units of the last place off")

    def test_no_number(self):
        self.refused(with_line("direct-float", "column1", lambda f: [*f[:5], "0x7fc00000", *f[6:]]), "finite")
        self.refused(with_line("direct-double", "column2", lambda f: [*f[:5], "0x7ff80000:0x00000000", *f[6:]]), "finite")
        self.refused(with_line("direct-float", "place", lambda f: [*f[:4], "nonsense"]), "not a result")

    def test_missing_lines(self):
        for arithmetic in ("float", "double", "fixed"):
            self.refused(with_line(f"direct-{arithmetic}", "column3", lambda f: None), "missing")
            self.refused([line for line in RESULTS if f"-{arithmetic}" not in line], "missing")
        self.refused([], "missing")

    def test_lines_too_many(self):
        self.refused([*RESULTS, "golden 99 direct-float place 0x0"], "not expected")
        self.refused([*RESULTS, "golden 0 other place 0x0"], "not expected")

    def test_no_program(self):
        done = subprocess.run([COMPARE, "fixed", "./nowhere"], capture_output=True, text=True)
        self.assertEqual((done.returncode, len(done.stderr.splitlines())), (2, 1), done.stderr)


if __name__ == "__main__":
    RESULTS = [line for line in subprocess.run(sys.argv[1:], check=True, capture_output=True, text=True).stdout.splitlines() if line]
    unittest.main(argv=sys.argv[:1])
