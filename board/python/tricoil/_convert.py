"""`tricoil convert` of a file of poses: the forms of other systems, which read_poses() reads."""

import datetime
import json
import os

import numpy as np

from ._output_file import refuse_input_as_output, write_whole
from ._poses import METRES, READER_OPTIONS, PoseError, Poses, read, refuse_others

MOTIVE_UNITS = {"m": "Meters", "cm": "Centimeters", "mm": "Millimeters"}
DIGITS = ".10g"


def _fields(values) -> str:
    return ",".join(format(value, DIGITS) for value in values)


def _angles(poses: Poses, axes: str):
    """Angles about the turned axes in this order, deg, (N, 3)."""
    from ._rotation import rotations

    return rotations(poses.quaternion_wxyz).as_euler(axes.upper(), degrees=True)


def _rate_hz(poses: Poses) -> float:
    return 1.0 / float(np.median(np.diff(poses.time_s))) if len(poses) > 1 else 1.0


def csv(poses: Poses, unit: str, euler: str | None) -> str:
    """Columns with their units: time_s, x_UNIT..., qw..., and the angles of `euler`."""
    names = ["time_s", *(f"{axis}_{unit}" for axis in "xyz")]
    values = [poses.position_m / METRES[unit]]
    if poses.quaternion_wxyz is not None:
        names += ["qw", "qx", "qy", "qz"]
        values.append(poses.quaternion_wxyz)
    comment = ""
    if euler:
        if poses.quaternion_wxyz is None:
            raise PoseError("--euler: the file has positions only")
        names += [f"r{n}_deg" for n in (1, 2, 3)]
        values.append(_angles(poses, euler))
        comment = f"# r1 to r3: angles about the turned axes {euler.upper()}\n"
    rows = (f"{time_s:.9f},{_fields(row)}" for time_s, row in zip(poses.time_s, np.hstack(values)))
    return comment + ",".join(names) + "\n" + "\n".join(rows) + "\n"


def jsonl(poses: Poses, unit: str) -> str:
    """One object a line: time_s, position_UNIT, q_wxyz."""
    lines = []
    for n, (time_s, position_m) in enumerate(zip(poses.time_s, poses.position_m)):
        one = {"time_s": round(float(time_s), 9), f"position_{unit}": (position_m / METRES[unit]).tolist()}
        if poses.quaternion_wxyz is not None:
            one["q_wxyz"] = poses.quaternion_wxyz[n].tolist()
        lines.append(json.dumps(one))
    return "\n".join(lines) + "\n"


def motive(poses: Poses, unit: str) -> str:
    """CSV of OptiTrack Motive with one rigid body, or marker if there are positions only."""
    if unit not in MOTIVE_UNITS:
        raise PoseError(f"--units must be m, cm or mm with --to motive; is '{unit}'")
    name = poses.sensor or "Body"
    name = f"Body {name}" if name.isdecimal() else name
    start = datetime.datetime.fromtimestamp(0, datetime.timezone.utc).strftime("%Y-%m-%d %I.%M.%S.000 %p")
    meta = ["Format Version", "1.23", "Take Name", "tricoil", "Capture Frame Rate", f"{_rate_hz(poses):.6f}", "Export Frame Rate", f"{_rate_hz(poses):.6f}",
            "Capture Start Time", start, "Total Exported Frames", str(len(poses)), "Rotation Type", "Quaternion", "Length Units", MOTIVE_UNITS[unit],
            "Coordinate Space", "Global"]
    has_turn = poses.quaternion_wxyz is not None
    kinds = ["Rotation"] * 4 * has_turn + ["Position"] * 3
    axes = list("XYZW") * has_turn + list("XYZ")
    head = [meta, [], ["", "Type", *["Rigid Body" if has_turn else "Marker"] * len(axes)], ["", "Name", *[name] * len(axes)], ["", "ID", *["1"] * len(axes)],
            ["", "", *kinds], ["Frame", "Time (Seconds)", *axes]]
    values = poses.position_m / METRES[unit]
    if has_turn:
        values = np.hstack((poses.quaternion_wxyz[:, [1, 2, 3, 0]], values))
    rows = (f"{n},{time_s:.9f},{_fields(row)}" for n, (time_s, row) in enumerate(zip(poses.time_s, values)))
    return "\n".join(",".join(f'"{word}"' if "," in word else word for word in line) for line in head) + "\n" + "\n".join(rows) + "\n"


def with_attitude(poses: Poses, form: str):
    if poses.quaternion_wxyz is None:
        raise PoseError(f"--to {form}: needs attitudes; {poses.name} has positions only")


def polhemus(poses: Poses, unit: str) -> str:
    """Table of sensor, x, y, z, azimuth, elevation and roll, with times; a line of names says the units."""
    with_attitude(poses, "polhemus")
    sensor = poses.sensor if poses.sensor.isdecimal() else "1"
    rows = (f"{sensor},{time_s:.9f},{_fields(row)}" for time_s, row in zip(poses.time_s, np.hstack((poses.position_m / METRES[unit], _angles(poses, "ZYX")))))
    return f"sensor,time_s,x_{unit},y_{unit},z_{unit},azimuth_deg,elevation_deg,roll_deg\n" + "\n".join(rows) + "\n"


