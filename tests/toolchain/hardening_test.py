#!/usr/bin/env python3
"""Checks built files with readelf. Programs: position independent, read-only relocations, no executable stack. Libraries of tricoil:
protected stack, checked buffers, marked targets of indirect jumps (x86-64). Other libraries, linked statically, may differ.

  hardening_test.py [--unoptimised] FILE...     --unoptimised: without checked buffers, which need optimisation; FILE.a: a library
"""
import re
import subprocess
import sys


def readelf(*arguments):
    return subprocess.run(["readelf", "-W", *arguments], capture_output=True, text=True, check=True).stdout


def program_lacks(program):
    header, layout, dynamic = (readelf(option, program) for option in ("-h", "-l", "-d"))
    if not re.search(r"Type:\s+DYN", header) or "INTERP" not in layout:
        yield "is not position independent (PIE)"
    if "GNU_RELRO" not in layout or not re.search(r"BIND_NOW|FLAGS.*\bNOW\b", dynamic):
        yield "has relocations that can be written (full RELRO)"
    if "GNU_STACK" not in layout or re.search(r"GNU_STACK.*\bRWE\b", layout):
        yield "has an executable stack"


def library_lacks(library, optimised):
    header, symbols = readelf("-h", library), readelf("-s", library)
    if "__stack_chk_fail" not in symbols:
        yield "has no protected stack (-fstack-protector-strong)"
    if optimised and not set(re.findall(r"UND (__\w+_chk)\b", symbols)):
        yield "has no checked buffers (_FORTIFY_SOURCE)"
    members = header.count("Type:")
    if "X86-64" in header and readelf("-n", library).count("IBT, SHSTK") < members:
        yield "has unmarked targets of indirect jumps (-fcf-protection)"


def main():
    files = [argument for argument in sys.argv[1:] if argument != "--unoptimised"]
    if not files:
        print("usage: hardening_test.py [--unoptimised] FILE...", file=sys.stderr)
        sys.exit(2)
    bad = False
    for file in files:
        for what in library_lacks(file, "--unoptimised" not in sys.argv) if file.endswith(".a") else program_lacks(file):
            bad = True
            print(f"{file} {what}; configure with a preset, or -DTRICOIL_HARDEN=ON", file=sys.stderr)
    sys.exit(1 if bad else 0)


main()
