"""tricoil motion --poses: tables of the predicted motion error, and files of the poses without it."""

import os

import numpy as np

from ._motion_analysis import CAUSES
from ._motion_error import MotionError, motion_error
from ._poses import PoseError, read
from ._timing import NAMES, parse_timing

EDGES = {
    "speed_m_s": (0, 0.1, 0.25, 0.5, 1, 2, np.inf),
    "angular_rate_rad_s": (0, 0.5, 1, 2, 5, 10, np.inf),
    "range_m": (0, 0.3, 0.5, 0.75, 1, 1.5, np.inf),
}
TITLES = {"speed_m_s": "speed, m/s", "angular_rate_rad_s": "angular rate, rad/s", "range_m": "range, m"}
READER_OPTIONS = ("sensor", "unit", "time_unit", "rate_hz", "rotation", "columns")
UNCHECKED = "an assumption: without a reference it cannot be checked"


def _rms(vectors):
    return float(np.sqrt(np.mean(np.sum(vectors**2, axis=1)))) if len(vectors) else None


def _errors(rows):
    """RMS of the predicted error and of its standard deviation."""
    return {
        "position_rms_m": _rms(rows["total"][:, :3]),
        "position_deviation_m": _rms(rows["total_deviation"][:, :3]),
        "rotation_rms_rad": _rms(rows["total"][:, 3:]),
        "rotation_deviation_rad": _rms(rows["total_deviation"][:, 3:]),
    }


def table(rows, by: str) -> list[dict]:
    """Predicted errors in intervals of speed_m_s, angular_rate_rad_s or range_m; empty intervals are left out. The last one has no end (None)."""
    edges = EDGES[by]
    result = []
    for low, high in zip(edges[:-1], edges[1:]):
        part = rows[(rows[by] >= low) & (rows[by] < high)]
        if len(part):
            result.append({"from": low, "to": None if np.isinf(high) else high, "poses": len(part), **_errors(part)})
    return result


def summary(result: MotionError) -> dict:
    """The result of `tricoil motion --poses --json`."""
    rows = result.rows[result.rows["is_predicted"]]
    stated = {name: _rms(np.sqrt(np.diagonal(poses.covariance[result.rows["is_predicted"], :3, :3], axis1=1, axis2=2)))
              for name, poses in (("corrected", result.corrected), ("smoothed", result.smoothed))}
    causes = {cause: {"position_rms_m": _rms(rows[cause][:, :3]), "position_deviation_m": _rms(rows[cause + "_deviation"][:, :3]),
                      "rotation_rms_rad": _rms(rows[cause][:, 3:])} for cause in CAUSES}
    return {
        "file": result.corrected.name,
        "timing": result.timing.text,
        "assumed": result.timing.describe(),
        "poses": len(result.rows),
        "poses_beside_gaps": int(np.sum(~result.rows["is_predicted"])),
        "duration_s": float(result.rows["time_s"][-1] - result.rows["time_s"][0]),
        **_errors(rows),
        "causes": causes,
        "tables": {by: table(rows, by) for by in EDGES},
        "corrected_deviation_m": stated["corrected"],
        "smoothed_deviation_m": stated["smoothed"],
        "notes": list(result.corrected.notes),
    }


def _mm(metres):
    return f"{1e3 * metres:.3f}"


def text(result: dict) -> str:
    """The result as the program prints it."""
    lines = [f"{result['file']}: {result['poses']} poses, {result['duration_s']:.2f} s"]
    lines += [f"  {note}" for note in result["notes"]]
    lines += [f"  timing       {result['timing']}: {result['assumed']}", f"               {UNCHECKED}"]
    if result["poses_beside_gaps"]:
        lines.append(f"  left out     {result['poses_beside_gaps']} poses between gaps that are too close")
    lines.append(f"  motion error {_mm(result['position_rms_m'])} mm RMS, deviation {_mm(result['position_deviation_m'])} mm; "
                 f"{np.degrees(result['rotation_rms_rad']):.4f} deg, deviation {np.degrees(result['rotation_deviation_rad']):.4f}")
    causes = [f"{cause} {_mm(error['position_rms_m'])} mm" for cause, error in result["causes"].items()]
    lines.append(f"  by cause     {', '.join(causes)}")
    lines.append(f"  corrected    deviation {_mm(result['corrected_deviation_m'])} mm, smoothed {_mm(result['smoothed_deviation_m'])} mm")
    for by, intervals in result["tables"].items():
        lines.append(f"  {TITLES[by]:<20} {'poses':>7} {'error, mm':>11} {'deviation':>10} {'error, deg':>11}")
        for one in intervals:
            ends = f"{one['from']:g} and more" if one["to"] is None else f"{one['from']:g} to {one['to']:g}"
            lines.append(f"    {ends:<18} {one['poses']:>7} {_mm(one['position_rms_m']):>11} {_mm(one['position_deviation_m']):>10} "
                         f"{np.degrees(one['rotation_rms_rad']):>11.4f}")
    return "\n".join(lines) + "\n"


def write(path, result: MotionError, smooth: bool) -> None:
    """Corrected poses as CSV; a comment line says what was assumed."""
    poses = result.smoothed if smooth else result.corrected
    names = ["time_s", "x_m", "y_m", "z_m", "qw", "qx", "qy", "qz", "std_x_m", "std_y_m", "std_z_m", "std_rx_rad", "std_ry_rad", "std_rz_rad",
             "error_x_m", "error_y_m", "error_z_m", "error_rx_rad", "error_ry_rad", "error_rz_rad", "corrected"]
    deviations = np.sqrt(np.diagonal(poses.covariance, axis1=1, axis2=2))
    values = np.hstack((poses.position_m, poses.quaternion_wxyz, deviations, result.rows["total"]))
    kind = "smoothed poses" if smooth else "poses"
    lines = [f"# {kind} without motion error; timing {result.timing.text}: {result.timing.describe()}; {UNCHECKED}", ",".join(names)]
    for time_s, row, is_corrected in zip(poses.time_s, values, poses.is_corrected):
        fields = ["" if np.isnan(value) else f"{value:.10g}" for value in row]
        lines.append(",".join((f"{time_s:.9f}", *fields, str(int(is_corrected)))))
    temporary = f"{path}.part"
    with open(temporary, "w", encoding="utf-8") as file:
        file.write("\n".join(lines) + "\n")
    os.replace(temporary, path)


def run(poses, timing=None, out=None, plot=None, smooth=False, **reader) -> dict:
    """Reads a file of poses, predicts its motion error, and writes what is wanted. Raises PoseError, OSError."""
    if timing is None:
        raise PoseError(f"motion --poses needs --timing: tdm:SLOTS/RATE, for example tdm:3/720, fdm, or {', '.join(NAMES)}")
    if timing == "fit":
        raise PoseError("--timing fit needs a reference: `tricoil evaluate --dynamic REFERENCE POSES` finds multiplexing, order, slots and latency; "
                        "then give them as --timing")
    unknown = reader.keys() - set(READER_OPTIONS)
    if unknown:
        raise PoseError(f"--{min(unknown).replace('_', '-')}: not with --poses")
    result = motion_error(read(poses, **reader), parse_timing(timing))
    if out is not None:
        write(out, result, smooth)
    if plot is not None:
        from . import plot as drawing

        drawing.motion_error(result).savefig(plot)
    return summary(result)
