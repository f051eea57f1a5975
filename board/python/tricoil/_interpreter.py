"""The interpreter must be one for which the package was built, and have NumPy."""

import pathlib
import sys


def check() -> None:
    """Raises ImportError with one line that names this interpreter and the right one."""
    own = f"{sys.version_info.major}.{sys.version_info.minor}"
    built = [file.name.partition(".cpython-")[2].partition("-")[0] for file in pathlib.Path(__file__).parent.glob("_tricoil.cpython-*")]
    versions = [f"{tag[0]}.{tag[1:]}" for tag in built]
    if versions and own not in versions:
        raise ImportError(f"tricoil was built for Python {', '.join(versions)}; {sys.executable} is Python {own}. Use python{versions[0]}, such as /usr/bin/python{versions[0]}")
    try:
        import numpy as _  # noqa: F401
    except ImportError:
        raise ImportError(f"tricoil needs NumPy, which {sys.executable} does not have (an environment of pyenv or conda?). Use /usr/bin/python3, or install numpy there") from None
