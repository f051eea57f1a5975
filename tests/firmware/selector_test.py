#!/usr/bin/env python3
"""The selector of the bank: code and vectors in the first pages name no code in other pages, which an update replaces; then an erased log."""

import pathlib
import struct
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "toolchain"))
import firmware_image  # noqa: E402

FLASH, LOG, PROGRAM = 0x08000000, 0x08001000, 0x08002000
VECTORS = 7  # stack, reset, NMI and faults


def main():
    image = firmware_image.Image(sys.argv[1])
    inside = [function for address, function in image.functions.items() if FLASH <= address < LOG]
    problems = [] if "select_bank" in {function.name for function in inside} else ["no select_bank"]
    for function in inside:
        for call in function.calls:
            if not FLASH <= call < LOG:
                problems.append(f"{function.name} calls 0x{call:08x}")
    content = pathlib.Path(sys.argv[1]).with_suffix(".bin").read_bytes()
    starts = {function.address for function in inside}
    for number, vector in enumerate(struct.unpack_from(f"<{VECTORS}I", content)[1:], 1):
        if vector % 2 == 0 or vector - 1 not in starts:
            problems.append(f"vector {number} is 0x{vector:08x}")
    if set(content[LOG - FLASH:PROGRAM - FLASH]) != {0xFF}:
        problems.append("the log is not erased")
    print(f"{len(inside)} functions", *problems, sep="\n")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
