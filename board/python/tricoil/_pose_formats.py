"""Files of other systems, as tables: Motive CSV, NDI tables, .igs.mha (PlusToolkit), JSON lines, own MCAP."""

import json
import re

from . import _mcap
from ._poses import PoseError
from ._pose_text import Table, decoded, separator_of, split

WXYZ = ("qw", "qx", "qy", "qz")
XYZ = ("x", "y", "z")


def find(data: bytes):
    """The function that reads this file, called with (data, name, sensor); None: a table with names, or JSON lines."""
    if data.startswith(_mcap.MAGIC):
        return mcap
    if data.startswith(b"#ROSBAG") or data.startswith(b"SQLite format 3") or (data[1:2] == b"P" and b"\0" in data[:512]):
        return binary
    begin = data[:4096].lstrip(b"\xef\xbb\xbf").lstrip()
    if begin.startswith(b"Format Version"):
        return motive
    if re.match(rb"\w+ = ", begin) and b"Seq_Frame" in data[:1 << 16]:
        return mha
    if re.match(rb"\"?Tools\"?[,;\t]", begin):
        return ndi
    return None


def mcap(data, name, _):
    """Of tricoil convert --to mcap."""
    return json_lines(_mcap.json_text(data, name), name)


def binary(data, name, _):
    """Refuses C3D and rosbag, which no library of this system reads."""
    kind = "C3D" if data[1:2] == b"P" else "a rosbag"
    mend = "export CSV with the program that wrote it" if kind == "C3D" else "export its poses as CSV or JSON lines, for example with ros2 topic echo --csv"
    raise PoseError(f"{name}: is {kind}, a binary format that is not read; {mend}")


def chosen(names, sensor, name, what):
    """Name of the body that `sensor` means: its name, or its place in the file, from 1."""
    by_name = {text.lower(): text for text in names}
    if sensor is None and len(names) == 1:
        return names[0]
    shown = ", ".join(names[:6]) + (", ..." if len(names) > 6 else "")
    if sensor is None:
        raise PoseError(f"{name}: has the {what} {shown}; choose one with --sensor" if names else f"{name}: has no {what}")
    if str(sensor).lower() in by_name:
        return by_name[str(sensor).lower()]
    if f"{sensor}totrackertransform".lower() in by_name:  # PlusToolkit: Stylus is StylusToTrackerTransform
        return by_name[f"{sensor}totrackertransform".lower()]
    if re.fullmatch("[0-9]+", str(sensor)) and 1 <= int(sensor) <= len(names):
        return names[int(sensor) - 1]
    raise PoseError(f"{name}: has no {sensor}; it has {shown}")


def motive(data, name, sensor):
    """OptiTrack Motive: rigid bodies, or markers by name."""
    lines = decoded(data).splitlines()
    rows = [split(line, ",") for line in lines]
    meta = dict(zip(rows[0][::2], rows[0][1::2]))
    units = {"meters": "m", "centimeters": "cm", "millimeters": "mm"}.get(meta.get("Length Units", "").lower())
    if units is None and "Length Units" in meta:  # versions before 1.2 do not name it
        raise PoseError(f"{name}:1: Length Units must be Meters, Centimeters or Millimeters; is '{meta['Length Units']}'")
    first = next((n for n, fields in enumerate(rows[:20]) if fields[0].isdigit()), 20)
    head = next((n for n, fields in enumerate(rows[:20]) if fields[:1] == ["Frame"]), first - 1)
    if head < 4 or head >= len(rows) or first == 20 and rows[head][0] != "Frame":
        raise PoseError(f"{name}: no line that begins with Frame; export from Motive with its header")
    width = max(2, *map(len, rows[:head + 1]))
    above = [fields + [""] * (width - len(fields)) for fields in rows[:head + 1]]
    axes = above.pop()
    header = [fields for fields in above[1:] if any(fields)]  # types, names, identifiers, also parents, then kinds
    names = next((fields for fields in header if fields[1] == "Name"), header[1] if len(header) > 3 and not header[1][1] else [])
    kinds = above[-1]
    if not names:
        raise PoseError(f"{name}: no line of names; export from Motive with its header")
    bodies = list(dict.fromkeys(names[n] for n in range(2, len(axes)) if kinds[n] == "Rotation"))
    positions = list(dict.fromkeys(names[n] for n in range(2, len(axes)) if kinds[n] == "Position"))
    body = chosen(positions if sensor is not None and not str(sensor).isdigit() or not bodies else bodies, sensor, name, "bodies")
    places = {(kinds[n], axes[n].lower()): n for n in range(2, len(axes)) if names[n] == body}
    needed = [("Position", axis) for axis in XYZ] + [("Rotation", axis) for axis in ("xyzw" if ("Rotation", "x") in places else "")]
    for kind, axis in needed:
        if (kind, axis) not in places:
            raise PoseError(f"{name}:{head + 1}: {body} has no column {kind} {axis.upper()}; export from Motive with all axes")
    columns = [("frame", 0), ("time_s", 1)] + [(axis, places["Position", axis]) for axis in XYZ]
    if ("Rotation", "x") in places:
        if meta.get("Rotation Type", "Quaternion") != "Quaternion":
            raise PoseError(f"{name}:1: Rotation Type is {meta['Rotation Type']}; export from Motive with Quaternion")
        columns += [(q, places["Rotation", q[1]]) for q in WXYZ]
    used = [(n, fields + [""] * (len(axes) - len(fields))) for n, fields in enumerate(rows[head + 1:], head + 2) if any(fields)]
    return Table(name, [column for column, _ in columns], [[fields[n] for _, fields in used] for _, n in columns], [n for n, _ in used],
                 {"length": units, "sensor": body})


