"""Samples of a WAV file or stream, also of more than 4 GB (RF64, EBU Tech 3306): whole numbers of 16, 24 or 32 bits, or floating point."""

import struct

import numpy as np

from ._byte_stream import ByteStream
from ._table_rows import LARGEST

EXTENSIBLE = 0xFFFE  # the code of the format follows later
SHORTEST_STREAM = 0x7FFF0000  # a length from here on, or 0: the writer did not know it
FULL_SCALE = 0.9999  # codes of 16 bits end at 0.99997
INTEGER_BITS = (16, 24, 32)
MOST_CHANNELS = 64
FORMAT_BYTES = 26  # of the format's chunk, that are used
SIZES_BYTES = 16  # of RF64: length of the file, length of the data
SKIPPED_BYTES = 1 << 16  # of another chunk, at a time


class WavSamples:
    """Reads the header. Raises ValueError that names the file, unless it is that of a WAV file that is not compressed."""

    def __init__(self, stream: ByteStream, first_bytes: bytes):
        self.path, self._stream, self._bytes = stream.path, stream, first_bytes
        self.frame = 0  # bytes of a sample of all channels
        self._take(8)
        if self._take(4) != b"WAVE":
            raise ValueError(f"{self.path}: is a RIFF file, but not WAVE")
        long_size = None
        while True:
            name, size = struct.unpack("<4sI", self._take(8))
            if name == b"data":
                break
            used = min(size, {b"fmt ": FORMAT_BYTES, b"ds64": SIZES_BYTES}.get(name, 0))
            chunk = self._take(used)
            if name == b"fmt ":
                self._read_format(chunk)
            elif used == SIZES_BYTES:
                long_size = struct.unpack("<QQ", chunk)[1]
            for begin in range(used, size + size % 2, SKIPPED_BYTES):
                self._take(min(SKIPPED_BYTES, size + size % 2 - begin))
        if not self.frame:
            raise ValueError(f"{self.path}: the WAV header has no format")
        is_known = 0 < size < SHORTEST_STREAM or long_size is not None
        size = size if size < SHORTEST_STREAM or long_size is None else long_size
        if is_known and size % self.frame:
            raise ValueError(f"{self.path}: the WAV file ends in the middle of a frame of {self.channels} channels; record it again")
        self._left = size if is_known else None

    def _ends(self):
        return ValueError(f"{self.path}: the WAV file ends in the middle of a frame or before the length in its header; record it again")

    def _take(self, count: int) -> bytes:
        parts = [self._bytes]
        while sum(map(len, parts)) < count:
            parts.append(self._stream.read())
            if not parts[-1]:
                raise self._ends()
        data = b"".join(parts)
        self._bytes = data[count:]
        return data[:count]

    def _read_format(self, chunk: bytes):
        if len(chunk) < 16:
            raise ValueError(f"{self.path}: the WAV header is damaged")
        code, self.channels, rate_hz, _, _, bits = struct.unpack("<HHIIHH", chunk[:16])
        if code == EXTENSIBLE and len(chunk) >= 26:
            code = struct.unpack("<H", chunk[24:26])[0]
        self.is_float = code == 3
        if code != 1 and not self.is_float:
            raise ValueError(f"{self.path}: is a compressed WAV file (format {code}); write PCM")
        if bits not in ((32, 64) if self.is_float else INTEGER_BITS):
            raise ValueError(f"{self.path}: has samples of {bits} bits; write 16, 24 or 32")
        if not 0 < self.channels <= MOST_CHANNELS or not rate_hz:
            raise ValueError(f"{self.path}: the WAV header is damaged")
        self.bits, self.rate_hz, self.frame = bits, float(rate_hz), self.channels * bits // 8

    def next(self) -> np.ndarray | None:
        """The samples that were read next, (N, channels), full scale 1; None at the end. Raises ValueError for an end within a frame or before
        that of the header, and for a value that is not finite."""
        if self._left == 0:
            return None
        while len(self._bytes) < self.frame:
            data = self._stream.read()
            if not data and self._left is None and not self._bytes:
                return None
            if not data:
                raise self._ends()
            self._bytes += data
        count = len(self._bytes) // self.frame * self.frame
        if self._left is not None:
            count = min(count, self._left)
            self._left -= count
        data, self._bytes = self._bytes[:count], self._bytes[count:]
        values = self._values(data).reshape(-1, self.channels)
        if not (abs(values) <= LARGEST).all():
            raise ValueError(f"{self.path}: the WAV file has a sample that is not finite, or above {LARGEST:g}")
        return values

    def _values(self, data: bytes) -> np.ndarray:
        if self.is_float:
            with np.errstate(invalid="ignore"):  # next() refuses NaN
                return np.frombuffer(data, f"<f{self.bits // 8}").astype(float)
        if self.bits != 24:
            return np.frombuffer(data, f"<i{self.bits // 8}") / 2.0 ** (self.bits - 1)
        codes = np.zeros((len(data) // 3, 4), np.uint8)  # in the upper three bytes of 32 bits
        codes[:, 1:] = np.frombuffer(data, np.uint8).reshape(-1, 3)
        return codes.view("<i4")[:, 0] / 2.0**31
