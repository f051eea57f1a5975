"""Builds the extension module with CMake, for `pip install board/python`. All other settings are in pyproject.toml.

TRICOIL_WHEEL=FOLDER: for the wheel of a release. Builds in FOLDER, without the components that need libraries of Debian, and puts the other
libraries, except the C and C++ library, into the wheel. So it also runs where these are not installed.
"""

import os
import pathlib
import re
import shutil
import subprocess
import sys

from setuptools import Extension, setup
from setuptools.command.build_ext import build_ext

ROOT = pathlib.Path(__file__).resolve().parents[2]
WHEEL = os.environ.get("TRICOIL_WHEEL")
BUILD = pathlib.Path(WHEEL or ROOT / "build" / f"pip-{sys.implementation.cache_tag}")
MODULE = "tricoil._tricoil"
ABSENT = ["WEB"]  # its build needs the network
if WHEEL:
    ABSENT += ["GPIO", "USB", "OPENIGTLINK", "OSC", "CALIBRATION", "VIRTUAL_BOARD"]
SYSTEM_LIBRARIES = re.compile(r"(linux-vdso|ld-linux[-\w]*|lib(c|m|gcc_s|stdc\+\+))\.so\b")


class CMakeBuild(build_ext):
    """Options of the preset `run`, in a build folder of this Python version."""

    def build_extension(self, ext):
        options = ["--preset", "run", "-B", BUILD, f"-DPython3_EXECUTABLE={sys.executable}", "-DTRICOIL_PYTHON_PACKAGE=ON",
                   f"-DCMAKE_INSTALL_RPATH={'$ORIGIN' if WHEEL else ''}", *(f"-DTRICOIL_WITH_{name}=OFF" for name in ABSENT)]
        try:
            subprocess.run(["cmake", *options], cwd=ROOT, check=True)
            subprocess.run(["cmake", "--build", BUILD, "--target", "tricoil_python"], cwd=ROOT, check=True)
        except FileNotFoundError:
            sys.exit(f"cmake: not found; run {ROOT}/toolchain/install-deps run")
        except subprocess.CalledProcessError as error:
            sys.exit(f"{error}; missing packages: {ROOT}/toolchain/install-deps run installs them on Debian")
        (module,) = (BUILD / "board/python/tricoil").glob("_tricoil.*.so")
        target = pathlib.Path(self.get_ext_fullpath(ext.name))
        self.copy_file(module, target)
        if WHEEL:
            subprocess.run(["strip", "--strip-unneeded", target], check=True)
            for library in libraries_of(module):
                self.copy_file(library, target.parent)
                package = owner_of(library)
                self.copy_file(f"/usr/share/doc/{package}/copyright", target.parent / f"{package}.copyright")


def libraries_of(module):
    """Paths of the shared libraries that a module needs, directly or not, except those of every system."""
    lines = subprocess.run(["ldd", module], check=True, capture_output=True, text=True).stdout.splitlines()
    return [line.split()[2] for line in lines if "=>" in line and not SYSTEM_LIBRARIES.match(line.strip())]


def owner_of(library):
    """The Debian package of a library."""
    name = pathlib.Path(library).name
    return subprocess.run(["dpkg-query", "-S", f"*/{name}"], check=True, capture_output=True, text=True).stdout.split(":")[0]


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
