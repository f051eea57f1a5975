"""Meaning of the columns of a table of poses: names, units, rotations, time, sensor."""

import dataclasses
import datetime
import re

import numpy as np

from ._poses import METRES, PoseError, Poses, checked
from ._pose_text import Table

SECONDS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
UNIX_FROM_S = 5e8  # 1985
LENGTH_NAMES = {"m": "m", "metre": "m", "metres": "m", "meter": "m", "meters": "m", "cm": "cm", "centimeters": "cm", "centimetres": "cm",
                "mm": "mm", "millimeters": "mm", "millimetres": "mm", "in": "in", "inch": "in", "inches": "in"}
TIME_NAMES = {"s": "s", "sec": "s", "secs": "s", "second": "s", "seconds": "s", "ms": "ms", "msec": "ms", "milliseconds": "ms", "us": "us",
              "µs": "us", "μs": "us", "usec": "us", "microseconds": "us", "ns": "ns", "nsec": "ns", "nanoseconds": "ns"}
ANGLE_NAMES = {"deg": "deg", "degree": "deg", "degrees": "deg", "°": "deg", "rad": "rad", "radian": "rad", "radians": "rad"}
UNITS = {**LENGTH_NAMES, **TIME_NAMES, **ANGLE_NAMES}

PLACE = r"(?:pos|position|p|t|trans|translation|location|pose[._]position|pose[._]pose[._]position)"
TURN = r"(?:q|quat|quaternion|rot|rotation|orientation|pose[._]orientation|pose[._]pose[._]orientation)"
EULER = {"azimuth": 0, "az": 0, "yaw": 0, "psi": 0, "elevation": 1, "el": 1, "pitch": 1, "theta": 1, "roll": 2, "ro": 2, "phi": 2}
TIMES = r"time|t|timestamp|time[._ ]?stamp|unix[._ ]?time|utc|clock|date[._ ]?time|elapsed(?:[._ ]time)?|header[._]stamp"
FRAMES = r"frame|frame[._ ]?(?:number|no|id|index|#)?|sample|sample[._ ]?(?:number|no)|fno|index"
SENSORS = r"sensor|station|tool|tools|body|rigid[._ ]?body|handle|port|device|marker|sensor[._ ]?(?:id|number|no|name)"
OWN_ATTITUDE = re.compile(r"(true|std|cov|error|predicted|v|w)_")  # of tricoil's own columns that are no pose


def split_unit(name):
    """("x", "mm") of x_mm, X [mm], "x (mm)" and x.mm; the unit is "" if there is none."""
    text = name.strip().lower()
    found = re.fullmatch(r"(.+?)\s*[\[(]\s*([^\])]*)\s*[\])]", text) or re.fullmatch(r"(.+?)[_. /]+([a-zµμ°]+)", text)
    if found and found[2].strip(".") in UNITS:
        return found[1].strip(), UNITS[found[2].strip(".")]
    return text, ""


def role_of(name):
    """(role, unit) of a column; role: ("position", 0..2), ("quaternion", letter), ("angle", 0..2), ("turn", 0..2), ("matrix", row, column)..."""
    text, unit = split_unit(name)
    if OWN_ATTITUDE.match(text):
        return None, ""
    if found := re.fullmatch(rf"(?:{PLACE}[._ ]?)?([xyz])", text):
        return ("position", "xyz".index(found[1])), unit
    if found := re.fullmatch(rf"{TURN}[._ ]?([wxyz0-4])", text):
        return ("quaternion", found[1]), unit
    if text == "w":
        return ("quaternion", "w"), unit
    if found := re.fullmatch(r"(?:rotvec|rotation[._ ]?vector|rv)[._ ]?([xyz])", text):
        return ("vector", "xyz".index(found[1])), unit
    if found := re.fullmatch(r"(?:r|euler|angle)[._ ]?([xyz123])", text):
        return ("turn", "xyz123".index(found[1]) % 3), unit
    if text in EULER:
        return ("euler", EULER[text]), unit
    if found := re.fullmatch(r"(?:r|m|rot|matrix)[._ ]?\[?([0-4])[._, ]?([0-4])\]?", text):
        return ("matrix", int(found[1]), int(found[2])), unit
    for role, names in (("time", TIMES), ("frame", FRAMES), ("sensor", SENSORS), ("valid", r"valid|status|state|quality|tracked")):
        if re.fullmatch(names, text):
            return (role,), unit
    return None, ""


