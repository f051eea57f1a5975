"""Tables as spreadsheets, loggers and the program write them, read row by row: the rules of board/support/table.hpp."""

import codecs
import dataclasses
import re
import warnings
from collections.abc import Callable

import numpy as np

from ._array_file import FIRST_BYTES, is_array_file, table_of
from ._byte_stream import ByteStream

STATES = ("S1", "S2", "S3")
LONGEST_LINE = 1 << 20
SHOWN_CHARACTERS = 24
LARGEST = 1e12  # of a sample: squares of larger numbers may be infinite
NUMBER = re.compile(r"[-+]?(?:(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?|inf|infinity|nan)", re.IGNORECASE | re.ASCII)


def cell_number(cell: str) -> float | None:
    """The number, if all of the cell is one. A plus sign and a decimal comma are allowed."""
    text = cell.replace(",", ".", 1) if "." not in cell else cell
    return float(text) if NUMBER.fullmatch(text) else None


def shown(cell: str) -> str:
    """Beginning of a cell for a message."""
    text = "".join(c if " " <= c <= "~" else "?" for c in cell[:SHOWN_CHARACTERS])
    return text + "..." if len(cell) > SHOWN_CHARACTERS else text


def cells_of(line: str, separator: str) -> list[str]:
    """Cells without the blanks and quotation marks around them; a separator in quotation marks is part of its cell."""
    if '"' not in line:
        return line.split() if separator == " " else [cell.strip() for cell in line.split(separator)]
    separators = re.compile(r"[ \t\r]" if separator == " " else separator)
    blanks = re.compile(r"[ \r]*" if separator == "\t" else r"[ \t\r]*")
    cells, begin = [], 0
    while begin <= len(line):
        begin = blanks.match(line, begin).end()
        if separator == " " and begin == len(line):
            break
        is_quoted = line.startswith('"', begin)
        closing = line.find('"', begin + 1) if is_quoted else begin
        found = separators.search(line, closing) if closing >= 0 else None
        end = found.start() if found else len(line)
        cell = line[begin:end].strip()
        cells.append(cell[1:-1].strip() if is_quoted and len(cell) > 1 and cell[-1] == '"' else cell)
        begin = end + 1
    return cells


def separator_of(row: str) -> str:
    """The character between the cells of the first row; a blank stands for any number of blanks."""
    for separator in ";\t,":
        cells = cells_of(row, separator)
        is_decimal = separator == "," and any(" " in cell and cell_number(cell.split(" ")[0]) is not None for cell in cells)  # 0,5 0,25
        if len(cells) > 1 and not is_decimal:
            return separator
    return " "


def _fields_begin(buffer, ends, separator, count):
    """Index of the first character of each cell, (rows, count); None if a row has another number of cells."""
    is_between = (buffer == ord(separator)) | (buffer == ord("\n"))
    if separator == " ":  # any number of blanks
        begins = np.flatnonzero(~is_between & np.concatenate(([True], is_between[:-1])))
    else:
        begins = np.concatenate(([0], np.flatnonzero(is_between[:-1]) + 1))
    rows = len(ends)
    if len(begins) != rows * count or (begins[count - 1::count] > ends).any() or (begins[count::count] <= ends[:-1]).any():
        return None
    return begins.reshape(rows, count)


def plain_numbers(text: bytes, separator: str, count: int, state: int | None):
    """Numbers of a text (rows, count), if it consists only of rows of so many plain numbers, and of S1, S2 or S3 (as 1, 2, 3) in the column
    `state`; otherwise None. Ten times faster than cell by cell."""
    text = text.replace(b"\r\n", b"\n").removesuffix(b"\n")
    if separator != "," and b"." not in text:
        text = text.replace(b",", b".")
    if not text or text.translate(None, b"0123456789+-.eE\n" + separator.encode() + (b"" if state is None else b"S")):
        return None
    buffer = np.frombuffer(text, np.uint8).copy()
    ends = np.append(np.flatnonzero(buffer == ord("\n")), len(buffer))
    begins = _fields_begin(buffer, ends, separator, count)
    if begins is None:
        return None
    if state is not None:
        at = begins[:, state]
        after = np.append(buffer, ord("\n"))[np.minimum(at + 2, len(buffer))]
        if not np.array_equal(np.flatnonzero(buffer == ord("S")), at) or not np.isin(after, (ord(separator), ord("\n"))).all():
            return None
        buffer[at] = ord(" ")
    buffer[ends[:-1]] = ord(separator)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            values = np.fromstring(buffer.tobytes(), sep=separator)
    except (ValueError, DeprecationWarning):  # a cell is no number
        return None
    return values.reshape(-1, count) if values.size == begins.size else None


@dataclasses.dataclass
class Rows:
    """Successive rows. lines: number of the line of each; values: (N, columns), or None if the cells are not only plain numbers."""

    lines: np.ndarray
    values: np.ndarray | None
    cells: Callable  # called with the index of a row

    def __len__(self):
        return len(self.lines)


