"""Builds the extension module with CMake, for `pip install board/python`. All other settings are in pyproject.toml."""

import pathlib
import re
import shutil
import subprocess
import sys

from setuptools import Extension, setup
from setuptools.command.build_ext import build_ext

ROOT = pathlib.Path(__file__).resolve().parents[2]
BUILD = ROOT / "build" / f"pip-{sys.implementation.cache_tag}"
MODULE = "tricoil._tricoil"


class CMakeBuild(build_ext):
    """Options of the preset `run`, in a build folder of this Python version. Without the live page, whose build needs npm."""

    def build_extension(self, ext):
        options = ["--preset", "run", "-B", BUILD, f"-DPython3_EXECUTABLE={sys.executable}", "-DTRICOIL_PYTHON_PACKAGE=ON", "-DTRICOIL_WITH_WEB=OFF"]
        try:
            subprocess.run(["cmake", *options], cwd=ROOT, check=True)
            subprocess.run(["cmake", "--build", BUILD, "--target", "tricoil_python"], cwd=ROOT, check=True)
        except FileNotFoundError:
            sys.exit(f"cmake: not found; run {ROOT}/toolchain/install-deps run")
        except subprocess.CalledProcessError as error:
            sys.exit(f"{error}; missing packages: {ROOT}/toolchain/install-deps run installs them on Debian")
        (module,) = (BUILD / "board/python/tricoil").glob("_tricoil.*.so")
        self.copy_file(module, self.get_ext_fullpath(ext.name))


def version():
    return re.search(r"^project\(tricoil VERSION ([0-9.]+)", (ROOT / "CMakeLists.txt").read_text(encoding="utf-8"), re.MULTILINE)[1]


if not (ROOT / "CMakeLists.txt").exists():
    sys.exit(f"{ROOT}: not a checkout of tricoil; install from one with: pip install CHECKOUT/board/python")
BUILD.mkdir(parents=True, exist_ok=True)
shutil.rmtree(BUILD / "wheel", ignore_errors=True)  # files of an earlier version
setup(
    version=version(),
    ext_modules=[Extension(MODULE, [])],
    cmdclass={"build_ext": CMakeBuild},
    # Keeps the checkout clean.
    options={"build": {"build_base": str(BUILD / "wheel")}, "egg_info": {"egg_base": str(BUILD)}},
)