class Columns:
    """Columns of a table by role. Two columns of one role are refused, except times, of which the one with a unit is used."""

    def __init__(self, table: Table):
        self.table, self.of, self.unit = table, {}, {}
        for n, name in enumerate(table.columns):
            role, unit = role_of(name)
            if role is None:
                continue
            if role in self.of and role[0] in ("time", "frame", "sensor", "valid"):
                is_nearer = role == ("time",) and unit and not self.unit[role]
                if is_nearer or role == ("sensor",) and name.strip().lower().startswith(("sensor", "station")):
                    self.of[role], self.unit[role] = n, unit
                continue
            if role in self.of:
                raise PoseError(f"{table.name}: columns {table.columns[self.of[role]]} and {name} have the same meaning; remove one")
            self.of[role], self.unit[role] = n, unit
        self.angles_by_axis()

    def angles_by_axis(self):
        """rotation_x to rotation_z, or orientation_x to orientation_z, without a w are three angles."""
        of = {role: n for role, n in self.of.items() if role[0] == "quaternion"}
        if set(of) != {("quaternion", axis) for axis in "xyz"} or any(self.table.columns[n].strip().lower().startswith("q") for n in of.values()):
            return
        for n, axis in enumerate("xyz"):
            self.of["turn", n], self.unit["turn", n] = self.of.pop(("quaternion", axis)), self.unit.pop(("quaternion", axis))

    def has(self, *role):
        return role in self.of

    def all(self, kind, keys):
        return [self.of[(kind, key)] for key in keys] if all((kind, key) in self.of for key in keys) else None

    def units(self, kind):
        return {self.unit[role] for role in self.of if role[0] == kind and self.unit[role]}


def choose_sensor(table, columns, sensor):
    """The rows of a sensor, and its number or name. Throws PoseError."""
    if not columns.has("sensor"):
        if sensor is not None and "sensor" not in table.units:
            raise PoseError(f"{table.name}: has no column sensor; leave --sensor out")
        return table, table.units.get("sensor", "")
    texts = table.fields[columns.of[("sensor",)]]

    def plain(text):
        whole = re.fullmatch(r"([0-9]+)(\.0*)?", str(text))  # also 1.0, as tables of floating-point numbers have it
        return str(int(whole[1])) if whole else str(text).lower()

    broken = next((n for n, text in enumerate(texts) if re.fullmatch(r"[0-9]*\.[0-9]*[1-9][0-9]*", text)), None)
    if broken is not None:
        raise PoseError(f"{table.where(broken)}: '{texts[broken][:24]}' in column {table.columns[columns.of[('sensor',)]]} must be a whole number or a name")
    names = sorted({plain(text) for text in texts})
    if sensor is None:
        if len(names) == 1:
            return table, names[0]
        shown = ", ".join(names[:6]) + (", ..." if len(names) > 6 else "")
        raise PoseError(f"{table.name}: has the sensors {shown}; choose one with --sensor")
    rows = [n for n, text in enumerate(texts) if plain(text) == plain(sensor)]
    if not rows:
        raise PoseError(f"{table.name}: has no sensor {sensor}; it has {', '.join(names[:6])}")
    return table.taken(rows), plain(sensor)


INVALID = ("0", "false", "no", "missing", "disabled", "invalid", "lost", "not tracked", "not_tracked", "bad")


