#!/usr/bin/env python3
"""C++ blocks of the README must be parts of the example program that tests/package compiles and runs.

  snippets_test.py [README]
"""
import os
import re
import sys
import textwrap

ROOT = os.path.realpath(os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", ".."))
EXAMPLE = "tests/package/consumer_cpp/consumer.cpp"


def main():
    page = sys.argv[1] if len(sys.argv) > 1 else os.path.join(ROOT, "README.md")
    with open(page) as file:
        blocks = re.findall(r"^```cpp\n(.*?)^```$", file.read(), re.M | re.S)
    with open(os.path.join(ROOT, EXAMPLE)) as file:
        example = file.read()
    if not blocks:
        sys.exit(f"{page}: no C++ block")
    for block in blocks:
        if textwrap.indent(block, "    ") not in example:
            sys.exit(f"{page}: a C++ block differs from {EXAMPLE}:\n{block}")
    print(f"{len(blocks)} C++ blocks, all in {EXAMPLE}")


main()
