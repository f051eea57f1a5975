"""Figures without Python's drawing library, and the folder that holds them."""

import os
import tempfile
import unittest
from unittest import mock

import tricoil
from tricoil import _drawing, _figures
from tricoil._staged_folder import StagedFolder


class Figures(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.out = os.path.join(self.folder.name, "out")

    def refuse(self, program, message):
        """program: what draws."""
        fake = os.path.join(self.folder.name, "_draw.py")
        with open(fake, "w", encoding="utf-8") as file:
            file.write(program)
        with (mock.patch.object(_drawing, "__file__", fake), mock.patch.object(_figures, "write_budget"),
              mock.patch.object(_figures, "write_metal"), self.assertRaises(ValueError) as raised):
            tricoil.command("figures", out=self.out)
        self.assertEqual(str(raised.exception), f"{message}; the CSV files are in {self.out}")
        names = os.listdir(self.out)
        self.assertIn("fig1.csv", names)
        self.assertTrue(all(name.endswith(".csv") for name in names), names)

    def test_tables_are_kept_if_nothing_can_draw(self):
        missing = "python3 cannot draw (No module named 'matplotlib'): install the package python3-matplotlib"
        self.refuse(f"import sys\nprint({missing!r}, file=sys.stderr)\nsys.exit(3)\n", missing)
        self.refuse("open('fig1.svg', 'w').write('half')\nundefined\n", "python3 cannot draw: NameError: name 'undefined' is not defined")

    def test_bad_arguments_are_named(self):
        with self.assertRaisesRegex(ValueError, "figures takes no files, and out"):
            tricoil.command("figures")
        with self.assertRaisesRegex(ValueError, "no .traj files in"):
            tricoil.command("figures", out=self.out, hand_motion=self.folder.name)
        self.assertFalse(os.path.exists(self.out))

    def test_other_files_are_kept(self):
        mine = os.path.join(self.folder.name, "mine.txt")
        open(mine, "w", encoding="utf-8").close()
        for publish, expected in ((False, ["mine.txt"]), (True, ["a.csv", "mine.txt"])):
            with StagedFolder(self.folder.name) as staged:
                open(os.path.join(staged.path, "a.csv"), "w", encoding="utf-8").close()
                if publish:
                    staged.publish()
            self.assertEqual(sorted(os.listdir(self.folder.name)), expected)

    def test_a_read_only_file_is_not_replaced(self):
        with StagedFolder(self.folder.name) as staged:
            for name in ("a", "b"):
                with open(os.path.join(staged.path, name), "w", encoding="utf-8") as file:
                    file.write("new")
            mine = os.path.join(self.folder.name, "b")
            with open(mine, "w", encoding="utf-8") as file:
                file.write("mine")
            os.chmod(mine, 0o444)
            with self.assertRaisesRegex(ValueError, "b: it is write-protected"):
                staged.publish()
        self.assertEqual(sorted(os.listdir(self.folder.name)), ["b"])


if __name__ == "__main__":
    unittest.main()
