#!/usr/bin/env python3
"""image-info and flash with a valid image, with invalid files, and without tools or board: one line and the documented exit status."""

import os
import pathlib
import subprocess
import sys
import tempfile
import unittest
import zlib

TOOLCHAIN = pathlib.Path(__file__).resolve().parents[2] / "toolchain"
PROGRAM = 0x2000  # the CRC begins here
BOARD = slice(0x2220, 0x2230)  # where an image names its board (board/stm32g4/image_header.hpp)
CRC = slice(0x2230, 0x2234)
IMAGE = pathlib.Path(sys.argv.pop(1))


def sealed(image):
    """The image with the CRC of its content."""
    image = bytearray(image)
    image[CRC] = bytes(4)
    image[CRC] = zlib.crc32(image[PROGRAM:]).to_bytes(4, "little")
    return bytes(image)


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
        self.assertEqual(sealed(IMAGE.read_bytes()), IMAGE.read_bytes())
        self.assertEqual(int(said["crc"], 16).to_bytes(4, "little"), IMAGE.read_bytes()[CRC])
        self.assertRegex(said["commit"], r"^([0-9a-f]{10}\+?|unknown)$")

    def test_invalid_images_are_refused(self):
        self.refused(run("image-info", self.folder / "none"), 2, "none", "build it")
        self.refused(run("image-info", self.file(b"short")), 2, "5 bytes")
        self.refused(run("image-info", self.file(bytes(10000))), 2, "no image header")
        self.refused(run("image-info", self.file(IMAGE.read_bytes()[:-1])), 2, "the file is damaged")

        for at in (0x3000, IMAGE.stat().st_size - 1, 0x2210, CRC.start):
            damaged = bytearray(IMAGE.read_bytes())
            damaged[at] ^= 4
            self.refused(run("image-info", self.file(damaged)), 2, "CRC", "the file is damaged")
        old = bytearray(IMAGE.read_bytes())
        old[0x2204] = 1
        self.refused(run("image-info", self.file(sealed(old))), 2, "version 1")
        large = bytearray(IMAGE.read_bytes()) + bytes(512 * 1024)
        large[0x220C:0x2210] = (0x08000000 + len(large)).to_bytes(4, "little")
        self.refused(run("image-info", self.file(sealed(large))), 2, "but the chip holds 262144")
        for at, address in ((PROGRAM, 0x10010000), (PROGRAM, 0x20080000), (PROGRAM + 4, 0x00400101)):
            other = bytearray(IMAGE.read_bytes())
            other[at:at + 4] = address.to_bytes(4, "little")
            self.refused(run("image-info", self.file(sealed(other))), 2, "for another chip")

    def test_seal_refuses_what_is_not_an_image(self):
        self.refused(run("image-seal", self.folder / "none"), 2, "none")
        self.refused(run("image-seal", self.file(b"text")), 2, "not a 32-bit little-endian ELF file")
        self.refused(run("image-seal", IMAGE), 2, "not a 32-bit little-endian ELF file")
        elf = IMAGE.with_suffix(".elf")
        copy = self.file(elf.read_bytes())
        self.assertEqual(run("image-seal", copy).returncode, 0)
        self.assertEqual(copy.read_bytes(), elf.read_bytes(), "sealed by the build")

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
                done = run("flash", way, self.file(sealed(image)), path=path)
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
