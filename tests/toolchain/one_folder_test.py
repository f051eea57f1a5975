#!/usr/bin/env python3
"""Switching the tests on or off changes no command that builds the product, so `toolchain/run` and `toolchain/test` share their work.

  one_folder_test.py BUILD     BUILD: a build folder of the preset host-release
"""
import pathlib
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent


def commands(build):
    """The commands of everything in the product; names of the build folder replaced."""
    done = subprocess.run(["ninja", "-C", build, "-t", "commands", "tricoil_product"], capture_output=True, text=True, check=True)
    return {line.replace(str(build), "BUILD") for line in done.stdout.splitlines() if not line.startswith("ninja: ")}


def main():
    build = pathlib.Path(sys.argv[1]).resolve()
    with tempfile.TemporaryDirectory(dir=build) as folder:
        done = subprocess.run(["cmake", "--preset", "run", "-B", folder], cwd=ROOT, capture_output=True, text=True)
        if done.returncode != 0:
            sys.exit(f"one_folder_test: the preset run cannot be configured:\n{done.stdout}{done.stderr}")
        with_tests, alone = commands(build), commands(pathlib.Path(folder))
    for command in sorted(alone ^ with_tests):
        print(f"only {'without' if command in alone else 'with'} tests: {command}")
    print(f"{len(alone)} commands build the product; {len(alone ^ with_tests)} differ")
    sys.exit(1 if alone != with_tests or not alone else 0)


main()
