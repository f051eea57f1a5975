"""Couplings of two bands that were recorded at the same time, and the calibration of both bands' coils."""

import json
import math
import re

import numpy as np
from numpy.typing import NDArray

from ._byte_stream import ByteStream
from ._coil_model import Coils
from ._coupling_table import matrices, refuse_dead
from ._table_rows import Table

MOST_CALIBRATION_BYTES = 1 << 20
COUPLING_UNIT = 2 / 250  # the files' field has no factor 1/2, and couplings are divided by 250
LEAST_VOLUME = 1e-3  # of three vectors, relative to the product of their lengths
FARTHEST_M = 1.0  # coil from the origin of its frame
COLUMNS = [f"source{j}_sensor{i}" for j in "123" for i in "123"]
X_COLUMNS = [f"x{i}{j}" for j in "123" for i in "123"]
EXPECTED = "source1_sensor1,source1_sensor2,...,source3_sensor3, or x11,...,x33 (xij: sensor coil i, source coil j)"


def _text(path):
    data = b""
    with ByteStream(path) as stream:
        while chunk := stream.read():
            data += chunk
            if len(data) > MOST_CALIBRATION_BYTES:
                raise ValueError(f"{path}: is longer than {MOST_CALIBRATION_BYTES} bytes; is it the right file?")
    return data.decode("utf-8-sig", errors="replace")


class _NoNumber(Exception):
    """NaN or infinity, which Python's reader of JSON would take."""


def _refuse_constant(_):
    raise _NoNumber


def _parsed(path):
    """Raises ValueError that names file and line."""
    text = _text(path)

    def number(word):
        if not math.isfinite(value := float(word)):
            raise ValueError(f"{path}: a number is too large")
        return value

    def refusal(at, says):
        return ValueError(f"{path}:{1 + text.count(chr(10), 0, at)}: {says}")

    no_json = "is not JSON; NaN and infinity are not numbers of JSON"
    try:
        return json.loads(text, parse_float=number, parse_int=number, parse_constant=_refuse_constant)
    except json.JSONDecodeError as error:
        is_cut = error.msg.startswith("Unterminated string") or text[error.pos:].strip() in ("", "-")
        raise (refusal(len(text), "the JSON ends too early") if is_cut else refusal(error.pos, no_json)) from None
    except _NoNumber:
        words = re.finditer(r'"(?:[^"\\]|\\.)*"|NaN|-?Infinity', text)
        raise refusal(next(word.start() for word in words if word[0][0] != '"'), no_json) from None
    except RecursionError:
        raise ValueError(f"{path}: the JSON is nested too deeply") from None


def _rows(path, band, name, key):
    """Three numbers for each of three coils, (3, 3)."""
    if key not in band:
        raise ValueError(f"{path}: '{name}.{key}' is missing")
    rows = band[key]
    if not (isinstance(rows, list) and len(rows) == 3 and all(isinstance(row, list) and len(row) == 3 for row in rows)
            and all(isinstance(value, float) for row in rows for value in row)):
        raise ValueError(f"{path}: '{name}.{key}' must hold finite numbers: three for each of three coils")
    return np.array(rows)


@np.errstate(over="ignore")
def _is_independent(rows):
    return abs(np.linalg.det(rows)) > LEAST_VOLUME * np.prod(np.linalg.norm(rows, axis=1))


def _coils(path, root, name):
    band = root.get(name)
    if not isinstance(band, dict):
        raise ValueError(f"{path}: '{name}' is missing; the calibration of both bands is needed")
    source_m, moment, sensor_m, sensitivity = (_rows(path, band, name, key) for key in ("source_pos", "source_moment", "sensor_pos", "sensor_moment"))
    if not _is_independent(moment) or not _is_independent(sensitivity):
        raise ValueError(f"{path}: '{name}': calibration: moments or sensitivities are linearly dependent")
    if max(abs(source_m).max(), abs(sensor_m).max()) > FARTHEST_M:
        raise ValueError(f"{path}: '{name}': calibration: a coil offset exceeds 1 m; offsets are in metres")
    return Coils(source_m, COUPLING_UNIT * moment, sensor_m, sensitivity)


def read_coils(path: str) -> tuple[Coils, Coils]:
    """Coils of the high and the low band, in the same source and sensor frames.

    JSON with the objects "high" and "low", each with source_pos, source_moment, sensor_pos, sensor_moment: lists of three coils, each [x, y, z]; positions
    in m. Coupling = B . n / 250, B = (3 (m.u) u - m) / r^3; m, n: moments of source and sensor coil; u: direction from source to sensor coil. Raises
    ValueError, naming file and key."""
    root = _parsed(path)
    if not isinstance(root, dict):
        raise ValueError(f"{path}: is not a JSON object with the calibrations 'high' and 'low'")
    return _coils(path, root, "high"), _coils(path, root, "low")


def read_band(path: str) -> NDArray:
    """Couplings (N, 9), real and signed, source coil by source coil, of a table with the header source1_sensor1,source1_sensor2,...,source3_sensor3, or
    x11,...,x33. Raises ValueError, naming file and line."""
    parts = []
    with ByteStream(path) as stream:
        table = Table(stream)
        names = X_COLUMNS if "x11" in table.names else COLUMNS
        for name in names:  # also without rows
            table.column(name, EXPECTED)
        while (rows := table.next()) is not None:
            x = matrices(table, rows, names, EXPECTED)
            refuse_dead(table, rows, x)
            parts.append(x.reshape(-1, 9))
    if not parts:
        raise ValueError(f"{path}: holds a header but no couplings")
    return np.concatenate(parts)


def read_bands(high: str, low: str, ratio: int) -> tuple[NDArray, NDArray]:
    """Couplings of the high band (N, 9) and of the low band (ceil(N / ratio), 9); line k of the low band has the time of line k * ratio of the high band. Raises
    ValueError as read_band, and if the numbers of lines do not fit the ratio."""
    of_high, of_low = read_band(high), read_band(low)
    needed = -(-len(of_high) // ratio)
    if len(of_low) != needed:
        raise ValueError(f"--ratio {ratio}: {high} has {len(of_high)} lines, so {low} must have {needed}, but has {len(of_low)}")
    return of_high, of_low
