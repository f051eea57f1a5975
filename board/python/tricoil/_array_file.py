"""Tables and samples in NumPy files (.npy, .npz) and MATLAB files (.mat, version 5)."""

import io
import re
import zipfile

import numpy as np

from ._mat_file import read_mat

NPY, ZIP, MAT, HDF = b"\x93NUMPY", b"PK\x03\x04", b"MATLAB 5.0 MAT-file", (b"MATLAB 7.3 MAT-file", b"\x89HDF\r\n\x1a\n")
FIRST_BYTES = 20  # that tell the format
WXYZ = ("qw", "qx", "qy", "qz")
AXIS = ("nx", "ny", "nz")
POSE = (4, 4)  # homogeneous matrix
VECTOR = re.compile(r"(position|acc|accel|acceleration|accelerometer|gyr|gyro|gyroscope|angular_rate|angular_velocity|omega)(_\w+)?")  # and its unit
MATRICES = {"x": "x", "couplings": "x", "signal_matrix": "x", "q": "q", "quadrature": "q"}


def is_array_file(first_bytes: bytes) -> bool:
    return first_bytes.startswith((NPY, ZIP, MAT, *HDF))


def _fields(name, value):
    """Arrays of numbers in a value: itself, those of a structured array or of a MATLAB structure."""
    if isinstance(value, dict):
        return {key: one for inner, item in value.items() for key, one in _fields(inner, item).items()}
    value = np.asarray(value)
    if value.dtype.names:
        return {key: one for inner in value.dtype.names for key, one in _fields(inner, value[inner]).items()}
    return {name: value} if value.dtype.kind in "biuf" and value.ndim else {}


def _loaded(path, data):
    if data.startswith(HDF):
        raise ValueError(f"{path}: is a MAT file of version 7.3 (HDF5); save it in MATLAB with -v7")
    if data.startswith(MAT):
        return read_mat(data)
    if data.startswith(ZIP) and not all(name.endswith(".npy") for name in zipfile.ZipFile(io.BytesIO(data)).namelist()):
        raise ValueError(f"{path}: is an archive or a spreadsheet; save it as CSV")
    loaded = np.load(io.BytesIO(data), allow_pickle=False)
    return dict(loaded) if data.startswith(ZIP) else loaded


def arrays_of(data: bytes, path: str) -> dict:
    """Arrays of numbers by name; "" is that of a file of one array without names. Raises ValueError that names the file."""
    try:
        arrays = _fields("", _loaded(path, data))
    except ValueError as error:
        raise error if str(error).startswith(path) else ValueError(f"{path}: the file is damaged ({error})") from None
    except Exception as error:  # the libraries raise many types for a damaged file
        raise ValueError(f"{path}: the file is damaged ({type(error).__name__})") from None
    if not any(array.size for array in arrays.values()):
        raise ValueError(f"{path}: has no array of numbers")
    return arrays


def _names(name, shape):
    name = re.sub(r"\W", "_", name)
    if not shape:
        return [name]
    if shape == (3,) and (vector := VECTOR.fullmatch(name)):
        kind, unit = vector.groups(default="")
        return [f"{axis}{unit}" if kind == "position" else f"{kind}_{axis}{unit}" for axis in "xyz"]
    if name == "axis" and shape == (3,):
        return list(AXIS)
    if name in ("q_wxyz", "quaternion_wxyz") and shape == (4,):
        return list(WXYZ)
    if name in MATRICES and shape == (3, 3):
        return [f"{MATRICES[name]}{i}{j}" for i in "123" for j in "123"]
    return [f"{name}{n + 1}" for n in range(shape[0])] if len(shape) == 1 else []


def table_of(data: bytes, path: str) -> bytes:
    """The same as a table with commas. Arrays with the most rows are its columns: time_us (N,), position_m, acc_m_s2 and gyr_rad_s (N, 3),
    q_wxyz (N, 4), axis (N, 3) and matrices (N, 3, 3), or (3, 3, N) of MATLAB, by these names, or without a name; others (N, K) as name1 to
    nameK. Homogeneous matrices (N, 4, 4) become rows of four numbers."""
    arrays = arrays_of(data, path)
    largest = max(arrays.values(), key=lambda array: array.size)
    if largest.ndim == 3 and POSE in (largest.shape[1:], largest.shape[:2]):
        arrays = {"": (largest if largest.shape[1:] == POSE else np.moveaxis(largest, -1, 0)).reshape(-1, 4)}
    if arrays.keys() == {""} and arrays[""].shape[1:] == (3, 3):
        arrays = {"x": arrays[""]}
    rows = max(max(array.shape[0], array.shape[-1] if array.shape[:2] == (3, 3) else 0) for array in arrays.values())
    names, columns = [], []
    for name, array in arrays.items():
        if array.ndim == 3 and array.shape == (3, 3, rows) and rows != 3:
            array = np.moveaxis(array, -1, 0)
        of_array = _names(name, array.shape[1:]) if array.shape[0] == rows else []
        names += of_array
        columns += list(array.reshape(rows, -1).T) if of_array else []
    if not columns:
        raise ValueError(f"{path}: has no array of two dimensions, or of three as 3 x 3 or 4 x 4 matrices, with the most rows")
    lines = [",".join(names)] if any(arrays) else []
    texts = [[repr(value) for value in (column.astype(int) if column.dtype.kind == "b" else column).tolist()] for column in columns]
    return "\n".join([*lines, *map(",".join, zip(*texts)), ""]).encode()


def samples_of(data: bytes, path: str):
    """The array with the most numbers: of (N, channels), or (repeats, 3, samples, channels). If it is (N,): all arrays of N are the channels."""
    arrays = list(arrays_of(data, path).values())
    largest = max(arrays, key=lambda array: array.size)
    return largest if largest.ndim != 1 else np.column_stack([array for array in arrays if array.shape == largest.shape])
