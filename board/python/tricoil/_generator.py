"""Generator of N source coils for sensors of one coil: its file, its field."""

import dataclasses
import json
import os
import re

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _tricoil
from ._model import _finite, _numbers, _rows
from ._whole_file import MOST_TOML_BYTES, read_whole

MOST_COILS = 16
FILE_KEYS, COIL_KEYS = ("coil", "sensor", "crosstalk", "left_handed_stage"), ("name", "position_m", "moment", "octupole_m2", "misfit")
SENSOR_KEYS = ("number", "gain", "gain_deviation", "offset_m", "axis")
GAIN_DEVIATION = 2e-3  # of a known gain, relative
LONG_KEY = re.compile(rb"""(?<![\w-])(?:(?:[\w-]+|"[^"\n]*"|'[^'\n]*')[ \t]*\.[ \t]*){16}""")  # tomllib's time grows with the square of the parts
PLANAR_TURN = 2.4  # rad between the moments of neighbouring coils of the planar generator


@dataclasses.dataclass(frozen=True)
class SensorCoil:
    """A calibrated sensor coil. gain: of the coil, in the units of the couplings. offset_m, axis: of the coil in the body on which it is fixed,
    (3,); None: the calibration had the poses of the coil itself. gain_deviation: standard deviation of the gain, relative."""

    gain: float
    offset_m: NDArray | None = None
    axis: NDArray | None = None
    gain_deviation: float = GAIN_DEVIATION


@dataclasses.dataclass(frozen=True)
class Generator:
    """N source coils, at most 16, in the generator frame.

    position_m: (N, 3). moment: (N, 3), coupling units times m^3. octupole_m2: (N,), of coils of finite size: length^2/24 - radius^2/8.
    crosstalk: (N, N); couplings plus crosstalk times couplings are those of the coils alone. misfit: (N,), what the calibration does not
    explain, standard deviation relative to the norm of the N couplings. sensors: by number. left_handed_stage: the stage of the calibration
    counts angles in the left-handed sense. Raises ValueError for other shapes and coils without a moment.
    """

    names: tuple[str, ...]
    position_m: NDArray
    moment: NDArray
    octupole_m2: NDArray = None  # type: ignore[assignment]
    crosstalk: NDArray = None  # type: ignore[assignment]
    misfit: NDArray = None  # type: ignore[assignment]
    sensors: dict[int, SensorCoil] = dataclasses.field(default_factory=dict)
    left_handed_stage: bool = False

    def __post_init__(self):
        count = len(self.names)
        if not 1 <= count <= MOST_COILS:
            raise ValueError(f"a generator has 1 to {MOST_COILS} coils; there are {count}")
        if len(set(self.names)) != count:
            raise ValueError(f"two coils of the generator are named {max(self.names, key=self.names.count)}")
        for name, shape in (("position_m", (count, 3)), ("moment", (count, 3)), ("octupole_m2", (count,)), ("crosstalk", (count, count)), ("misfit", (count,))):
            value = getattr(self, name)
            try:
                value = np.zeros(shape) if value is None else _numbers(name, value)
            except TypeError as error:
                raise ValueError(f"{name} of the generator: {error}") from None
            if value.shape != shape or not np.all(np.isfinite(value)) or (name == "misfit" and (value < 0).any()):
                raise ValueError(f"{name} of the generator: finite numbers of shape {shape} are needed{', not negative' if name == 'misfit' else ''}; has shape {value.shape}")
            object.__setattr__(self, name, value)
        for name, moment in zip(self.names, self.moment):
            if not moment.any():
                raise ValueError(f"coil {name} of the generator has no moment")

    def __len__(self) -> int:
        return len(self.names)

    def coils(self) -> NDArray:
        """(N, 7): position, moment, octupole."""
        return np.column_stack((self.position_m, self.moment, self.octupole_m2))

    def field(self, position_m: NDArray, sensitivity: NDArray) -> NDArray:
        """(M, N, 7): couplings of the coils alone, their gradients with respect to position and sensitivity. Arguments: (M, 3) both."""
        p, n = np.ascontiguousarray(position_m, float), np.ascontiguousarray(sensitivity, float)
        if p.ndim != 2 or p.shape[1] != 3 or p.shape != n.shape:
            raise ValueError(f"position_m, sensitivity: have shapes {p.shape} and {n.shape}; give the same shape (M, 3)")
        return _tricoil.generator_couplings(self.coils(), p, n)

    def couplings(self, position_m: ArrayLike, axis: ArrayLike, gain: ArrayLike = 1.0) -> NDArray:
        """Couplings (M, N), as they are measured, of a sensor coil at positions (M, 3) with unit axes (M, 3), generator frame. gain: a number or
        (M,). Arguments of one row are those of all rows. Raises ValueError for other shapes."""
        positions, axes = (_finite(name, _rows(name, value, (3,))[0]) for name, value in (("position_m", position_m), ("axis", axis)))
        gains = _finite("gain", np.atleast_1d(_numbers("gain", gain)))
        count = next((n for n in (len(positions), len(axes), len(gains)) if n != 1), 1)
        if gains.ndim != 1 or {len(positions), len(axes), len(gains)} - {1, count}:
            raise ValueError(f"position_m, axis and gain have {len(positions)}, {len(axes)} and {gains.size} rows; give the same number, or one")
        positions, sensitivities = (np.broadcast_to(value, (count, 3)) for value in (positions, axes * gains[:, None]))
        alone = self.field(positions, sensitivities)[:, :, 0]
        return alone @ np.linalg.inv(np.eye(len(self)) + self.crosstalk).T

    def of_coils(self, couplings: NDArray) -> NDArray:
        """Couplings (M, N) of the coils alone, from measured ones."""
        return couplings + couplings @ self.crosstalk.T