def without_invalid(table, columns, used):
    """The table without rows that are marked invalid, or that have no position or attitude."""
    keep = np.ones(len(table), bool)
    if columns.has("valid") and not role_is_state(table, columns):
        keep &= np.array([text.lower() not in INVALID for text in table.fields[columns.of[("valid",)]]], bool)
    _, some = table.empty(used)
    keep &= ~some
    left_out = int(np.sum(~keep))
    if left_out:
        table = dataclasses.replace(table.taken(np.flatnonzero(keep)), left_out=left_out)
        table.notes.append(f"{left_out} rows without a valid pose are left out")
    return table


def role_is_state(table, columns):
    """True if the column is tricoil's excitation state, a number that says nothing about validity."""
    name = table.columns[columns.of[("valid",)]].lower()
    texts = table.fields[columns.of[("valid",)]]
    return name in ("state", "status", "quality") and all(re.fullmatch(r"[0-9.]+", text) for text in texts[:50])


def agreed_unit(table, option, given, of_file, column):
    """The unit of a column: the one that the file names, or the given one. They may not differ. Throws PoseError."""
    if given and of_file and given != of_file:
        raise PoseError(f"{table.name}: column {table.columns[column]} is in {of_file}, not {given}; leave {option} out, or with two files give one for each, separated by a comma")
    return of_file or given


def times(table, columns, time_unit, rate_hz):
    """Time of each row, s."""
    if columns.has("time"):
        n = columns.of[("time",)]
        texts = table.fields[n]
        if texts and re.match(r"[0-9]+[-:/.][0-9]+[-:/.][0-9]", texts[0]):
            agreed_unit(table, "--time-unit", time_unit, "dates", n)
            return iso_times(table, n)
        numbers = table.numbers(n)
        unit = agreed_unit(table, "--time-unit", time_unit, columns.unit[("time",)], n) or guessed_time_unit(table, numbers, n)
        return exact_times(table, n, SECONDS[unit])
    rate_hz = rate_hz or table.rate_hz
    if columns.has("frame"):
        if rate_hz is None:
            raise PoseError(f"{table.name}: has frame numbers but no time; give their rate with --rate-hz")
        return table.numbers(columns.of[("frame",)]) / float(rate_hz)
    if rate_hz is None:
        raise PoseError(f"{table.name}: has no column of time (time_s, time_ms, time_us, timestamp, frame); give --rate-hz if its rows are equally spaced")
    return np.arange(len(table)) / float(rate_hz)


