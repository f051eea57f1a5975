"""The examples of board/python/README.md run as they stand, each as a program of its own."""

import os
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

PAGE = pathlib.Path(__file__).parents[2] / "board/python/README.md"

TORNADO = "ignore:make_current is deprecated:DeprecationWarning"  # below Debian's Dask


class Readme(unittest.TestCase):
    def test_examples_run(self):
        examples = re.findall(r"^```python\n(.*?)^```", PAGE.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)
        self.assertEqual(len(examples), 3)
        for text in examples:
            text = text if "import tricoil" in text else "import tricoil\n" + text
            with tempfile.TemporaryDirectory() as folder:
                program = pathlib.Path(folder) / "example.py"
                program.write_text(text, encoding="utf-8")
                command = [sys.executable, "-W", "error", "-W", TORNADO, program]
                own = {**os.environ, "DASK_TEMPORARY_DIRECTORY": folder}  # Dask reports what a killed program left in a shared one
                done = subprocess.run(command, cwd=folder, env=own, capture_output=True, text=True, timeout=120)
                self.assertEqual((done.returncode, done.stderr), (0, ""), text)


if __name__ == "__main__":
    unittest.main()
