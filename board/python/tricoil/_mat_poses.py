"""`tricoil convert --to mat`: poses of a recording as a MAT file of version 5, for MATLAB and Octave.

Variables: `poses`, a structure whose fields have one row for each pose and the names of the JSON keys, and also covariance (6 x 6 x N:
position in m, then small rotation in rad) and couplings (3 x 3 x N: sensor coil, source coil); `flag_names`: names of the bits of poses.flags.
A number that a pose lacks is NaN; a pose without a position has the variance infinity.
"""

import array
import io
import json

import numpy as np

from . import _tricoil
from ._output_file import write_whole
from ._staged_lines import INTEGERS, staged_lines

MOST_POSES = 4_000_000  # 2 GB; the format has 32-bit sizes
HEADER = b"MATLAB 5.0 MAT-file, written by tricoil".ljust(116)  # SciPy's has the time, so it differs each time
NUMBERS = ("distortion_mm", "snr_db", "predicted_error_mm", "predicted_error_deg")
UPPER = np.triu_indices(6)


def _sizes(units: str, euler: str | None) -> dict[str, int]:
    """Numbers of each field of `poses`, but the matrices."""
    return {**dict.fromkeys(INTEGERS, 1), f"position_{units}": 3, "q_wxyz": 4, f"std_{units}_rad": 6, **dict.fromkeys(NUMBERS, 1),
            **({f"euler_{euler}_deg": 3} if euler else {})}


def _put(values: array.array, field, size: int) -> None:
    """Appends `size` numbers; null, also instead of the whole field: NaN."""
    several = [field] * size if field is None or size == 1 else field
    values.extend(np.nan if one is None else one for one in several)


def _columns(path: str, sizes: dict[str, int]) -> dict[str, np.ndarray]:
    """Fields of the JSON lines of a file, (N, size) each. Raises ValueError if there are too many."""
    columns = {name: array.array("d") for name in sizes}
    with open(path, "rb") as lines:
        for count, line in enumerate(lines):
            if count == MOST_POSES:
                raise ValueError(f"a MAT file holds at most {MOST_POSES} poses; use --to csv or mcap")
            pose = json.loads(line)
            for name, size in sizes.items():
                _put(columns[name], pose[name], size)
    return {name: np.array(values).reshape(-1, size) for (name, size), values in zip(sizes.items(), columns.values())}


def _matrices(path: str) -> dict[str, np.ndarray]:
    columns = _columns(path, {"position_m": 3, "covariance": 21, "couplings": 9})
    covariance = np.empty((6, 6, len(columns["couplings"])))
    covariance[UPPER] = covariance[UPPER[::-1]] = columns["covariance"].T
    covariance[:, :, np.isnan(columns["position_m"]).any(axis=1)] = np.where(np.eye(6), np.inf, 0)[:, :, None]
    return {"covariance": covariance, "couplings": columns["couplings"].reshape(-1, 3, 3).T}


def run(folder: str, out: str, options: dict) -> int:
    """Writes the poses of a recording; returns their number. options: stages, units and euler of `tricoil convert`. Raises ValueError, OSError."""
    from scipy.io import savemat

    with staged_lines(folder, out, options, "full") as (in_metres, shown):
        poses = {**_columns(shown, _sizes(options.get("units", "m"), options.get("euler"))), **_matrices(in_metres)}
    file = io.BytesIO()
    savemat(file, {"poses": poses, "flag_names": np.array(_tricoil.FLAG_NAMES, dtype=object)}, oned_as="row")
    file.seek(0)
    file.write(HEADER)
    write_whole(out, file.getvalue())
    return len(poses["sensor"])
