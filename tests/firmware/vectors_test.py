#!/usr/bin/env python3
"""Vector table of an image: initial stack pointer in RAM, every vector within the image and in Thumb state.
  vectors_test.py IMAGE.bin [OFFSET]"""

import pathlib
import struct
import sys

FLASH, RAM, RAM_BYTES, VECTORS = 0x08000000, 0x20000000, 32 * 1024, 16 + 102


def main():
    data = pathlib.Path(sys.argv[1]).read_bytes()
    offset = int(sys.argv[2], 0) if len(sys.argv) > 2 else 0
    stack, *vectors = struct.unpack_from(f"<{VECTORS}I", data, offset)
    problems = [] if RAM < stack <= RAM + RAM_BYTES and stack % 8 == 0 else [f"stack at 0x{stack:08x}"]
    for number, vector in enumerate(vectors, 1):
        if not vector & 1 or not FLASH + offset + 4 * VECTORS <= vector < FLASH + len(data):
            problems.append(f"vector {number} is 0x{vector:08x}")
    print(f"{len(vectors)} vectors, stack at 0x{stack:08x}", *problems, sep="\n")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
