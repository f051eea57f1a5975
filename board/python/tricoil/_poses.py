"""Recorded poses of any tracker: one reader for tables of poses.

read_poses() finds the format; _pose_text splits the lines, _pose_columns gives the columns their meaning, _pose_formats reads the files of
other systems. Messages name options as the program does; read_poses() gives them the names of its arguments.
"""

import dataclasses
import os
import re
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ._whole_file import MOST_BYTES, MOST_LINES, read_whole

FARTHEST_M = 20.0  # the median distance of a file whose unit is not given; a tracker, or a motion laboratory, is smaller
LARGEST_M, LARGEST_S = 1e6, 1e12  # of a position and a time; larger ones are broken numbers
NEAR_M = 3.0  # the usual distance in such a place
METRES = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254}
READER_OPTIONS = ("sensor", "unit", "time_unit", "rate_hz", "rotation", "columns")


class PoseError(ValueError):
    """A message for the user: file, line, column and what was expected."""


def content_of(name: str, largest_bytes: int = MOST_BYTES) -> bytes:
    """Of a file that is not empty; arrays of NumPy and MATLAB as a table. Raises PoseError, OSError."""
    from ._array_file import is_array_file, table_of

    try:
        data = read_whole(name, largest_bytes)
        if not data.strip():
            raise PoseError(f"{name}: is empty")
        if is_array_file(data):
            return table_of(data, name)
        if data.count(b"\n") > MOST_LINES:
            raise PoseError(f"{name}: the file is too long; at most {MOST_LINES} lines are read")
        return data
    except ValueError as error:
        raise PoseError(str(error)) from None


def refuse_others(options, known, why: str) -> None:
    """Raises PoseError for options of a command that are not known. why: "not with --plan"."""
    unknown = options.keys() - set(known)
    if unknown:
        raise PoseError(f"--{min(unknown).replace('_', '-')}: {why}")


@dataclasses.dataclass(frozen=True)
class Poses:
    """Poses of one sensor, as read_poses() returns them.

    time_s: (N,), s, increasing. position_m: (N, 3), m. quaternion_wxyz: (N, 4), unit length, sensor frame to the frame of the file; None:
    positions only. name: of the file. notes: what the reader assumed or left out, one sentence each. deviation: (N, 6), m, then rad, standard
    deviations that the file states, NaN those of attitudes that it does not; None: it states none. sensor: number or name in the file. left_out: rows without a valid pose.
    """

    time_s: NDArray
    position_m: NDArray
    quaternion_wxyz: NDArray | None = None
    name: str = "poses"
    notes: tuple[str, ...] = ()
    deviation: NDArray | None = dataclasses.field(default=None, kw_only=True)
    sensor: str = dataclasses.field(default="", kw_only=True)
    left_out: int = dataclasses.field(default=0, kw_only=True)

    def __len__(self) -> int:
        return len(self.time_s)


def checked(time_s, position_m, quaternion_wxyz, name: str, where, notes=(), *, unit_is_given: bool = False, unit_is_named: bool = False,
            deviation=None) -> Poses:
    """Poses with a rising time, finite numbers and unit quaternions; rows that are there twice are taken once.

    where: function of a row's index, "FILE:LINE". unit_is_given: by an option. unit_is_named: in the file. Throws PoseError.
    """
    notes = list(notes)
    time_s, position_m = np.asarray(time_s, float), np.asarray(position_m, float)
    q = None if quaternion_wxyz is None else np.array(quaternion_wxyz, float)

    def refuse(bad, text):
        if np.any(bad):
            n = int(np.argmax(bad))
            raise PoseError(f"{where(n)}: " + (text(n) if callable(text) else text))

    if position_m.ndim != 2 or position_m.shape[1] != 3 or time_s.shape != (len(position_m),) or (q is not None and q.shape != (len(time_s), 4)):
        raise PoseError(f"{name}: give time_s (N,), position_m (N, 3) and quaternion_wxyz (N, 4) or None")
    refuse(~np.isfinite(time_s), "the time is not a finite number")
    broken = "is not finite; leave the field empty where the marker was hidden, or remove the line"
    refuse(~np.isfinite(position_m).all(axis=1), "the position " + broken)
    refuse(abs(time_s) > LARGEST_S, lambda n: f"the time is {time_s[n]:.3g} s; at most {LARGEST_S:g} s is possible; correct it, or the unit")
    refuse((abs(position_m) > LARGEST_M).any(axis=1), lambda n: f"the position is {abs(position_m[n]).max():.3g} m away; at most {LARGEST_M:g} m is possible; correct it, or the unit")
    if q is not None:
        refuse(~np.isfinite(q).all(axis=1), "the attitude " + broken)
        length = np.linalg.norm(np.clip(q, -1e9, 1e9), axis=1)  # the square of a larger number may be infinite
        refuse(abs(length - 1) > 0.01, lambda n: f"quaternion has length {length[n]:.3f}, not 1")
        q /= length[:, None]
    if deviation is not None:
        refuse((deviation < 0).any(axis=1), "a standard deviation is negative")
        refuse(((deviation > LARGEST_M) & np.isfinite(deviation)).any(axis=1), f"a standard deviation is larger than {LARGEST_M:g}; correct it, or the unit")
    parts = position_m if q is None else np.hstack((position_m, q))
    is_repeated = (parts[1:] == parts[:-1]).all(axis=1)
    step = np.diff(time_s)
    if np.mean(is_repeated[step == 0]) < 0.5 if (step == 0).any() else len(step):
        time_s, notes = without_bursts(time_s, position_m, name, notes)
        step = np.diff(time_s)
    same = step == 0
    if same.any():
        same &= is_repeated
        keep = np.append(True, ~same)
        kept = np.flatnonzero(keep)
        time_s, position_m, q = time_s[keep], position_m[keep], None if q is None else q[keep]
        if not keep.all():
            notes.append(f"{np.sum(~keep)} rows are there twice; taken once")
        step = np.diff(time_s)
    else:
        kept = np.arange(len(time_s))
    falls = np.flatnonzero(step <= 0)
    if len(falls):
        n = falls[0]
        why = f"time does not increase (from {time_s[n]:.6f} to {time_s[n + 1]:.6f} s)"
        if any(abs(step[n] + 2**32 * unit) < 60 for unit in (1e-6, 1e-3)):
            why += "; a 32-bit counter started again: add 2^32 to the times from here on"
        elif step[n] == 0:
            why = "two poses have the same time; if they are of two sensors, give a column sensor"
        raise PoseError(f"{where(int(kept[n + 1]))}: {why}")
    if len(position_m) and not unit_is_given:
        far = float(np.median(np.linalg.norm(position_m, axis=1)))
        if far > FARTHEST_M:
            units = next(filter(None, ([unit for unit in ("in", "cm", "mm") if far * METRES[unit] < limit] for limit in (NEAR_M, FARTHEST_M))), [])
            give = "Correct it in the file" if unit_is_named else "Give it with --unit"
            mend = f"; is the unit {' or '.join(units)}? {give}" if units else "; if this is right, give --unit m"
            raise PoseError(f"{name}: the positions are {far:.4g} m away{mend}")
    return Poses(time_s, position_m, q, name, tuple(notes), deviation=None if deviation is None else deviation[kept])


