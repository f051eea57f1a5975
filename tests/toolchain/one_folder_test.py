#!/usr/bin/env python3
"""`toolchain/run` and `toolchain/test` share their work in one build folder:
- components whose packages are installed after the first pose leave its commands as they are, except for a few;
- switching the tests on or off changes no command that builds the product.

  one_folder_test.py BUILD     BUILD: a build folder of the preset host-release
"""
import os
import pathlib
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
MOST_CHANGED = 4  # sources that ask which components there are, and the link
WITHOUT_PACKAGES = """foreach(name Ceres OpenIGTLink wslay OpenSSL pybind11)
  set(CMAKE_DISABLE_FIND_PACKAGE_${name} ON)
endforeach()
"""


def configure(folder, includes="", **environment):
    command = ["cmake", "--preset", "run", "-B", folder, f"-DCMAKE_PROJECT_TOP_LEVEL_INCLUDES={includes}"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, env={**os.environ, **environment})
    if done.returncode != 0:
        sys.exit(f"one_folder_test: the preset run cannot be configured:\n{done.stdout}{done.stderr}")
    return [line for line in done.stdout.splitlines() if line.startswith("-- tricoil: without")]


def commands(build, target):
    """The commands that build a target; names of the build folder replaced."""
    done = subprocess.run(["ninja", "-C", build, "-t", "commands", target], capture_output=True, text=True, check=True)
    return {line.replace(str(build), "BUILD") for line in done.stdout.splitlines() if not line.startswith("ninja: ")}


def main():
    build = pathlib.Path(sys.argv[1]).resolve()
    with tempfile.TemporaryDirectory(dir=build) as name:
        folder = pathlib.Path(name)
        (folder / "without_packages.cmake").write_text(WITHOUT_PACKAGES)
        absent = configure(folder, folder / "without_packages.cmake", PKG_CONFIG_LIBDIR="/nonexistent")
        first = commands(folder, "tricoil_first_pose")
        still_absent = configure(folder)
        changed = first - commands(folder, "tricoil_first_pose")
        alone, with_tests = commands(folder, "tricoil_product"), commands(build, "tricoil_product")
    for command in sorted(alone ^ with_tests):
        print(f"only {'without' if command in alone else 'with'} tests: {command}")
    for command in sorted(changed):
        print(f"changed when all packages are there: {command}")
    print("\n".join(still_absent))
    print(f"{len(absent)} components absent at first; of {len(first)} commands of the first pose {len(changed)} change later; "
          f"{len(alone)} commands build the product, tests change {len(alone ^ with_tests)}")
    good = alone == with_tests and first and len(absent) > 5 and not still_absent and len(changed) <= MOST_CHANGED
    sys.exit(0 if good else 1)


main()