def ndi(poses: Poses, unit: str) -> str:
    """Table of NDI's programs with one tool, mm. It has frame numbers instead of times: equally spaced poses are needed."""
    with_attitude(poses, "ndi")
    if unit != "mm":
        raise PoseError(f"--to ndi: its positions are in mm; give --units mm, not {unit}")
    frames = poses.time_s * _rate_hz(poses)
    numbers = np.round(frames)
    if np.abs(frames - numbers - np.median(frames - numbers)).max() > 0.25 or (np.diff(numbers) <= 0).any():
        raise PoseError(f"--to ndi: has frame numbers instead of times; the poses of {poses.name} are not equally spaced")
    rows = (f"1,Port 1,{frame:.0f},OK,{_fields(q)},{_fields(position)},0" for frame, q, position in zip(numbers, poses.quaternion_wxyz, 1e3 * poses.position_m))
    return "Tools,Port,Frame,State,Q0,Qx,Qy,Qz,Tx,Ty,Tz,Error\n" + "\n".join(rows) + "\n"


def mha(poses: Poses, unit: str) -> str:
    """Sequence of PlusToolkit without images: one transform and the times, mm."""
    from ._rotation import rotations

    with_attitude(poses, "mha")
    if unit != "mm":
        raise PoseError(f"--to mha: its positions are in mm; give --units mm, not {unit}")
    name = poses.sensor if poses.sensor.endswith("Transform") else f"Sensor{poses.sensor}ToTrackerTransform"
    turns = rotations(poses.quaternion_wxyz).as_matrix()
    lines = ["ObjectType = Image", "NDims = 3", "AnatomicalOrientation = RAI", "BinaryData = True", "BinaryDataByteOrderMSB = False", "CompressedData = False",
             f"DimSize = 0 0 {len(poses)}", "Kinds = domain domain list", "ElementSpacing = 1 1 1", "ElementType = MET_UCHAR", "Offset = 0 0 0",
             "TransformMatrix = 1 0 0 0 1 0 0 0 1", "UltrasoundImageOrientation = XX", "UltrasoundImageType = XX"]
    for n, (time_s, turn, position) in enumerate(zip(poses.time_s, turns, 1e3 * poses.position_m)):
        matrix = np.vstack((np.hstack((turn, position[:, None])), (0, 0, 0, 1)))
        lines += [f"Seq_Frame{n:04d}_{name} = {' '.join(format(value, '.12g') for value in matrix.flat)}", f"Seq_Frame{n:04d}_{name}Status = OK",
                  f"Seq_Frame{n:04d}_Timestamp = {time_s:.9f}", f"Seq_Frame{n:04d}_ImageStatus = INVALID"]
    return "\n".join([*lines, "ElementDataFile = LOCAL"]) + "\n"


FORMS = {"jsonl": jsonl, "motive": motive, "polhemus": polhemus, "ndi": ndi, "mha": mha}
IN_MM = ("ndi", "mha")


def converted(poses: Poses, form: str, unit: str | None = None, euler: str | None = None) -> str:
    """Text of the poses in a form: csv, or one of FORMS. Raises PoseError."""
    unit = unit or ("mm" if form in IN_MM else "m")
    if unit not in METRES:
        raise PoseError(f"--units must be m, cm, mm or in; is '{unit}'")
    euler = None if euler is None else str(euler)
    if euler is not None and (len(euler) != 3 or not set(euler.lower()) <= set("xyz") or euler[0] == euler[1] or euler[1] == euler[2]):
        raise PoseError(f"--euler must be three axes, for example zyx; is '{euler}'")
    if form == "csv":
        return csv(poses, unit, euler)
    if euler is not None:
        raise PoseError(f"--euler: only with --to csv; {form} has its own form of attitudes")
    if form not in FORMS:
        raise PoseError(f"--to {form}: only of a recording's folder; of a file of poses jsonl, csv, {', '.join(name for name in FORMS if name != 'jsonl')}")
    return FORMS[form](poses, unit)


def run(file, to="jsonl", out="-", units=None, euler=None, **reader) -> dict:
    """Writes the poses of a file in another form, or those of a recording's folder as MAT or MCAP, or its rests. Raises ValueError, OSError."""
    if os.path.isdir(file):
        from . import _mat_poses, _mcap_file, _rests

        given = {name: value for name, value in {"units": units, "euler": euler, **reader}.items() if value is not None}
        module = {"mat": _mat_poses, "mcap": _mcap_file, "rests": _rests}[to]
        return {"rests" if to == "rests" else "poses": module.run(file, out, given), "out": out, "form": to, "notes": []}
    refuse_others(reader, READER_OPTIONS, "only of a recording's folder")
    refuse_input_as_output({"--out": out}, [file])
    poses = read(file, **reader)
    write_whole(out, converted(poses, to, units, euler))
    return {"poses": len(poses), "out": out, "form": to, "notes": list(poses.notes)}


def text(result: dict) -> str:
    """The result as the program prints it."""
    count = f"{result['rests']} rests" if "rests" in result else f"{result['poses']} poses as {result['form']}"
    return "".join(f"  {note}\n" for note in result["notes"]) + f"{result['out']}: {count}\n"
