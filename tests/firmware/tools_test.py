#!/usr/bin/env python3
"""image-info and flash with a valid image, with invalid files, and without tools or board: one line and the documented exit status."""

import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

TOOLCHAIN = pathlib.Path(__file__).resolve().parents[2] / "toolchain"
BOARD = slice(0x220, 0x230)  # where an image names its board (board/stm32g4/image_header.hpp)
IMAGE = pathlib.Path(sys.argv.pop(1))


def run(tool, *arguments, path=os.environ["PATH"]):
    return subprocess.run([TOOLCHAIN / tool, *map(str, arguments)], capture_output=True, text=True, env={**os.environ, "PATH": path})


class Tools(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))

    def file(self, data):
        path = self.folder / "image.bin"
        path.write_bytes(data)
        return path

    def refused(self, done, status, *words):
        self.assertEqual(done.returncode, status, done)
        self.assertEqual(len(done.stderr.splitlines()), 1, done.stderr)
        for word in words:
            self.assertIn(word, done.stderr)

    def tools(self, **scripts):
        """Returns a PATH with the programs that the scripts need; `scripts` replace the real tools."""
        for name in ("bash", "env", "python3", "grep", "tail", "mktemp", "rm", "dirname"):
            (self.folder / name).symlink_to(f"/usr/bin/{name}")
        for name, text in scripts.items():
            tool = self.folder / name.replace("_", "-")
            tool.write_text(f"#!/bin/bash\n{text}\n")
            tool.chmod(0o755)
        return str(self.folder)

    def test_image_info_prints_the_header(self):
        done = run("image-info", IMAGE)
        self.assertEqual(done.returncode, 0, done.stderr)
        said = dict(line.split() for line in done.stdout.splitlines())
        self.assertEqual(said["board"], "nucleo-g474re")
        self.assertEqual(int(said["bytes"]), IMAGE.stat().st_size)
        self.assertEqual(len(said["sha256"]), 64)
        self.assertRegex(said["commit"], r"^([0-9a-f]{10}\+?|unknown)$")

    def test_invalid_images_are_refused(self):
        self.refused(run("image-info", self.folder / "none"), 2, "none", "build it")
        self.refused(run("image-info", self.file(b"short")), 2, "5 bytes")
        self.refused(run("image-info", self.file(bytes(10000))), 2, "no image header")
        self.refused(run("image-info", self.file(IMAGE.read_bytes()[:-1])), 2, "the file is damaged")

    def test_flash_refuses_bad_usage(self):
        self.refused(run("flash", "radio", IMAGE), 2, "'radio'")
        self.refused(run("flash", "dfu", self.folder / "none"), 2, "no image")
        self.refused(run("flash", "dfu", self.file(bytes(10000))), 2, "no image header")

    def test_flash_refuses_the_image_of_another_board(self):
        path = self.tools(dfu_util='echo "$*" >"$0.said"', st_flash='echo "$*" >"$0.said"')
        for board in (b"nucleo-g431kb", b"nucleo-g474re 2", b""):
            image = bytearray(IMAGE.read_bytes())
            image[BOARD] = board.ljust(16, b"\0")
            for way in ("dfu", "stlink"):
                done = run("flash", way, self.file(image), path=path)
                self.refused(done, 2, f"'{board.decode()}'", "nucleo-g474re;", "toolchain/build")
        self.assertEqual(list(self.folder.glob("*.said")), [])

    def test_flash_names_the_missing_tool(self):
        path = self.tools()
        self.refused(run("flash", "dfu", IMAGE, path=path), 2, "no dfu-util", "install-deps flash")
        self.refused(run("flash", "stlink", IMAGE, path=path), 2, "neither openocd nor st-flash")

    def test_flash_reports_a_missing_board(self):
        path = self.tools(dfu_util="echo 'No DFU capable USB device available'; exit 74", openocd="echo 'Error: open failed'; exit 1")
        self.refused(run("flash", "dfu", IMAGE, path=path), 3, "no board in its loader")
        self.refused(run("flash", "stlink", IMAGE, path=path), 3, "no ST-LINK")

    def test_flash_writes_to_the_start_of_the_program(self):
        path = self.tools(dfu_util='echo "$*" >"$0.said"; echo "File downloaded successfully"; exit 251', st_flash='echo "$*" >"$0.said"')
        for way, tool in (("dfu", "dfu-util"), ("stlink", "st-flash")):
            done = run("flash", way, IMAGE, path=path)
            self.assertEqual(done.returncode, 0, done)
            said = (self.folder / f"{tool}.said").read_text()
            self.assertIn("0x08000000", said)
            self.assertIn(str(IMAGE), said)

    def test_flash_prints_the_error_of_the_tool(self):
        path = self.tools(openocd="echo 'Error: target voltage may be too low'; exit 1")
        self.refused(run("flash", "stlink", IMAGE, path=path), 3, "target voltage")


if __name__ == "__main__":
    unittest.main()
