"""Couplings in a table: the rules of board/support/coupling_text.hpp."""

import os

import numpy as np

from ._byte_stream import ByteStream
from ._table_rows import Rows, Table

EXPECTED = "x11,x12,x13,x21,x22,x23,x31,x32,x33 (xij: sensor coil i, source coil j), optionally q11,...,q33"
ENTRIES = [f"{i}{j}" for i in "123" for j in "123"]
LEAST_DETERMINANT = 1e-6  # of couplings with norm 1


def matrices(table: Table, rows: Rows, names: list[str], expected: str):
    """Nine columns of numbers, (N, 3, 3)."""
    columns = [table.column(name, expected) for name in names]
    return np.stack(table.numbers(rows, [(column, None) for column in columns]), axis=1).reshape(-1, 3, 3)


def refuse_dead(table: Table, rows: Rows, x) -> None:
    """Raises ValueError that names file and line of couplings (N, 3, 3) that are zero or have rank below three."""
    is_dead = ~(abs(np.linalg.det(x)) > LEAST_DETERMINANT * np.linalg.norm(x, axis=(1, 2)) ** 3)
    if is_dead.any():
        raise ValueError(f"{table.path}:{rows.lines[is_dead.argmax()]}: the couplings are zero or have rank below three: a coil or a channel was "
                         "dead; remove the line")


def _matrices(table, rows, kind):
    return matrices(table, rows, [kind + entry for entry in ENTRIES], EXPECTED)


def _rows_of(table):
    has = set(table.names).__contains__
    kind = "m" if has("m11") else "x"
    has_quadrature = any(has("q" + entry) for entry in ENTRIES)
    while (rows := table.next()) is not None:
        x = _matrices(table, rows, kind)
        refuse_dead(table, rows, x + 1j * _matrices(table, rows, "q") if has_quadrature else x)
        yield x


def read_couplings(path: str | os.PathLike):
    """Couplings in phase (N, 3, 3) of every row. Raises ValueError that names file and line, also for a table without rows."""
    path = os.fspath(path)
    with ByteStream(path) as stream:
        table = Table(stream)
        for entry in ENTRIES:  # also without rows
            table.column(("m" if "m11" in table.names else "x") + entry, EXPECTED)
        parts = list(_rows_of(table))
    if not parts:
        raise ValueError(f"{path}: holds no column frames")
    return np.concatenate(parts)
