"""Captures of raw samples in blocks: tables of codes or volts, WAV files, arrays."""

import dataclasses

import numpy as np

from ._array_file import FIRST_BYTES, is_array_file, samples_of
from ._byte_stream import ByteStream
from ._table_rows import LARGEST, STATES, Table, shown
from ._wav_samples import FULL_SCALE, WavSamples

BITS = (8, 31)
ORDER = ("state", "repeat", "sample")
NOT_CHANNELS = ("", *ORDER, "time_us", "time_s")
MOST_REPEATS = 1_000_000
OTHER_SOUND = {b"fLaC": "FLAC", b"FORM": "AIFF", b"RIFX": "RIFX", b"OggS": "Ogg", b"ID3": "MP3", b"caff": "CAF"}
BYTE_ORDER_MARK = b"\xef\xbb\xbf"


@dataclasses.dataclass
class Blocks:
    """Successive blocks of one length. coil: driven source coil of each, -1: all three, at their own carriers; begin: index of the first
    sample in the capture; values: (B, samples, channels)."""

    coil: np.ndarray
    repeat: np.ndarray
    begin: np.ndarray
    values: np.ndarray

    def __len__(self):
        return len(self.coil)

    def part(self, begin, end=None):
        return Blocks(self.coil[begin:end], self.repeat[begin:end], self.begin[begin:end], self.values[begin:end])

    @staticmethod
    def joined(parts):
        return Blocks(*(np.concatenate([getattr(part, field.name) for part in parts]) for field in dataclasses.fields(Blocks)))


def codes_of(bits: int) -> int:
    if not BITS[0] <= bits <= BITS[1]:
        raise ValueError(f"--bits: {bits} is not possible; give {BITS[0]} to {BITS[1]}")
    return (1 << bits) - 1