class Table:
    """Also of arrays in NumPy and MAT files. Raises ValueError that names file and line: for a file without a row, rows of other lengths, and
    what is no text. first_bytes: what was read already."""

    def __init__(self, stream: ByteStream, first_bytes: bytes = b""):
        self.path = stream.path
        self._stream = stream
        while len(first_bytes) < FIRST_BYTES and (more := stream.read()):
            first_bytes += more
        if is_array_file(first_bytes):
            first_bytes = table_of(b"".join((first_bytes, *iter(stream.read, b""))), self.path)
        self._pending = b""
        self._line = 0  # lines that were given out
        self._is_over = False
        self._separator = None
        self._convert = None  # from UTF-16
        self.state = None  # column of the states S1, S2 and S3, which count as numbers
        for mark, encoding in ((b"\xff\xfe", "utf-16-le"), (b"\xfe\xff", "utf-16-be"), (codecs.BOM_UTF8, None)):
            if first_bytes.startswith(mark):
                first_bytes = first_bytes[len(mark):]
                self._convert = codecs.getincrementaldecoder(encoding)(errors="replace").decode if encoding else None
        rows = self._used(self._whole_lines(first_bytes)) if first_bytes else []
        while not rows and not self._is_over:
            rows = self._used(self._whole_lines(stream.read()))
        if not rows:
            raise ValueError(f"{self.path}: is empty; a table is needed")
        self._header_line, header = rows[0]
        self.has_names = not any(cell_number(cell) is not None for cell in header)
        self.names = header if self.has_names else [f"column {n + 1}" for n in range(len(header))]
        self._more = rows[1:] if self.has_names else rows

    def _whole_lines(self, data: bytes) -> bytes:
        """The lines that are complete now; at the end also one without a line feed."""
        self._is_over = not data
        if self._convert:
            data = self._convert(data, final=self._is_over).encode()
        text = self._pending + data
        cut = len(text) if self._is_over else text.rfind(b"\n") + 1
        text, self._pending = text[:cut], text[cut:]
        if len(text) + len(self._pending) > LONGEST_LINE:
            self._refuse_lines((text + self._pending).split(b"\n"), lambda line: len(line) > LONGEST_LINE, "the line is longer than 1 MiB; a text file is needed")
        if b"\0" in text:
            self._refuse_lines(text.split(b"\n"), lambda line: b"\0" in line, "binary data; a text file is needed (UTF-16 with its byte-order mark)")
        return text

    def _refuse_lines(self, lines, is_wrong, says):
        number = next((n for n, line in enumerate(lines, self._line + 1) if is_wrong(line)), None)
        if number is not None:
            raise ValueError(f"{self.path}:{number}: {says}")

    def _used(self, text: bytes) -> list:
        """Numbers and cells of the lines that are rows: not blank, no comments, not only empty cells."""
        rows = []
        lines = text.decode(errors="replace").removesuffix("\n").split("\n") if text else []
        for number, line in enumerate(lines, self._line + 1):
            begin = line.strip(" \t\r")
            if not begin or begin[0] == "#":
                continue
            if self._separator is None:
                self._separator = separator_of(line)
            cells = cells_of(line, self._separator)
            if any(cells):
                rows.append((number, cells))
        self._line += len(lines)
        return rows

    def next(self) -> Rows | None:
        """The rows that were read next; None at the end."""
        while not self._more and not self._is_over:
            text = self._whole_lines(self._stream.read())
            plain = self._plain(text)
            if plain is not None:
                return plain
            self._more = self._used(text)
        if not self._more:
            return None
        rows, self._more = self._more, []
        count = len(self.names)
        for number, cells in rows:
            while len(cells) > count and not cells[-1]:
                cells.pop()
            if len(cells) != count:
                raise ValueError(f"{self.path}:{number}: {len(cells)} columns; {count} are needed, as in line {self._header_line}")
        return Rows(np.array([number for number, _ in rows]), None, lambda row: rows[row][1])

    def _plain(self, text: bytes) -> Rows | None:
        """Rows of lines that need none of the rules: only numbers, and states in their column."""
        values = plain_numbers(text, self._separator, len(self.names), self.state)
        if values is None:
            return None
        lines = np.arange(self._line + 1, self._line + 1 + len(values))
        self._line += len(values)
        return Rows(lines, values, lambda row: cells_of(text.split(b"\n")[row].decode(), self._separator))

    def column(self, name: str, expected: str) -> int:
        """Index of a column. expected: what the header must have, for the message."""
        where = f"{self.path}:{self._header_line}"
        if not self.has_names:
            raise ValueError(f"{where}: has numbers; the header must have {expected}")
        times = self.names.count(name)
        if times != 1:
            raise ValueError(f"{where}: {'more than one' if times else 'no'} column {name}; the header must have {expected}")
        return self.names.index(name)

    def numbers(self, rows: Rows, wanted: list) -> list:
        """Finite numbers of columns, float64. wanted: (column, limits) of each; limits: whole numbers between these, None: any number up to
        LARGEST."""
        if rows.values is None:
            cells = [rows.cells(row) for row in range(len(rows))]
            found = [np.array([np.nan if (value := cell_number(row[column])) is None else value for row in cells]) for column, _ in wanted]
        else:
            found = [rows.values[:, column] for column, _ in wanted]
        is_good = np.isfinite(found)
        for good, values, (_, limits) in zip(is_good, found, wanted):
            if limits is None:
                good &= abs(values) <= LARGEST
            else:
                good &= (values == np.floor(values)) & (values >= limits[0]) & (values <= limits[1])
        if not is_good.all():
            row = int(np.argmin(is_good.all(axis=0)))
            self._refuse(rows, row, *wanted[int(np.argmin(is_good[:, row]))])
        return found

    def _refuse(self, rows, row, column, limits):
        text = rows.cells(row)[column]
        where = f"{self.path}:{rows.lines[row]}: {self.names[column]}"
        value = cell_number(text)
        if value is None or not np.isfinite(value):
            raise ValueError(f"{where}: '{shown(text)}' is not {'a number' if value is None else 'finite; remove or repair the line'}")
        raise ValueError(f"{where}: {text} is " + (f"above {LARGEST:g}" if limits is None else f"not a whole number from {limits[0]} to {limits[1]}"))