def ndi(data, name, sensor):
    """NDI: a line of names whose part from Frame to Error repeats for each tool; mm."""
    lines = [(n, line) for n, line in enumerate(decoded(data).splitlines(), 1) if line.strip()]
    separator = separator_of(lines[0][1])
    names = [text.lower() for text in split(lines[0][1], separator)]
    starts = [n for n, text in enumerate(names) if text == "q0"]
    frames = [max((n for n in range(start) if names[n] == "frame"), default=0) for start in starts]
    titles = split(lines[0][1], separator)
    tools = [titles[n - 1] for n in frames]
    if len(set(tools)) < len(tools) or 0 in frames:
        tools = [str(n + 1) for n in range(len(starts))]
    tool = chosen(tools, sensor, name, "tools")
    start = starts[tools.index(tool)]
    wanted = ("q0", "qx", "qy", "qz", "tx", "ty", "tz")
    if names[start:start + 7] != list(wanted):
        raise PoseError(f"{name}:1: the columns of a tool must be Q0, Qx, Qy, Qz, Tx, Ty, Tz")
    frame = max((n for n in range(start) if names[n] == "frame"), default=None)
    state = max((n for n in range(start) if names[n] == "state"), default=None)
    if frame is None:
        raise PoseError(f"{name}:1: no column Frame before {names[start]}")
    order = [frame, *range(start, start + 7)]
    rows = []
    for n, line in lines[1:]:
        fields = split(line, separator)
        fields += [""] * (len(names) - len(fields))
        visible = state is None or fields[state].lower() in ("ok", "enabled", "visible")
        rows.append((n, [fields[k] if visible or k == frame else "" for k in order]))
    return Table(name, ["frame", *WXYZ, *XYZ], [[fields[k] for _, fields in rows] for k in range(8)], [n for n, _ in rows],
                 {"length": "mm", "sensor": tool})


def mha(data, name, sensor):
    """PlusToolkit: matrices of the transform that `sensor` names, mm, with their timestamps."""
    text = data.split(b"ElementDataFile", 1)[0].decode("utf-8", errors="replace")
    frames, lines = {}, {}
    for number, line in enumerate(text.splitlines(), 1):
        if found := re.match(r"Seq_Frame([0-9]+)_(\w+) =(.*)", line):
            frames.setdefault(found[1], {})[found[2]] = found[3].strip()
            lines.setdefault(found[1], number)
    names = list(dict.fromkeys(key for fields in frames.values() for key in fields if key.endswith("Transform")))
    transform = chosen([key for key in names if not key.startswith("ImageTo")] or names, sensor, name, "transforms")
    rows, at = [], []
    for number, fields in frames.items():
        values = fields.get(transform, "").split()
        if fields.get(transform + "Status", "OK") != "OK":
            values = [""] * 16
        if len(values) != 16:
            raise PoseError(f"{name}:{lines[number]}: {transform} has {len(values)} numbers; a homogeneous matrix has 16")
        rows.append([fields.get("Timestamp", ""), *values])
        at.append(lines[number])
    columns = ["time_s", *(f"m{row}{column}" for row in range(1, 5) for column in range(1, 5))]
    return Table(name, columns, [list(column) for column in zip(*rows)], at, {"length": "mm", "sensor": transform})


def flat(value, prefix=""):
    """Numbers and texts of an object by name: {"position_m": [1, 2, 3]} has x_m, y_m and z_m."""
    if isinstance(value, dict):
        return {key: one for name, part in value.items() for key, one in flat(part, f"{prefix}{name}.").items()}
    name = prefix[:-1]
    if isinstance(value, list):
        plain = name.split(".")[-1].lower()
        if found := re.fullmatch(r"(?:position|pos|p|translation|t)(?:_(m|cm|mm|in))?", plain):
            return {f"{axis}_{found[1]}" if found[1] else axis: str(one) for axis, one in zip(XYZ, value)} if len(value) == 3 else {}
        if plain in ("q_wxyz", "quaternion_wxyz"):
            return dict(zip(WXYZ, map(str, value)))
        if plain in ("q_xyzw", "quaternion_xyzw"):
            return dict(zip(("qx", "qy", "qz", "qw"), map(str, value)))
        if (found := re.fullmatch(r"std_(m|cm|mm|in)_rad", plain)) and len(value) == 6:
            names = [f"std_{axis}_{found[1]}" for axis in XYZ] + [f"std_r{axis}_rad" for axis in XYZ]
            return {key: "" if one is None else str(one) for key, one in zip(names, value)}
        return {}
    return {name: "" if value is None else str(value)}


def json_lines(data, name):
    """One object a line, as tricoil prints them; also nested, as robots' logs have them."""
    rows, at = [], []
    for number, line in enumerate(decoded(data).splitlines(), 1):
        if not line.strip():
            continue
        try:
            value = json.loads(line)
        except ValueError as error:
            raise PoseError(f"{name}:{number}: is no JSON object ({error})") from None
        if not isinstance(value, dict):
            raise PoseError(f"{name}:{number}: is no JSON object")
        rows.append(flat(value))
        at.append(number)
    poses = [n for n, row in enumerate(rows) if any(key[:2] in ("x", "x_") or key.endswith(".x") for key in row)]
    columns = list(dict.fromkeys(key for n in poses for key in rows[n]))
    has_every = {key for key in columns if all(key in rows[n] for n in poses)}
    keep = [key for key in columns if key in has_every or re.match(r"([xyz]|q[wxyz])(_|$)", key)]
    left_out = len(rows) - len(poses)
    return Table(name, keep, [[rows[n].get(key, "") for n in poses] for key in keep], [at[n] for n in poses],
                 notes=[f"{left_out} lines without a position are left out"] if left_out else [])