class Capture:
    """What all captures have: `names` of all columns, `columns` of the channels, full_scale (0: unknown), rate_hz (0: unknown), and the
    successive samples in _samples(): values (N, channels), and with states coil, repeat, number (N) and a function that names a row's place."""

    follows = False
    has_states = False
    rate_hz = 0.0
    full_scale = 0.0
    codes = 0  # of the converter; 0: volts
    _centre = None  # of the codes; known after the first block

    def choose(self, columns):
        self.columns = [self._column_of(str(name)) for name in columns] or [n for n, name in enumerate(self.names) if name not in NOT_CHANNELS]
        self.channels = [self.names[n] for n in self.columns]
        repeated = {name for name in self.channels if self.channels.count(name) > 1}
        if repeated and not columns:
            raise ValueError(f"{self.path}: more than one column {min(repeated)}; select columns by number, with --columns")
        if len(self.channels) not in (3, 4):
            raise ValueError(f"{self.path}: {len(self.channels)} channels; three sensor coils are needed, and optionally the reference: "
                             "select them with --columns")

    def _named_column(self, name):
        return self.names.index(name) if name in self.names else len(self.names)

    def _column_of(self, name: str) -> int:
        column = int(name) - 1 if name.isascii() and name.isdigit() else self._named_column(name)
        if not 0 <= column < len(self.names):
            raise ValueError(f"{self.path}: no column '{name}'; it has {len(self.names)}")
        return column

    def channel_of(self, name: str) -> int:
        """Index of a channel by the name or the number of its column."""
        column = self._column_of(name)
        if column not in self.columns:
            raise ValueError(f"{self.path}: the reference '{name}' is not one of --columns")
        return self.columns.index(column)

    def blocks(self, samples: int):
        """Blocks as they come. Without states they have so many samples; an incomplete last one is left out. Raises ValueError that names the
        place for samples out of order, and states whose blocks differ in length."""
        for blocks in self._in_turn() if self.has_states else self._at_once(samples):
            if self._centre is None:
                self._centre = (self.full_scale + 1) * float(self.codes != 0 and blocks.values[0].min() >= 0)  # codes without a sign
            blocks.values = blocks.values - self._centre
            yield blocks

    def _at_once(self, samples):
        pending, held, repeat = [], 0, 0
        for values in self._samples():
            pending.append(values)
            held += len(values)
            count = held // samples
            if not count:
                continue
            joined = np.concatenate(pending)
            pending, held = [joined[count * samples:]], held - count * samples
            index = np.arange(repeat, repeat + count)
            yield Blocks(np.full(count, -1), 1 + index, samples * index, joined[:count * samples].reshape(count, samples, -1))
            repeat += count

    def _in_turn(self):
        length, begin, held = 0, 0, None
        for *new, lines in self._samples():
            rows = [np.concatenate(pair) for pair in zip(held, (*new, lines))] if held else [*new, lines]
            values, coil, repeat, number, lines = rows
            ends = np.flatnonzero((coil[1:] != coil[:-1]) | (repeat[1:] != repeat[:-1])) + 1
            starts = np.concatenate(([0], ends))
            length = self._checked(starts, len(coil), number, lines, length)
            last = starts[-1]
            if last:
                yield self._whole(rows, starts[:-1], length, begin)
            begin += last
            held = [row[last:] for row in rows]
        if held and not (self.follows and len(held[0]) < length):
            length = self._checked(np.array([0, len(held[0])]), len(held[0]), held[3], held[4], length)
            yield self._whole(held, np.array([0]), length, begin)

    @staticmethod
    def _whole(rows, starts, length, begin):
        values, coil, repeat = rows[:3]
        return Blocks(coil[starts], repeat[starts], begin + starts, values[:length * len(starts)].reshape(len(starts), length, -1))

    def _checked(self, starts, count, number, lines, length):
        """Length of a block. All but the last are whole."""
        for start, end in zip(starts, [*starts[1:], None]):
            expected = np.arange(len(number[start:end]))
            wrong = np.flatnonzero(number[start:end] != expected)
            if len(wrong):
                row = wrong[0]
                raise ValueError(f"{self.path}:{lines[start + row]}: sample {number[start + row]} instead of {row}; samples are missing or out of order")
            if end is not None and length and end - start != length:
                raise ValueError(f"{self.path}:{lines[end - 1]}: the block that ends here has {end - start} samples, the first has {length}; "
                                 "the recording is incomplete")
            length = length or (end - start if end is not None else 0)
        return length


