"""Lines of a table of poses: separator, comments, quoted names, decimal comma."""

import dataclasses
import re

import numpy as np

from ._poses import PoseError
from ._table_rows import cells_of as split
from ._table_rows import separator_of

COMMENT = ("#", "%", "//")
POLHEMUS = "sensor,x,y,z,azimuth,elevation,roll"
NUMBER = re.compile(r"[-+]?(\d+([.,]\d*)?|[.,]\d+)([eEdD][-+]?\d+)?|[-+]?(nan|inf)", re.IGNORECASE | re.ASCII)
EMPTY = ("", "-", "--", "n/a", "na", "null", "none", "missing")


@dataclasses.dataclass
class Table:
    """Fields as text by column. lines: number of the line of each row. units: of names without one, for example {"length": "mm"}."""

    name: str
    columns: list[str]
    fields: list[list[str]]  # by column, then row
    lines: list[int]
    units: dict = dataclasses.field(default_factory=dict)
    notes: list = dataclasses.field(default_factory=list)
    decimal_comma: bool = False
    rate_hz: float | None = None  # of the column of frames, if the file says it
    left_out: int = 0  # rows without a valid pose

    def __len__(self):
        return len(self.lines)

    def where(self, row):
        return f"{self.name}:{self.lines[row]}"

    def taken(self, rows):
        """The table with these rows only."""
        return dataclasses.replace(self, fields=[[column[n] for n in rows] for column in self.fields], lines=[self.lines[n] for n in rows])

    def empty(self, columns):
        """Rows in which all of these columns are empty, and rows in which some are."""
        is_empty = np.array([[text.lower() in EMPTY for text in self.fields[c]] for c in columns])
        return is_empty.all(axis=0), is_empty.any(axis=0)

    def numbers(self, column):
        texts = self.fields[column]
        joined = "".join(texts)
        try:
            if "_" in joined or not joined.isascii():  # digits to Python, but not to other programs
                raise ValueError("not a number")
            return np.array([float(text) for text in texts]) if not self.decimal_comma else np.array([float(text.replace(",", ".")) for text in texts])
        except ValueError:
            for row, text in enumerate(texts):
                if not NUMBER.fullmatch(text) or "d" in text.lower():
                    shown = re.sub("[^ -~]", "?", text[:24])
                    raise PoseError(f"{self.where(row)}: '{shown}' in column {self.columns[column]} is not a number") from None
            raise


def decoded(data: bytes) -> str:
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return data.decode("utf-16", errors="replace")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("latin-1")


def is_number(text):
    return NUMBER.fullmatch(text) is not None


def is_data(fields):
    """True for a row of numbers; names of sensors and marks of validity are no numbers, so half of the fields are enough."""
    return sum(map(is_number, fields)) * 2 >= sum(bool(text) for text in fields)


def table(data: bytes, name: str, columns: str | None = None) -> Table:
    """Fields of a table with a line of names, which may be a comment; otherwise `columns` are the names."""
    used, last_comment = [], ""
    for number, line in enumerate(decoded(data).splitlines(), 1):
        text = line.strip()
        if text.startswith(COMMENT):
            last_comment = text if not used else last_comment
        elif text.strip(',;"\t '):
            used.append((number, line.strip(" \r\n")))
    if not used:
        raise PoseError(f"{name}: has no poses")
    first_number, first = used[0]
    separator = separator_of(first)
    names = split(first, separator)
    if len(names) == 4 and columns is None and all(map(is_number, names)):
        return matrices(used, name)
    if is_data(names):
        if separator == "," and len(used) > 1 and separator_of(used[-1][1]) == ";":
            separator = ";"
        comment = split(last_comment.lstrip("#%/ "), separator_of(last_comment.lstrip("#%/ ")))
        if columns is not None:
            given = (POLHEMUS if columns == "polhemus" else columns).split(",")
            count, names = len(names), [text.strip() for text in given]
        elif len(comment) == len(names) and not is_data(comment):
            count, names = len(names), comment
        else:
            raise PoseError(f"{name}:{first_number}: numbers, but no line of names above them; give --columns, for example {POLHEMUS}")
        if len(names) != count:
            raise PoseError(f"{name}:{first_number}: {count} fields; {len(names)} columns are named")
    elif columns is not None:
        raise PoseError(f"{name}:{first_number}: has a line of names; leave --columns out")
    else:
        used = used[1:]
    while len(names) > 1 and not names[-1]:
        names.pop()
    rows, lines = [], []
    for number, line in used:
        fields = split(line, separator)
        while len(fields) > len(names) and not fields[-1]:
            fields.pop()
        if len(fields) != len(names):
            raise PoseError(f"{name}:{number}: {len(fields)} fields; the header has {len(names)}")
        rows.append(fields)
        lines.append(number)
    by_column = [list(column) for column in zip(*rows)] or [[] for _ in names]
    comma = separator != "," and any("," in text for column in by_column for text in column[:1])
    return Table(name, names, by_column, lines, decimal_comma=comma)


def matrices(used, name):
    """Homogeneous matrices, four lines of four numbers each."""
    if len(used) % 4:
        raise PoseError(f"{name}:{used[-1][0]}: {len(used)} lines of four numbers; a homogeneous matrix has four lines")
    rows = [split(line, separator_of(line)) for _, line in used]
    for (number, _), fields in zip(used, rows):
        if len(fields) != 4:
            raise PoseError(f"{name}:{number}: {len(fields)} fields; a row of a homogeneous matrix has 4")
    flat = [sum(rows[n:n + 4], []) for n in range(0, len(rows), 4)]
    names = [f"m{row}{column}" for row in range(1, 5) for column in range(1, 5)]
    return Table(name, names, [list(column) for column in zip(*flat)], [used[n][0] for n in range(0, len(used), 4)])
