#!/usr/bin/env python3
"""Checks RPATH and RUNPATH of all ELF programs, libraries and modules below folders: no empty or relative part, which would load libraries
from the current folder. $ORIGIN is the folder of the file itself.

  runpath_test.py [--self-test] FOLDER...     --self-test: also links a library with an empty part, which must be reported
"""
import os
import pathlib
import re
import subprocess
import sys
import tempfile


def is_linked_elf(path):
    """An executable or shared object, not an object file."""
    with path.open("rb") as file:
        head = file.read(18)
    return len(head) == 18 and head[:4] == b"\x7fELF" and int.from_bytes(head[16:18], "little" if head[5] == 1 else "big") in (2, 3)


def linked_files(folder):
    for place, folders, names in os.walk(folder):
        folders[:] = [name for name in folders if not (pathlib.Path(place) / name).is_symlink()]
        for path in (pathlib.Path(place) / name for name in names):
            if path.is_file() and not path.is_symlink() and is_linked_elf(path):
                yield path


def bad_parts(path):
    dynamic = subprocess.run(["readelf", "-d", "-W", path], capture_output=True, text=True, check=True).stdout
    for search_path in re.findall(r"\((?:RPATH|RUNPATH)\).*\[(.*)\]", dynamic):
        yield from (part for part in search_path.split(":") if not re.match(r"/|\$ORIGIN(/|$)|\$\{ORIGIN\}(/|$)", part))


def breaches(folder):
    count, found = 0, []
    for path in linked_files(folder):
        count += 1
        found += [f"{path}: its RUNPATH has the part '{part}', which is the current folder or below it" for part in bad_parts(path)]
    return count, found


def self_test():
    with tempfile.TemporaryDirectory() as folder:
        for name, search_path in (("bad_empty", "/usr/lib:"), ("bad_relative", "lib"), ("good", "/usr/lib:$ORIGIN/../lib")):
            subprocess.run(["cc", "-shared", "-nostdlib", "-x", "c", "/dev/null", f"-Wl,-rpath,{search_path}", "-o", f"{folder}/{name}.so"],
                           check=True)
        count, found = breaches(folder)
        assert count == 3 and len(found) == 2 and not any("good" in line for line in found), (count, found)


def main():
    folders = [argument for argument in sys.argv[1:] if argument != "--self-test"]
    if not folders:
        print(__doc__, file=sys.stderr)
        return 2
    if "--self-test" in sys.argv:
        self_test()
    count, found = 0, []
    for folder in folders:
        number, lines = breaches(folder)
        count, found = count + number, found + lines
    print("\n".join([*found, f"{count} programs and libraries, {len(found)} bad parts of RUNPATH"]))
    return 1 if found or count == 0 else 0


if __name__ == "__main__":
    sys.exit(main())
