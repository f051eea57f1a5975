"""Holes of a measurement board: names and positions, from CSV or from the landmarks of a PlusToolkit configuration."""

import dataclasses
import re

import numpy as np
from numpy.typing import NDArray

from ._pose_columns import split_unit
from ._pose_text import table
from ._poses import METRES, PoseError, content_of
from ._xml_file import root_of

LARGEST_BYTES = 10_000_000
LEAST_HOLES = 3


@dataclasses.dataclass(frozen=True)
class Board:
    """names: of the holes. position_m: (N, 3), m, in the frame of the board. notes: what the reader assumed."""

    name: str
    names: list[str]
    position_m: NDArray
    notes: tuple[str, ...] = ()

    def at(self, names: list[str]) -> NDArray:
        """Index of each name. Raises PoseError."""
        unknown = [name for name in names if name not in self.names]
        if unknown:
            raise PoseError(f"--holes: {self.name} has no hole {unknown[0]}; it has {', '.join(self.names[:8])}")
        return np.array([self.names.index(name) for name in names])


def of_xml(data: bytes, name: str) -> tuple[list[str], NDArray]:
    """Elements Landmark with Name and Position, mm."""
    root = root_of(data, name)
    found = [(one.get("Name", ""), (one.get("Position") or "").split()) for one in root.iter("Landmark")]
    if not found:
        raise PoseError(f"{name}: has no element Landmark; a PhantomDefinition of PlusToolkit has them")
    for landmark, words in found:
        if len(words) != 3:
            raise PoseError(f"{name}: the Position of Landmark {landmark} must be three numbers; is '{' '.join(words)[:40]}'")
    try:
        return [landmark for landmark, _ in found], 1e-3 * np.array([words for _, words in found], float)
    except ValueError:
        raise PoseError(f"{name}: the Position of a Landmark is not a number") from None


def of_table(data: bytes, name: str) -> tuple[list[str], NDArray, list[str]]:
    """Columns name, x, y, z, with the unit in their names, or mm."""
    rows = table(data, name)
    columns = {split_unit(text)[0]: (n, split_unit(text)[1]) for n, text in enumerate(rows.columns)}
    missing = [axis for axis in "xyz" if axis not in columns]
    if missing:
        raise PoseError(f"{name}: no column {missing[0]}_mm; a board has name, x_mm, y_mm and z_mm, or m, cm or in instead of mm")
    units = {columns[axis][1] for axis in "xyz"}
    if len(units) > 1 or not units <= {"", *METRES}:
        raise PoseError(f"{name}: the unit of x, y and z must be one of m, cm, mm and in")
    unit = units.pop()
    positions = METRES[unit or "mm"] * np.stack([rows.numbers(columns[axis][0]) for axis in "xyz"], axis=1)
    label = next((columns[key][0] for key in ("name", "hole", "point", "landmark", "id") if key in columns), None)
    names = [str(n + 1) for n in range(len(rows))] if label is None else rows.fields[label]
    return names, positions, [] if unit else [f"{name}: positions without a unit are read as mm"]


def read_board(path: str) -> Board:
    """Reads a board. Raises PoseError, OSError."""
    data = content_of(path, LARGEST_BYTES)
    notes = []
    if re.match(rb"(\xef\xbb\xbf)?\s*<", data):
        names, position_m = of_xml(data, path)
    else:
        names, position_m, notes = of_table(data, path)
    if len(names) < LEAST_HOLES:
        raise PoseError(f"{path}: has {len(names)} holes; at least {LEAST_HOLES} are needed; a line that begins with # is a comment: put such a name in quotation marks")
    if not np.isfinite(position_m).all():
        raise PoseError(f"{path}: a position is not finite")
    double = next((name for n, name in enumerate(names) if name in names[:n]), None)
    if double is not None:
        raise PoseError(f"{path}: hole {double} is there twice; give each its own name")
    return Board(path, names, position_m, tuple(notes))
