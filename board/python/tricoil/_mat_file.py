"""Arrays of numbers in MAT files of version 5 (MATLAB, Octave, SciPy), and in structures of them. SciPy's reader crashes on damaged files.

The format is that of "MAT-File Format" (The MathWorks): elements of type, length and data, padded to 8 bytes; arrays are column by column.
"""

import zlib

import numpy as np

HEADER_BYTES = 128
MOST_BYTES = 1 << 30  # of one array that is compressed
MOST_ENTRIES = 1 << 28
DEEPEST = 4  # structures in structures
MATRIX, COMPRESSED = 14, 15
STORED = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
STRUCTURE = 2
CLASSES = {6: "f8", 7: "f4", 8: "i1", 9: "u1", 10: "i2", 11: "u2", 12: "i4", 13: "u4", 14: "i8", 15: "u8"}
COMPLEX, LOGICAL = 0x800, 0x200


class _Elements:
    """Elements one after the other. Raises ValueError if they end too early."""

    def __init__(self, data, order):
        self.data, self.order, self.at = data, order, 0

    def __bool__(self):
        return self.at < len(self.data)

    def _take(self, count):
        if self.at + count > len(self.data):
            raise ValueError("an element is cut off")
        data = self.data[self.at:self.at + count]
        self.at += count
        return data

    def next(self):
        """Type and data."""
        kind, size = np.frombuffer(self._take(8), self.order + "u4").tolist()
        if kind >> 16:  # up to 4 bytes, in the place of the length
            self.at -= 4
            return kind & 0xFFFF, self._take(4)[:min(kind >> 16, 4)]
        data = self._take(size)
        if kind != COMPRESSED:
            self.at = min(self.at + -size % 8, len(self.data))
        return kind, data

    def numbers(self):
        kind, data = self.next()
        if kind not in STORED:
            raise ValueError(f"numbers of the unknown type {kind}")
        return np.frombuffer(data, self.order + STORED[kind])


def _structure(elements, depth):
    length = int(elements.numbers()[0])
    _, names = elements.next()
    fields = {}
    for begin in range(0, len(names) if length > 0 else 0, max(length, 1)):
        value = _matrix(elements, depth + 1)[1]
        fields[names[begin:begin + length].split(b"\0")[0].decode(errors="replace")] = value
    return fields


def _matrix(elements, depth):
    """Name and value of an array; the value is None if it is neither of real numbers nor a structure."""
    kind, data = elements.next()
    if kind == COMPRESSED:
        inflate = zlib.decompressobj()
        return _matrix(_Elements(inflate.decompress(data, MOST_BYTES), elements.order), depth)
    if kind != MATRIX or not data:
        return "", None
    parts = _Elements(data, elements.order)
    flags = int(parts.numbers()[0])
    shape = parts.numbers().tolist()
    name = parts.next()[1].decode(errors="replace")
    if flags & 0xFF == STRUCTURE and shape == [1, 1] and depth < DEEPEST:
        return name, _structure(parts, depth)
    if flags & 0xFF not in CLASSES or flags & COMPLEX:
        return name, None
    values = parts.numbers()
    if min(shape) < 0 or np.prod([float(n) for n in shape]) != len(values) or len(values) > MOST_ENTRIES:
        raise ValueError(f"{name} has {len(values)} entries, which do not fill its shape")
    values = values.astype(bool if flags & LOGICAL else CLASSES[flags & 0xFF]).reshape(shape, order="F")
    return name, values.reshape(-1) if values.ndim == 2 and 1 in shape else values


def read_mat(data: bytes) -> dict:
    """Arrays, and dictionaries of those of structures. Rows or columns become vectors. Raises ValueError or zlib.error if the data are damaged."""
    elements = _Elements(data[HEADER_BYTES:], "<" if data[126:128] == b"IM" else ">")
    variables = {}
    while elements:
        name, value = _matrix(elements, 0)
        if value is not None and name:
            variables[name] = value
    return variables
