"""Tables of couplings of one or several sensor coils in the field of a generator: CSV, or ILEMT text of one source in several mountings."""

import dataclasses
import os

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ._byte_stream import ByteStream
from ._rotation import rotations
from ._table_rows import Table
from ._whole_file import read_whole

POSE, AXIS, TURN = ("x_m", "y_m", "z_m"), ("nx", "ny", "nz"), ("qw", "qx", "qy", "qz")
KNOWN = (*POSE, *AXIS, *TURN, "time_s", "sensor", "sigma")
STAGE_COLUMNS = 15  # x y z in mm, three angles in degrees, nine complex couplings
SILENT = 1e-6  # RMS of a coil's couplings relative to that of all


@dataclasses.dataclass
class Frames:
    """M rows. sensor: (M,), number of the sensor coil. position_m, axis: (M, 3), of the coil, or with turn of the body; None: unknown."""

    names: tuple[str, ...]
    couplings: NDArray
    sensor: NDArray
    time_s: NDArray | None = None
    sigma: NDArray | None = None
    position_m: NDArray | None = None
    axis: NDArray | None = None
    turn: Rotation | None = None
    is_stage: bool = False

    def __len__(self) -> int:
        return len(self.couplings)


def _words_of(path):
    with ByteStream(path) as stream:
        return next((words for words in map(str.split, stream.read().decode(errors="replace").splitlines()) if words), [])


def _is_stage(path):
    words = _words_of(path)
    return len(words) >= STAGE_COLUMNS and words[6].endswith("i")


def _stage_rows(path):
    """Stage poses (M, 6), m and degrees, and couplings (M, 3 sensor coils, 3 source coils)."""
    rows = []
    for number, line in enumerate(read_whole(path).decode(errors="replace").splitlines(), 1):
        words = line.split()
        if not words:
            continue
        try:
            values = [float(word) for word in words[:6]] + [complex(word.replace("i", "j")) for word in words[6:STAGE_COLUMNS]]
        except ValueError:
            values = []
        if len(values) != STAGE_COLUMNS or not np.all(np.isfinite(values)):
            raise ValueError(f"{path}:{number}: needs six numbers of the stage and nine complex couplings")
        rows.append(values)
    table = np.array(rows)
    poses = table[:, :6].real * np.array([1e-3] * 3 + [1.0] * 3)
    couplings = np.sign(table[:, 6:].real) * abs(table[:, 6:])
    return poses, couplings.reshape(-1, 3, 3)


def _mounting(path):
    return os.path.basename(path).split("_")[0].removesuffix(".dat")


def _read_stage(paths):
    """One source in several mountings is a generator of three coils for each mounting."""
    names = [f"{_mounting(path)}.{n}" for path in paths for n in "123"]
    poses, first = _stage_rows(paths[0])
    parts = [first]
    for path in paths[1:]:
        others, couplings = _stage_rows(path)
        if others.shape != poses.shape or not np.allclose(others, poses, rtol=0, atol=1e-6):
            raise ValueError(f"{path}: the stage has other poses than in {paths[0]}; files of one generator need the same poses in the same order")
        parts.append(couplings)
    every = np.concatenate(parts, axis=2)
    count = len(poses)
    turn = Rotation.from_euler("ZYX", poses[:, [5, 4, 3]], degrees=True)
    return Frames(tuple(names), every.transpose(1, 0, 2).reshape(3 * count, -1), np.repeat([1, 2, 3], count), position_m=np.tile(poses[:, :3], (3, 1)),
                  turn=Rotation.concatenate([turn] * 3), is_stage=True)


def _columns(table, rows, names, has):
    if any(map(has, names)):
        return np.stack(table.numbers(rows, [(table.column(name, ",".join(names)), None) for name in names]), axis=1)
    return None


def _joined(parts):
    return None if parts[0] is None else np.concatenate(parts)


def parts_of(path):
    """Frames of a table as its rows come."""
    with ByteStream(path) as stream:
        table = Table(stream)
        coils = [name for name in table.names if name not in KNOWN]
        if not table.has_names or not coils:
            raise ValueError(f"{path}: the header must have a column for each coil of the generator, optionally {', '.join(KNOWN)}")
        has = set(table.names).__contains__
        while (rows := table.next()) is not None:
            sensor = table.numbers(rows, [(table.column("sensor", "sensor"), (0, 999))])[0] if has("sensor") else np.ones(len(rows))
            couplings, time_s, sigma, position_m, axis, wxyz = (_columns(table, rows, names, has) for names in (coils, ("time_s",), ("sigma",), POSE, AXIS, TURN))
            for what, values in (("nx, ny, nz", axis), ("qw, qx, qy, qz", wxyz)):
                if values is not None and not np.all(np.linalg.norm(values, axis=1) > 0.1):
                    raise ValueError(f"{path}: {what} of a row are zero")
            yield Frames(tuple(coils), couplings, sensor.astype(int), None if time_s is None else time_s[:, 0], None if sigma is None else sigma[:, 0], position_m,
                         None if axis is None else axis / np.linalg.norm(axis, axis=1, keepdims=True), None if wxyz is None else rotations(wxyz))


def joined(parts) -> Frames:
    """Frames of one table."""
    first, *_ = parts
    values = {field.name: [getattr(part, field.name) for part in parts] for field in dataclasses.fields(Frames)}
    return Frames(first.names, *(_joined(values[name]) for name in ("couplings", "sensor", "time_s", "sigma", "position_m", "axis")),
                  None if first.turn is None else Rotation.concatenate(values["turn"]))


def _read_table(path):
    parts = list(parts_of(path))
    if not parts:
        raise ValueError(f"{path}: has no rows")
    return joined(parts)


def read(paths) -> Frames:
    """CSV: one file. ILEMT text: a file of each mounting. Raises ValueError that names the file, OSError."""
    paths = [os.fspath(path) for path in paths]
    if not paths:
        raise ValueError("a table of couplings is needed")
    is_stage = [_is_stage(path) for path in paths]
    if len(paths) > 1 and not all(is_stage):
        raise ValueError(f"{paths[is_stage.index(False)]}: only files of a stage (ILEMT text) may be several, one of each mounting")
    return _read_stage(paths) if is_stage[0] else _read_table(paths[0])


def in_order(frames: Frames, names, where: str) -> NDArray:
    """Couplings (M, N) in the order of these coils. Raises ValueError if the table has others."""
    for name in names:
        if name not in frames.names:
            raise ValueError(f"{where}: no couplings of coil {name}; the generator has {len(names)} coils: {', '.join(names)}")
    for name in frames.names:
        if name not in names:
            raise ValueError(f"{where}: coil {name} is not one of the generator's {len(names)}: {', '.join(names)}")
    return frames.couplings[:, [frames.names.index(name) for name in names]]


def refuse_silent(couplings, names, sigma, where, mend="") -> None:
    """Raises ValueError if a coil has no couplings above noise in any row."""
    size = np.sqrt(np.mean(couplings**2, axis=0))
    noise = 0.0 if sigma is None else 2 * float(np.sqrt(np.mean(np.square(sigma))))
    silent = (size <= SILENT * np.sqrt(np.mean(size**2))) | ((size < noise) & (size.max() > 100 * noise))
    if silent.any():
        raise ValueError(f"{where}: coil {names[int(np.argmax(silent))]} is silent in every row: is it connected?{mend}")