class TableCapture(Capture):
    """A table with the columns state (S1 to S3), repeat and sample of coils in turn, or without them."""

    def __init__(self, stream, first_bytes, bits, columns):
        self.path = stream.path
        self.codes = codes_of(bits)
        self.full_scale = float(self.codes // 2)
        self._table = Table(stream, first_bytes)
        self.names = self._table.names
        self.has_states = self._table.has_names and "state" in self.names
        self._order = [self._table.column(name, "state,repeat,sample and the channels") for name in ORDER] if self.has_states else []
        self._table.state = self._order[0] if self.has_states else None
        self.choose(columns)

    def _named_column(self, name):
        return self._table.column(name, "the channels of --columns and --reference")

    def _samples(self):
        rows = self._table.next()
        if rows and any(set(rows.cells(0)[n]) - set("+-0123456789") for n in self.columns):  # volts
            self.codes, self.full_scale = 0, 0.0
        limits = (-(self.codes // 2) - 1, self.codes) if self.codes else None
        wanted = [(n, limits) for n in self.columns] + [(n, (0, MOST_REPEATS)) for n in self._order[1:]]
        while rows:
            coils = self._coils(rows) if self.has_states else None
            numbers = self._table.numbers(rows, wanted)
            values = np.column_stack(numbers[:len(self.columns)])
            yield (values, coils, *(one.astype(int) for one in numbers[-2:]), rows.lines) if self.has_states else values
            rows = self._table.next()

    def _coils(self, rows):
        if rows.values is not None:
            coils = rows.values[:, self._order[0]].astype(int) - 1
        else:
            texts = [rows.cells(row)[self._order[0]] for row in range(len(rows))]
            coils = np.array([STATES.index(text) if text in STATES else -1 for text in texts])
        wrong = np.flatnonzero((coils < 0) | (coils >= len(STATES)))
        if len(wrong):
            text = rows.cells(wrong[0])[self._order[0]]
            raise ValueError(f"{self.path}:{rows.lines[wrong[0]]}: state '{shown(text)}' is not S1, S2 or S3")
        return coils


class WavCapture(Capture):
    """A WAV file or stream of coils that are driven at the same time."""

    full_scale = FULL_SCALE

    def __init__(self, stream, first_bytes, columns):
        self.path = stream.path
        self._wav = WavSamples(stream, first_bytes)
        self.rate_hz = self._wav.rate_hz
        self.names = [f"channel {n + 1}" for n in range(self._wav.channels)]
        self.choose(columns)

    def _samples(self):
        while (values := self._wav.next()) is not None:
            yield values[:, self.columns]


class ArrayCapture(Capture):
    """An array of samples: whole numbers are codes, others volts. (N, channels): coils at the same time; (repeats, 3, samples, channels): in
    turn."""

    CHUNK = 1 << 16  # samples

    def __init__(self, array, bits, columns, path="capture"):
        self.path = path
        self._array = np.asarray(array)
        if self._array.ndim not in (2, 4) or self._array.dtype.kind not in "iuf" or (self._array.ndim == 4 and self._array.shape[1] != len(STATES)):
            raise ValueError(f"{path}: has shape {self._array.shape} of {self._array.dtype}; give real numbers, (N, channels) or (repeats, 3, samples, channels)")
        if self._array.dtype.kind != "f":
            self.codes = codes_of(bits)
            self.full_scale = float(self.codes // 2)
        self.has_states = self._array.ndim == 4
        self.names = [f"channel {n + 1}" for n in range(self._array.shape[-1])]
        self.choose(columns)

    def _values(self, values):
        values = values[..., self.columns].astype(float)
        if not (abs(values) <= LARGEST).all():
            raise ValueError(f"{self.path}: contains NaN or values above {LARGEST:g}")
        if self.codes and values.size and not -(self.codes // 2) - 1 <= values.min() <= values.max() <= self.codes:
            raise ValueError(f"{self.path}: has codes from {values.min():.0f} to {values.max():.0f}, more than --bits permits")
        return values

    def _samples(self):
        for begin in range(0, len(self._array), self.CHUNK):
            yield self._values(self._array[begin:begin + self.CHUNK])

    def _in_turn(self):
        repeats, coils, samples, _ = self._array.shape
        if samples:
            step = max(1, self.CHUNK // (coils * samples))
            for begin in range(0, repeats, step):
                values = self._values(self._array[begin:begin + step])
                index = np.arange(begin * coils, begin * coils + len(values) * coils)
                yield Blocks(index % coils, index // coils, samples * index, values.reshape(len(index), samples, -1))


def open_capture(stream: ByteStream, bits: int = 16, columns=(), follows: bool = False) -> Capture:
    """Raises ValueError for a damaged header, a missing column, and another number of channels than three or four."""
    data = b""
    while len(data) < FIRST_BYTES and (more := stream.read()):
        data += more
    if is_array_file(data):
        data = b"".join((data, *iter(stream.read, b"")))
        return ArrayCapture(samples_of(data, stream.path), bits, columns, stream.path)
    text = data.removeprefix(BYTE_ORDER_MARK)
    other = next((name for mark, name in OTHER_SOUND.items() if text.startswith(mark)), None)
    if other:
        raise ValueError(f"{stream.path}: is a file of {other}; write WAV (PCM)")
    capture = WavCapture(stream, text, columns) if text.startswith((b"RIFF", b"RF64")) else TableCapture(stream, data, bits, columns)
    capture.follows = follows
    return capture