def without_bursts(time_s, position_m, name, notes):
    """Times, and notes, of rows that arrived in bursts, with their own clock. Raises PoseError."""
    from ._pose_clock import of_bursts

    try:
        found = of_bursts(time_s, position_m)
    except ValueError as error:
        raise PoseError(f"{name}: {error}") from None
    return (time_s, notes) if found is None else (found[0], [*notes, found[1]])


def read_poses(
    path: str | os.PathLike,
    *,
    sensor: str | int | None = None,
    unit: str | None = None,
    time_unit: str | None = None,
    rate_hz: float | None = None,
    rotation: str | None = None,
    columns: str | Sequence[str] | None = None,
) -> Poses:
    """Reads the poses of one sensor from a file of this or of another tracker.

    path: a table with a line of names (comma, semicolon, tab or blanks; comments begin with # or %), JSON lines, Motive CSV, NDI table,
    .igs.mha (PlusToolkit) or MCAP of tricoil convert. Names are, in any order, for example time_s, x_mm, "Y (cm)", position_z, qw to qz, azimuth_deg, elevation, roll,
    rotvec_x, r11 to r33 or m11 to m44, frame, sensor, valid. sensor: its number or name, if the file has several. unit: of positions, m, cm,
    mm or in, if the file does not name it. time_unit: s, ms, us or ns, likewise. rate_hz: of the column frame, or of a file without time. rotation: how three
    angles turn: polhemus (azimuth, elevation, roll), rotvec, or axes as SciPy names them, for example ZYX; also xyzw or wxyz for q1 to q4.
    columns: names, in a list or separated by commas, of a table without a line of names; "polhemus" is sensor,x,y,z,azimuth,elevation,roll.

    Rows with empty fields, or that are marked invalid, are left out and counted in Poses.notes. Raises ValueError with file, line and column
    for anything else, and OSError if the file cannot be read. Rows that arrived in bursts get the times of the tracker's even clock.
    """
    from ._command import own_names

    try:
        return read(path, sensor=sensor, unit=unit, time_unit=time_unit, rate_hz=rate_hz, rotation=rotation, columns=columns)
    except PoseError as error:
        raise ValueError(own_names(str(error))) from None


def read(path, *, sensor=None, unit=None, time_unit=None, rate_hz=None, rotation=None, columns=None) -> Poses:
    """As read_poses(); throws PoseError with the names of the program's options."""
    from . import _pose_columns, _pose_formats, _pose_text

    if unit is not None and unit not in METRES:
        raise PoseError(f"--unit must be m, cm, mm or in; is '{unit}'")
    if time_unit is not None and time_unit not in _pose_columns.SECONDS:
        raise PoseError(f"--time-unit must be s, ms, us or ns; is '{time_unit}'")
    try:
        rate_is_good = rate_hz is None or 0 < float(rate_hz) <= 1e6
    except (TypeError, ValueError):
        rate_is_good = False
    if not rate_is_good:
        raise PoseError(f"--rate-hz must be a number, more than 0 and at most 1e6; is {rate_hz}")
    if rotation is not None:
        _pose_columns.check_rotation(str(rotation))
    if columns is not None and not isinstance(columns, str):
        columns = ",".join(map(str, columns))
    name = os.fspath(path)
    if os.path.isdir(name):
        raise PoseError(f"{name}: is a folder; give the file of poses")
    data = content_of(name)
    try:
        other = _pose_formats.find(data)
        if other is not None:
            table = other(data, name, sensor)
        elif re.match(rb"(\xef\xbb\xbf)?\s*\{", data):
            table = _pose_formats.json_lines(data, name)
        else:
            table = _pose_text.table(data, name, columns)
        return _pose_columns.poses(table, sensor=sensor, unit=unit, time_unit=time_unit, rate_hz=rate_hz, rotation=rotation)
    except PoseError:
        raise
    except (ValueError, LookupError, OverflowError, RecursionError) as error:
        raise PoseError(f"{name}: is no table of poses that can be read ({error})") from None