def planar_generator(coils: int = 8, size_m: float = 0.3, moment: float = 5e-3) -> Generator:
    """A planar generator: coils around the edge of a square, their moments half upwards, half in turning directions of the plane. A generator
    whose moments are all upwards has equal fields on both sides."""
    turn = np.arange(coils) * 2 * np.pi / coils
    square = size_m / 2 / np.maximum(abs(np.cos(turn)), abs(np.sin(turn)))
    place = np.column_stack((square * np.cos(turn), square * np.sin(turn), np.zeros(coils)))
    along = np.arange(coils) * PLANAR_TURN
    moments = moment * np.sqrt(0.5) * np.column_stack((np.cos(along), np.sin(along), np.ones(coils)))
    return Generator(tuple(f"c{n + 1}" for n in range(coils)), place, moments)


def _line(name, values):
    return f"{name} = [{', '.join(f'{v:.9g}' for v in values)}]\n"


def _basic_string(text):
    """Of TOML: as of JSON, but DEL is escaped too."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def to_toml(generator: Generator) -> str:
    """The file that read_generator() reads."""
    text = "# Generator: coils in the generator frame. moment: coupling units times m^3.\n"
    if generator.left_handed_stage:
        text += "left_handed_stage = true\n"
    if generator.crosstalk.any():
        text += "crosstalk = [\n" + "".join("  [" + ", ".join(f"{v:.6g}" for v in row) + "],\n" for row in generator.crosstalk) + "]\n"
    for n, name in enumerate(generator.names):
        text += f'\n[[coil]]\nname = {_basic_string(name)}\n' + _line("position_m", generator.position_m[n]) + _line("moment", generator.moment[n])
        text += f"octupole_m2 = {generator.octupole_m2[n]:.6g}\nmisfit = {generator.misfit[n]:.4g}\n"
    for number, sensor in sorted(generator.sensors.items()):
        text += f"\n[[sensor]]\nnumber = {number}\ngain = {sensor.gain:.9g}\ngain_deviation = {sensor.gain_deviation:.4g}\n"
        if sensor.offset_m is not None and sensor.axis is not None:
            text += _line("offset_m", sensor.offset_m) + _line("axis", sensor.axis)
    return text


def _refuse_unknown(path, table, where, known):
    for key in table:
        if key not in known:
            raise ValueError(f"{path}: {where}: unknown key {key}; known are {', '.join(known)}")


def _is_number(value):
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def _crosstalk(path, rows, count):
    if rows is None:
        return None
    if not (isinstance(rows, list) and len(rows) == count and all(isinstance(row, list) and len(row) == count and all(map(_is_number, row)) for row in rows)):
        raise ValueError(f"{path}: crosstalk must be {count} rows of {count} numbers")
    return np.array(rows, float)


def _value(path, table, key, size=None, default=None):
    value = table.get(key, default)
    array = np.array(value, float) if all(map(_is_number, value if isinstance(value, list) else [value])) else np.array(np.nan)
    if array.shape != (() if size is None else (size,)) or not np.all(np.isfinite(array)):
        raise ValueError(f"{path}: {table.get('name', table.get('number', 'a table'))}: {key} must be {'a number' if size is None else f'{size} numbers'}")
    return array if size else float(array)


def _sensor(path, table):
    _refuse_unknown(path, table, "[[sensor]]", SENSOR_KEYS)
    number, gain = table.get("number"), _value(path, table, "gain")
    if not isinstance(number, int) or isinstance(number, bool) or gain <= 0:
        raise ValueError(f"{path}: [[sensor]] needs a whole number and a positive gain")
    if ("offset_m" in table) != ("axis" in table):
        raise ValueError(f"{path}: sensor {number}: needs offset_m and axis, or neither")
    mount = [_value(path, table, key, 3) if key in table else None for key in ("offset_m", "axis")]
    if mount[1] is not None and not abs(np.linalg.norm(mount[1]) - 1) < 1e-3:
        raise ValueError(f"{path}: sensor {number}: axis has length {np.linalg.norm(mount[1]):.4g}, not 1")
    deviation = _value(path, table, "gain_deviation", default=GAIN_DEVIATION)
    if not 0 < deviation < 1:
        raise ValueError(f"{path}: sensor {number}: gain_deviation must be between 0 and 1; is {deviation:g}")
    return number, SensorCoil(gain, *mount, deviation)


def read_generator(path: str | os.PathLike) -> Generator:
    """Reads a generator from TOML: [[coil]] with name, position_m and moment, optionally octupole_m2 and misfit; [[sensor]] with number, gain,
    offset_m and axis; crosstalk. Raises ValueError that names the file, and OSError."""
    import tomllib  # of Python 3.11

    path = os.fspath(path)
    try:
        data = read_whole(path, MOST_TOML_BYTES)
        if LONG_KEY.search(data):
            raise ValueError(f"{path}: a key has more than 16 parts; is it the right file?")
        tables = tomllib.loads(data.decode())
    except (tomllib.TOMLDecodeError, UnicodeDecodeError, RecursionError) as error:
        raise ValueError(f"{path}: no TOML file: {error}") from None
    coils, sensors = tables.get("coil", []), tables.get("sensor", [])
    if not isinstance(coils, list) or not coils or not all(isinstance(one, dict) and isinstance(one.get("name"), str) for one in coils):
        raise ValueError(f"{path}: no generator; it needs a table [[coil]] with name, position_m and moment for each coil")
    if not isinstance(sensors, list) or not all(isinstance(one, dict) for one in sensors):
        raise ValueError(f"{path}: each sensor needs a table [[sensor]]")
    _refuse_unknown(path, tables, "the file", FILE_KEYS)
    for one in coils:
        _refuse_unknown(path, one, f"coil {one['name']}", COIL_KEYS)
    if not isinstance(tables.get("left_handed_stage", False), bool):
        raise ValueError(f"{path}: left_handed_stage must be true or false")
    try:
        numbered = [_sensor(path, one) for one in sensors]
        if len(dict(numbered)) != len(numbered):
            raise ValueError(f"{path}: two sensors have the same number")
        return Generator(
            tuple(one["name"] for one in coils), np.array([_value(path, one, "position_m", 3) for one in coils]),
            np.array([_value(path, one, "moment", 3) for one in coils]), np.array([_value(path, one, "octupole_m2", default=0.0) for one in coils]),
            _crosstalk(path, tables.get("crosstalk"), len(coils)), np.array([_value(path, one, "misfit", default=0.0) for one in coils]), dict(numbered),
            tables.get("left_handed_stage", False))
    except (ValueError, OverflowError) as error:
        raise ValueError(str(error) if str(error).startswith(path) else f"{path}: {error}") from None
