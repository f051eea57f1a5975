"""`tricoil generator solve --body`: poses of a body that carries the sensor coils of a table, compared with the truth if the table has it."""

import json
import os

import numpy as np

from ._body import solve_6dof
from ._generator_table import Frames
from ._output_file import write_whole
from ._rotation import rotations
from ._single_coil import ENDS

WRONG_M = 0.02  # a pose farther from the truth is wrong, and not counted in the RMS
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


def _compared(rows, position_m, turn, is_good):
    """Errors of good poses against the truth."""
    error = np.hstack((rows["position_m"] - position_m, (rotations(rows["quaternion_wxyz"]) * turn.inv()).as_rotvec()))
    size = np.linalg.norm(error[:, :3], axis=1)
    right = is_good & (size < WRONG_M)
    result = {"wrong": int((is_good & ~right).sum()), "position_rms_m": None, "position_median_m": None, "position_max_m": None, "axis_rms_deg": None,
              "rotation_rms_deg": None, "nees": None}
    if not right.any():
        return result
    e = error[right]
    nees = np.einsum("mi,mij,mj->m", e, np.linalg.inv(rows["covariance"][right]), e) / 6
    return result | {"position_rms_m": float(np.sqrt(np.mean(size[right] ** 2))), "position_median_m": float(np.median(size[right])), "position_max_m": float(size[right].max()),
                     "rotation_rms_deg": float(np.degrees(np.sqrt(np.mean(np.sum(e[:, 3:] ** 2, axis=1))))), "nees": float(nees.mean())}


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
        truth = _compared(rows, frames.position_m[first], turn.inv() if frames.is_stage and generator.left_handed_stage else turn, is_good)
    counts = {end: int((rows["end"] == n).sum()) for n, end in enumerate(ENDS)}
    covariance = rows["covariance"][is_good]
    result = {"poses": len(rows), "sensors": sensors, "solved": counts.pop("converged"), **counts,
              "position_std_m": float(np.sqrt(np.mean(np.trace(covariance[:, :3, :3], axis1=1, axis2=2)))) if is_good.any() else None, "truth": truth,
              "roll": "determined", "motion": None, "notes": []}
    if out is not None:
        write_whole(out, _text_of(rows[is_good], None if frames.time_s is None else frames.time_s[first][is_good], os.fspath(out).endswith((".jsonl", ".json"))))
    return result, rows


def text(r: dict) -> str:
    """The result as lines."""
    lines = [f"{r['solved']} of {r['poses']} poses of the body solved, by sensor coils {', '.join(map(str, r['sensors']))}"]
    lines += [f"  {r[name]} {name.replace('_', ' ')}" for name in ENDS[1:] if r[name]]
    if r["position_std_m"] is not None:
        lines.append(f"  standard deviation {1e3 * r['position_std_m']:.3f} mm RMS (3D)")
    if (t := r["truth"]) and t["position_rms_m"] is not None:
        lines.append(f"  against the truth: {1e3 * t['position_rms_m']:.3f} mm RMS (3D), median {1e3 * t['position_median_m']:.3f}, maximum {1e3 * t['position_max_m']:.3f} mm; "
                     f"{t['rotation_rms_deg']:.3f} deg; {t['wrong']} wrong; NEES {t['nees']:.2f}")
    return "\n".join(lines) + "\n"
