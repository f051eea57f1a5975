#!/usr/bin/env python3
"""The selector of the bank: vectors and code in the first pages, no call to other pages, which an update replaces; then an erased log."""

import pathlib
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "toolchain"))
import firmware_image  # noqa: E402

FLASH, LOG, PROGRAM = 0x08000000, 0x08001000, 0x08002000


def main():
    image = firmware_image.Image(sys.argv[1])
    inside = [function for address, function in image.functions.items() if FLASH <= address < LOG]
    problems = [] if "select_bank" in {function.name for function in inside} else ["no select_bank"]
    for function in inside:
        for call in function.calls:
            if not FLASH <= call < LOG:
                problems.append(f"{function.name} calls 0x{call:08x}")
    content = pathlib.Path(sys.argv[1]).with_suffix(".bin").read_bytes()
    if set(content[LOG - FLASH:PROGRAM - FLASH]) != {0xFF}:
        problems.append("the log is not erased")
    print(f"{len(inside)} functions", *problems, sep="\n")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
