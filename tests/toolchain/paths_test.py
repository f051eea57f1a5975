#!/usr/bin/env python3
"""No built file names the folder of the sources: paths_test.py FOLDER FILE... FILE: a program or library of a release."""
import pathlib
import re
import sys


def main():
    if len(sys.argv) < 3:
        print("usage: paths_test.py FOLDER FILE...", file=sys.stderr)
        return 2
    path = re.compile(re.escape(sys.argv[1].rstrip("/").encode()) + rb"/[ -~]*")
    found = [f"{file} contains {text.decode()}" for file in sys.argv[2:] for text in sorted(set(path.findall(pathlib.Path(file).read_bytes())))]
    print("\n".join(found), file=sys.stderr)
    return 1 if found else 0


sys.exit(main())
