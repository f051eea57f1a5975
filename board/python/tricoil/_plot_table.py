"""Columns of a table of poses that `tricoil plot` draws."""

import numpy as np
from numpy.typing import NDArray

from ._byte_stream import ByteStream
from ._table_rows import Rows, Table, cell_number, shown

UNITS = ("m", "mm", "cm", "in")
MOST_SENSORS = 4
EXPECTED = "time_s or time_us, x_m, y_m and z_m, or mm, cm or in instead of m, as that of run --out"


class _Columns:
    """Numbers of the rows; an empty cell is NaN."""

    def __init__(self, table: Table, rows: Rows):
        self._table, self._rows = table, rows

    def refuse(self, is_wrong: NDArray, says) -> None:
        """says: a function of the index of the first wrong row."""
        if is_wrong.any():
            row = int(np.argmax(is_wrong))
            raise ValueError(f"{self._table.path}:{self._rows.lines[row]}: {says(row)}")

    def get(self, name: str, default: float | None = None, may_be_missing=False) -> NDArray:
        """default: of an empty cell, or of a table without the column. may_be_missing: rows whose cell may also be NaN; else finite."""
        if name not in self._table.names:
            return np.full(len(self._rows), default)
        column = self._table.column(name, EXPECTED)
        if self._rows.values is not None:
            values = self._rows.values[:, column]
        else:
            cells = [self._rows.cells(row)[column] for row in range(len(self._rows))]
            numbers = [cell_number(cell) for cell in cells]
            self.refuse(np.array([number is None and cell != "" for number, cell in zip(numbers, cells)]),
                        lambda row: f"{name}: '{shown(cells[row])}' is not a number")
            empty = np.nan if default is None else default
            self.refuse(np.array([cell == "" for cell in cells]) & (default is None) & ~np.asarray(may_be_missing), lambda row: f"{name} is missing")
            values = np.array([empty if number is None else number for number in numbers])
        self.refuse(~np.isfinite(values) & ~np.asarray(may_be_missing), lambda row: f"{name}: {values[row]:g} is not finite; remove or repair the line")
        return values


def _rows_of(columns, unit, has_time_us, flags):
    """Sensor, time_s, valid, flags, x, y, z, standard deviation and error; NaN where they are unknown."""
    sensor, bits, valid = columns.get("sensor", 0), columns.get("flags", 0), columns.get("valid", 1) != 0
    columns.refuse(~np.isin(sensor, range(MOST_SENSORS)), lambda row: f"sensor {sensor[row]:g} must be 0 to {MOST_SENSORS - 1}")
    columns.refuse((bits < 0) | (bits >= 1 << flags) | (bits != np.floor(bits)), lambda row: f"{bits[row]:g} has unknown flags")
    position = [np.where(valid, columns.get(f"{axis}_{unit}", may_be_missing=~valid), np.nan) for axis in "xyz"]
    deviation = np.sqrt(sum(columns.get(f"std_{axis}_{unit}", np.nan, True) ** 2 for axis in "xyz"))
    time_s = 1e-6 * columns.get("time_us") if has_time_us else columns.get("time_s")
    return np.column_stack((sensor, time_s, valid, bits, *position, deviation, columns.get("error_position_m", np.nan, True)))


def read(path: str, flags: int) -> tuple[str, NDArray]:
    """Unit of the positions, and the rows. flags: number of the flags that exist. Raises ValueError with file and line."""
    with ByteStream(path) as stream:
        table = Table(stream)
        unit = next((unit for unit in UNITS if f"x_{unit}" in table.names), "m")
        has_time_us = "time_us" in table.names
        for name in (f"x_{unit}", f"y_{unit}", f"z_{unit}", "time_us" if has_time_us else "time_s"):
            table.column(name, EXPECTED)
        parts = []
        while (rows := table.next()) is not None:
            parts.append(_rows_of(_Columns(table, rows), unit, has_time_us, flags))
    if not any(part[:, 2].any() for part in parts):
        raise ValueError(f"{path}: has no valid pose to draw")
    return unit, np.concatenate(parts)
