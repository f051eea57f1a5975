#!/usr/bin/env python3
"""toolchain/budgets: limits in both directions, with figures given instead of measured."""

import contextlib
import importlib.machinery
import importlib.util
import io
import pathlib
import sys
import tempfile
import unittest

TOOLCHAIN = pathlib.Path(__file__).resolve().parent.parent.parent / "toolchain"
sys.path.insert(0, str(TOOLCHAIN))
sys.dont_write_bytecode = True


def load_budgets():
    loader = importlib.machinery.SourceFileLoader("budgets", str(TOOLCHAIN / "budgets"))
    module = importlib.util.module_from_spec(importlib.util.spec_from_loader("budgets", loader))
    loader.exec_module(module)
    return module


class Budgets(unittest.TestCase):
    def setUp(self):
        self.budgets = load_budgets()
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.budgets.BASELINE = pathlib.Path(folder.name) / "baseline.toml"
        self.budgets.BASELINE.write_text('[qemu-an386]\n"instructions.direct" = 1000\n')

    def run_with(self, use, *options, budget=2000):
        """Exit status and output for one measured figure."""
        def measure(preset, baseline):
            table = self.budgets.Table(preset, baseline)
            table.row("instructions.direct", "direct", use, budget)
            return table.measured, [f"{label} is over its budget" for label in table.over], table.stale

        self.budgets.measure = measure
        sys.argv = ["budgets", "qemu-an386", *options]
        output, errors = io.StringIO(), io.StringIO()
        with contextlib.redirect_stdout(output), contextlib.redirect_stderr(errors):
            return self.budgets.main(), output.getvalue(), errors.getvalue()

    def test_near_the_baseline(self):
        for use in (800, 1000, 1500, 2000):
            self.assertEqual(self.run_with(use)[::2], (0, ""), use)

    def test_over_the_budget(self):
        self.assertEqual(self.run_with(2001)[::2], (1, "budgets: direct is over its budget\n"))

    def test_far_below_the_baseline(self):
        for budget in (2000, None):
            status, output, errors = self.run_with(799, budget=budget)
            self.assertEqual(status, 1)
            self.assertIn("BELOW", output)
            self.assertEqual(errors, "budgets: direct: 799 is more than 20 % below its baseline 1000; if this is intended, run "
                                     "toolchain/budgets qemu-an386 --accept\n")

    def test_accept(self):
        self.assertEqual(self.run_with(700, "--accept")[::2], (0, ""))
        self.assertEqual(self.run_with(700)[::2], (0, ""))
        self.assertEqual(self.run_with(2001, "--accept")[0], 1)
        self.assertIn('"instructions.direct" = 700', self.budgets.BASELINE.read_text())


if __name__ == "__main__":
    unittest.main()
