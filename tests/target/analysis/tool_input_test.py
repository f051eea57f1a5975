#!/usr/bin/env python3
"""Bad input to the tools: one line that names it, exit status 2, no traceback."""

import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent.parent


class Refusal(unittest.TestCase):
    def refused(self, *command, naming, environment=None):
        done = subprocess.run([str(part) for part in command], capture_output=True, text=True, env=environment)
        self.assertEqual(done.returncode, 2, f"{command}: {done.stdout}{done.stderr}")
        self.assertEqual(len(done.stderr.splitlines()), 1, done.stderr)
        self.assertIn(naming, done.stderr)
        self.assertEqual(done.stdout, "")


class BadArguments(Refusal):
    def test_unknown_presets(self):
        for preset in ("nonsense", "", "../x"):
            self.refused(ROOT / "toolchain/budgets", preset, naming=f"no preset {preset!r}")
            self.refused(ROOT / "toolchain/build", preset, naming=f"no preset '{preset}'")
        self.refused(ROOT / "toolchain/build", naming="no preset")

    def test_unknown_machines_and_missing_images(self):
        run_image = ROOT / "tests/target/run_image"
        self.refused(run_image, naming="unknown machine ''")
        self.refused(run_image, "mps2-an999", "x.elf", naming="unknown machine 'mps2-an999'")
        self.refused(run_image, "mps2-an386", naming="no image ''")
        self.refused(run_image, "mps2-an386", "nowhere.elf", naming="no image 'nowhere.elf'")

    def test_files_that_are_not_images(self):
        check_image = ROOT / "tests/target/check_image"
        self.refused(check_image, ROOT / "README.md", naming="README.md")
        self.refused(check_image, "nowhere.elf", naming="nowhere.elf: no such image")


class BadFiles(Refusal):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.root = pathlib.Path(self.folder.name)
        shutil.copytree(ROOT / "toolchain", self.root / "toolchain", ignore=shutil.ignore_patterns("uml", "__pycache__"))

    def refused_with(self, file, text, naming):
        path = self.root / "toolchain" / file
        before = path.read_text()
        path.write_text(text(before))
        self.refused(self.root / "toolchain/budgets", "qemu-an386", naming=naming)
        path.write_text(before)

    def test_budgets(self):
        self.refused_with("budgets.toml", lambda text: text.replace("[", "", 1), "budgets.toml")
        self.refused_with("budgets.toml", lambda text: text.replace("flash = 98304\n", ""), "[size.tracker]")
        self.refused_with("budgets.toml", lambda text: text.replace("direct = 2000 ", 'direct = "2000" '), "[instructions.qemu-an386]")
        self.refused_with("budgets.toml", lambda text: text.replace("[instructions.qemu-an386]", "[instructions.other]"), "qemu-an386")
        self.refused_with("budgets.toml", lambda text: text.replace("[stack]", "[stuck]"), "stack")
        (self.root / "toolchain/budgets.toml").unlink()
        self.refused(self.root / "toolchain/budgets", "qemu-an386", naming="budgets.toml")

    def test_baseline(self):
        self.refused_with("baseline.toml", lambda text: text + "]", "baseline.toml")
        self.refused_with("baseline.toml", lambda text: text.replace("= 1", '= "1"', 1), "baseline.toml")

    def test_no_image_and_no_compiler(self):
        self.refused(self.root / "toolchain/budgets", "qemu-an386", naming="kernels.elf: no such image")
        image = self.root / "build/qemu-an386/tests/target/kernels.elf"
        image.parent.mkdir(parents=True)
        image.touch()
        nowhere = {**os.environ, "PATH": "/nowhere"}
        self.refused(sys.executable, self.root / "toolchain/budgets", "qemu-an386", naming="arm-none-eabi-nm: not installed", environment=nowhere)


if __name__ == "__main__":
    unittest.main()