def exact_times(table, column, seconds):
    """Times in s. Nanoseconds since 1970 do not fit a floating-point number: whole numbers are read as such."""
    texts = table.fields[column]
    if seconds < 1 and texts and all(re.fullmatch(r"[-+]?[0-9]+", text) for text in texts):
        per_s = round(1 / seconds)
        return np.array([int(text) // per_s + int(text) % per_s / per_s for text in texts])
    return table.numbers(column) * seconds


def guessed_time_unit(table, numbers, column):
    """Of a time without a unit: by its size if it counts from 1970, otherwise s if the rate is one of a tracker."""
    if len(numbers) < 2:
        return "s"
    largest, step = float(np.nanmax(abs(numbers))), float(np.median(np.diff(numbers)[np.diff(numbers) > 0] if np.any(np.diff(numbers) > 0) else [1]))
    for unit, seconds in SECONDS.items():
        if UNIX_FROM_S < largest * seconds < 1e10 and 1e-5 <= step * seconds <= 2:
            table.notes.append(f"column {table.columns[column]} is read as Unix time in {unit}")
            return unit
    if 1e-4 <= step <= 0.5:
        table.notes.append(f"column {table.columns[column]} is read as seconds")
        return "s"
    raise PoseError(f"{table.name}: column {table.columns[column]} has no unit, and its steps of {step:g} are no seconds; give --time-unit")


def iso_times(table, column):
    seconds = []
    for row, text in enumerate(table.fields[column]):
        try:
            day = "1970-01-01T" + "0" * (text.find(":") == 1) if re.match(r"[0-9]{1,2}:", text) else ""  # a time of the day
            whole, _, rest = re.fullmatch(r"([^.,]*)([.,]?)(.*)", day + text.replace("Z", "+00:00")).groups()
            fraction = re.match(r"[0-9]*", rest)[0]
            moment = datetime.datetime.fromisoformat(whole.replace(" ", "T", 1) + rest[len(fraction):])
            moment = moment if moment.tzinfo else moment.replace(tzinfo=datetime.timezone.utc)
            seconds.append(moment.timestamp() + float("0." + (fraction or "0")))
        except ValueError:
            raise PoseError(f"{table.where(row)}: '{text[:32]}' in column {table.columns[column]} is no time of the day (10:00:00.5) and no ISO time (2025-11-28T10:00:00.5Z)") from None
    return np.array(seconds)


def check_rotation(rotation):
    """Throws PoseError for an unknown --rotation, also if the file needs none."""
    is_axes = re.fullmatch("[XYZ]{3}|[xyz]{3}", rotation) and rotation[0] != rotation[1] != rotation[2]
    if not is_axes and rotation not in ("polhemus", "rotvec", "wxyz", "xyzw"):
        raise PoseError(f"--rotation must be polhemus, rotvec, wxyz, xyzw, or three axes such as ZYX (each about the turned axes) or xyz (about fixed axes); is '{rotation}'")


def rotation_columns(columns, rotation):
    """(kind, columns) of the attitude; (None, []) if there are only positions."""
    table = columns.table
    for keys in ("wxyz", "0xyz", "0123"):
        if (found := columns.all("quaternion", keys)) is not None:
            return "wxyz", found
    if (found := columns.all("quaternion", "1234")) is not None:
        if rotation not in ("wxyz", "xyzw"):
            raise PoseError(f"{table.name}: columns q1 to q4: give their order with --rotation wxyz or xyzw")
        return rotation, found
    kinds = {role[0] for role in columns.of}
    if "quaternion" in kinds:
        names = ", ".join(table.columns[n] for role, n in columns.of.items() if role[0] == "quaternion")
        raise PoseError(f"{table.name}: of the quaternion there is only {names}; qw, qx, qy and qz are needed")
    first = 0 if any(role[0] == "matrix" and 0 in role[1:] for role in columns.of) else 1
    if "matrix" in kinds:
        found = [columns.of.get(("matrix", row, column)) for row in range(first, first + 3) for column in range(first, first + 3)]
        if None in found:
            raise PoseError(f"{table.name}: the matrix needs the nine columns r11 to r33, or m11 to m44")
        return "matrix", found
    for kind in ("vector", "euler", "turn"):
        if (found := columns.all(kind, range(3))) is None:
            continue
        if kind == "turn" and rotation in (None, "wxyz", "xyzw"):
            raise PoseError(f"{table.name}: columns {', '.join(table.columns[n] for n in found)}: say how they turn with --rotation: rotvec, polhemus or axes such as ZYX")
        return {"vector": "rotvec", "euler": "ZYX", "turn": "ZYX" if rotation == "polhemus" else rotation}[kind], found
    some = [table.columns[n] for role, n in columns.of.items() if role[0] in ("vector", "euler", "turn")]
    if some:
        raise PoseError(f"{table.name}: of three angles there is only {', '.join(some)}; name all three, for example azimuth, elevation and roll, or rename what is none")
    return None, []


def quaternions(table, columns, kind, found):
    """Quaternions (w, x, y, z) of the attitude's columns. SciPy is loaded for other attitudes than quaternions only."""
    values = np.stack([table.numbers(n) for n in found], axis=1)
    bad = ~np.isfinite(values).all(axis=1)
    if bad.any():
        row = int(np.argmax(bad))
        raise PoseError(f"{table.where(row)}: the attitude is not finite; leave the field empty where the marker was hidden, or remove the line")
    if kind in ("wxyz", "xyzw"):
        return values if kind == "wxyz" else values[:, [3, 0, 1, 2]]
    if kind == "matrix":
        return of_matrices(table, values.reshape(-1, 3, 3))
    from scipy.spatial.transform import Rotation

    from ._rotation import wxyz

    units = {unit for role, unit in columns.unit.items() if columns.of[role] in found and unit}
    if len(units) > 1:
        raise PoseError(f"{table.name}: angles in {' and '.join(sorted(units))}; give one unit")
    unit = next(iter(units), "rad" if kind == "rotvec" else "deg")
    if not units:
        table.notes.append(f"angles without a unit are read as {unit}")
    values = np.radians(values) if unit == "deg" else values
    if kind == "rotvec":
        turned = Rotation.from_rotvec(values)
    else:
        turned = Rotation.from_euler(kind, values)
    return wxyz(turned)


def of_matrices(table, matrices):
    from scipy.spatial.transform import Rotation

    from ._rotation import wxyz

    matrices = np.clip(matrices, -1e9, 1e9)  # the square of a larger number may be infinite
    square = abs(matrices @ matrices.transpose(0, 2, 1) - np.eye(3)).max(axis=(1, 2))
    for bad, why in ((square > 0.02, "the matrix is no rotation: its rows are not orthogonal unit vectors"),
                     (np.linalg.det(matrices) < 0, "the matrix is a reflection: these data are left-handed; change the sign of one axis in positions and attitudes")):
        if bad.any():
            raise PoseError(f"{table.where(int(np.argmax(bad)))}: {why}")
    return wxyz(Rotation.from_matrix(matrices))


def position_columns(columns):
    table = columns.table
    if (found := columns.all("position", range(3))) is not None:
        return found
    last = 3 if any(role[0] == "matrix" and 0 in role[1:] for role in columns.of) else 4
    first = last - 3
    if all(("matrix", row, last) in columns.of for row in range(first, last)):
        return [columns.of[("matrix", row, last)] for row in range(first, last)]
    raise PoseError(f"{table.name}: no column {'xyz'[[columns.has('position', n) for n in range(3)].index(False)]}_m; poses have x_m, y_m and z_m, "
                    "or mm, cm or in instead of m")


def deviations(table):
    """Standard deviations (N, 6), m, then rad, of tricoil's own columns, NaN without those of the attitude; None: the file does not have those
    of the position for every pose."""
    names = [text.strip().lower() for text in table.columns]

    def columns(unit, prefix):
        at = [names.index(name) for name in (f"{prefix}{axis}_{unit}" for axis in "xyz") if name in names]
        if len(at) < 3 or table.empty(at)[1].any():
            return np.full((1, 3), np.nan)
        return np.stack([table.numbers(n) for n in at], axis=1)

    for unit, metres in METRES.items():
        position_m = metres * columns(unit, "std_")
        if np.isfinite(position_m).all():
            return np.hstack((position_m, np.broadcast_to(columns("rad", "std_r"), position_m.shape)))
    return None


def poses(table: Table, *, sensor, unit, time_unit, rate_hz, rotation) -> Poses:
    """Poses of the table. Throws PoseError."""
    columns = Columns(table)
    at_position = position_columns(columns)
    kind, at_rotation = rotation_columns(columns, rotation)
    if not len(table):
        raise PoseError(f"{table.name}: has no poses")
    table, chosen = choose_sensor(table, columns, sensor)
    table = without_invalid(table, columns, at_position + at_rotation)
    if not len(table):
        raise PoseError(f"{table.name}: has no valid pose")
    units = columns.units("position")
    if len(units) > 1:
        raise PoseError(f"{table.name}: positions in {' and '.join(sorted(units))}; give one unit")
    of_file = next(iter(units), table.units.get("length"))
    used = agreed_unit(table, "--unit", unit, of_file, at_position[0])
    if used is None:
        table.notes.append("positions without a unit are read as m")
    position_m = METRES[used or "m"] * np.stack([table.numbers(n) for n in at_position], axis=1)
    q = quaternions(table, columns, kind, at_rotation) if kind else None
    found = checked(times(table, columns, time_unit, rate_hz), position_m, q, table.name, table.where, table.notes, unit_is_given=unit is not None,
                    unit_is_named=of_file is not None, deviation=deviations(table))
    return dataclasses.replace(found, sensor=chosen, left_out=table.left_out)
