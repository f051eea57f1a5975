"""`tricoil generator solve --body`: poses of a body that carries the sensor coils of a table, compared with the truth if the table has it."""

import json
import os

import numpy as np

from ._body import solve_6dof
from ._generator_result import compared, result_lines, summary
from ._generator_table import Frames
from ._output_file import write_whole
from ._rotation import rotations
from ._single_coil import ENDS

COLUMNS = ("x_m", "y_m", "z_m", "qw", "qx", "qy", "qz", "std_x_m", "std_y_m", "std_z_m", "std_rx_rad", "std_ry_rad", "std_rz_rad", "chi_square")


def _frames_of_body(frames: Frames, where):
    """Numbers of the sensor coils, and their rows (K, M): the k-th row of each is one measurement. Raises ValueError if the rows do not say so."""
    sensors = sorted(set(frames.sensor.tolist()))
    rows = [np.flatnonzero(frames.sensor == number) for number in sensors]
    if len(sensors) < 2:
        raise ValueError(f"{where}: --body needs rows of two sensor coils or more, with their numbers in a column sensor")
    for number, one in zip(sensors[1:], rows[1:]):
        if len(one) != len(rows[0]):
            raise ValueError(f"{where}: sensor coil {sensors[0]} has {len(rows[0])} rows, {number} has {len(one)}; a body needs a row of each at each time")
        if frames.time_s is not None and not np.array_equal(frames.time_s[one], frames.time_s[rows[0]]):
            n = int(np.argmax(frames.time_s[one] != frames.time_s[rows[0]]))
            raise ValueError(f"{where}: row {n + 1} of sensor coil {number} has the time {frames.time_s[one][n]:g} s, that of {sensors[0]} {frames.time_s[rows[0]][n]:g} s; all coils of a body need equal times")
    return sensors, np.array(rows)


def _compared(rows, position_m, turn):
    """Errors of good poses against the truth."""
    error = np.hstack((rows["position_m"] - position_m, (rotations(rows["quaternion_wxyz"]) * turn.inv()).as_rotvec()))

    def nees(right):
        return np.einsum("mi,mij,mj->m", error[right], np.linalg.inv(rows["covariance"][right]), error[right]) / 6

    return {"axis_rms_deg": None} | compared(rows, position_m, np.linalg.norm(error[:, 3:], axis=1), "rotation_rms_deg", nees)


def _values(rows):
    deviations = np.sqrt(np.diagonal(rows["covariance"], axis1=1, axis2=2))
    return np.hstack((rows["position_m"], rows["quaternion_wxyz"], deviations, rows["chi_square"][:, None]))


def _text_of(rows, time_s, is_json) -> str:
    """Poses as JSON lines or as CSV, which every command with poses reads."""
    names, lines = (*(["time_s"] if time_s is not None else []), *COLUMNS), []
    values = _values(rows) if time_s is None else np.column_stack((time_s, _values(rows)))
    for row, end in zip(values.tolist(), rows["end"]):
        lines.append(json.dumps(dict(zip(names, row)) | {"status": ENDS[end]}) if is_json else ",".join((*(f"{v:.9g}" for v in row), ENDS[end])))
    return "\n".join(lines if is_json else [",".join((*names, "status")), *lines]) + "\n"


def solved(frames: Frames, generator, couplings, sigma, options, out, where) -> tuple[dict, np.ndarray]:
    """Result and rows of solve_6dof(). Poses that are not good are left out of the file. Raises ValueError, OSError."""
    sensors, rows_of = _frames_of_body(frames, where)
    first = rows_of[0]
    rows = solve_6dof(couplings[rows_of], generator, sensors, sigma if np.ndim(sigma) == 0 else sigma[rows_of], **options)
    is_good = rows["end"] == 0
    truth = None
    if frames.turn is not None and frames.position_m is not None:
        turn = frames.turn[first]
        truth = _compared(rows, frames.position_m[first], turn.inv() if frames.is_stage and generator.left_handed_stage else turn)
    result = summary(rows) | {"sensors": sensors, "roll": "determined", "truth": truth, "motion": None, "notes": []}
    if out is not None:
        write_whole(out, _text_of(rows[is_good], None if frames.time_s is None else frames.time_s[first][is_good], os.fspath(out).endswith((".jsonl", ".json"))))
    return result, rows


def text(r: dict) -> str:
    """The result as lines."""
    first = f"{r['solved']} of {r['poses']} poses of the body solved, by sensor coils {', '.join(map(str, r['sensors']))}"
    return "\n".join(result_lines(r, first, "rotation_rms_deg")) + "\n"
