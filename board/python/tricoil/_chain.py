"""Kinematic chains: poses of the last link of a robot from its joint values. Denavit-Hartenberg table or URDF."""

import dataclasses
import os

import numpy as np
from scipy.spatial.transform import Rotation

from ._pose_text import table
from ._poses import METRES, Poses, PoseError, checked, content_of
from ._rotation import crosses, wxyz
from ._xml_file import root_of

DH_COLUMNS = {"a": METRES, "d": METRES, "alpha": None, "theta": None}
RADIANS = {"rad": 1.0, "deg": np.pi / 180}
TYPES = ("revolute", "prismatic", "fixed")
UNLIMITED = (-np.inf, np.inf, np.inf)


@dataclasses.dataclass
class Joint:
    """A fixed transform before the joint, the motion about or along its axis, and a fixed transform after it.

    mimic: (name, factor, offset). limits: lowest and highest value and largest speed, rad or m.
    """

    name: str
    kind: str
    axis: np.ndarray
    before: tuple
    after: tuple
    mimic: tuple | None = None
    limits: tuple[float, float, float] = UNLIMITED


@dataclasses.dataclass
class Chain:
    name: str
    joints: list[Joint]

    def wanted(self):
        """Names of the joint values, in order, each once."""
        return list(dict.fromkeys(one.mimic[0] if one.mimic else one.name for one in self.joints if one.kind != "fixed"))

    def joint(self, name):
        return next(one for one in self.joints if one.name == name)

    def pose(self, values):
        """Position (N, 3) and Rotation of the last link in the first one's frame. values: {name: (N,) in rad or m}."""
        count = len(next(iter(values.values()))) if values else 1
        position, turn = np.zeros((count, 3)), np.broadcast_to(np.eye(3), (count, 3, 3))
        for one in self.joints:
            position, turn = position + turn @ one.before[0], turn @ one.before[1].as_matrix()
            if one.kind != "fixed":
                source, factor, offset = one.mimic or (one.name, 1.0, 0.0)
                moved = factor * values[source] + offset
                position, turn = (position, turn @ turns_about(one.axis, moved)) if one.kind == "revolute" else (position + turn @ one.axis * moved[:, None], turn)
            position, turn = position + turn @ one.after[0], turn @ one.after[1].as_matrix()
        return position, Rotation.from_matrix(turn)


def turns_about(axis, angle_rad):
    """Rotation matrices (N, 3, 3) about an axis of length 1, (3,), by angles (N,), by Rodrigues' formula."""
    cross = crosses(axis[None])[0]
    angle_rad = angle_rad[:, None, None]
    return np.eye(3) + np.sin(angle_rad) * cross + (1 - np.cos(angle_rad)) * (cross @ cross)


NOWHERE = (np.zeros(3), Rotation.identity())


def read_chain(path, link=None) -> Chain:
    """A chain from a URDF file (.urdf, .xml) to `link`, or from a Denavit-Hartenberg table. Raises PoseError."""
    name = os.fspath(path)
    data = content_of(name)
    if data.lstrip()[:1] == b"<":
        return urdf(data, name, link)
    if link is not None:
        raise PoseError(f"{name}: a Denavit-Hartenberg table has one chain; leave --link out")
    return denavit_hartenberg(data, name)


def denavit_hartenberg(data, name) -> Chain:
    """Columns a, alpha, d, theta with units (a_m, alpha_deg ...), and optionally joint, type and convention (standard; modified: Craig 1989).

    Limits of the joints, optional: lower, upper and speed (per second), in deg, or mm of a prismatic joint.
    """
    content = table(data, name)
    texts, factors = {}, {}
    for n, column in enumerate(content.columns):
        plain, _, unit = column.strip().lower().partition("_")
        if plain in DH_COLUMNS:
            units = DH_COLUMNS[plain] or RADIANS
            if unit not in units:
                raise PoseError(f"{name}: column {column} has no unit; name it {plain}_{next(iter(units))}")
            factors[plain] = (n, units[unit])
        elif column.strip().lower() in ("joint", "type", "convention"):
            texts[column.strip().lower()] = content.fields[n]
    limits = dh_limits(content)
    missing = [one for one in DH_COLUMNS if one not in factors]
    if missing:
        raise PoseError(f"{name}: has no column {missing[0]}; a Denavit-Hartenberg table has a_m, alpha_rad, d_m, theta_rad, and joint, type and convention if wanted")
    a, d, alpha, theta = (factors[one][1] * content.numbers(factors[one][0]) for one in ("a", "d", "alpha", "theta"))
    joints = []
    for n in range(len(content)):
        kind = texts["type"][n].lower() if "type" in texts else "revolute"
        convention = texts["convention"][n].lower() if "convention" in texts else "standard"
        if kind not in TYPES or convention not in ("standard", "modified"):
            raise PoseError(f"{content.where(n)}: type must be {', '.join(TYPES)}, convention standard or modified; is {kind}, {convention}")
        if not np.isfinite([a[n], d[n], alpha[n], theta[n]]).all():
            raise PoseError(f"{content.where(n)}: a value is not finite")
        along_x = np.array([a[n], 0, 0]), Rotation.from_rotvec([alpha[n], 0, 0])
        along_z = np.array([0, 0, d[n]]), Rotation.from_rotvec([0, 0, theta[n]])
        before, after = (along_x, along_z) if convention == "modified" else (along_z, along_x)
        if convention == "modified":
            before, after = (along_x[0] + along_x[1].apply(along_z[0]), along_x[1] * along_z[1]), NOWHERE
        joints.append(Joint(texts["joint"][n] if "joint" in texts else f"q{n + 1}", kind, np.array([0.0, 0, 1]), before, after,
                            limits=tuple(limits[:, n] * (1e-3 if kind == "prismatic" else RADIANS["deg"]))))
    names = [one.name for one in joints]
    if len(set(names)) < len(names):
        raise PoseError(f"{name}: joint {next(one for one in names if names.count(one) > 1)} is there twice")
    return Chain(name, joints)


def dh_limits(content) -> np.ndarray:
    """Columns lower, upper and speed, (3, N); without a column or a value: no limit."""
    titles = [column.strip().lower() for column in content.columns]
    limits = np.repeat(np.array(UNLIMITED)[:, None], len(content), axis=1)
    for row, title in zip(limits, ("lower", "upper", "speed")):
        if title in titles:
            column = titles.index(title)
            given = np.flatnonzero(~content.empty([column])[0])
            row[given] = content.taken(given).numbers(column)
    return limits


def vector(element, attribute, default, name, joint):
    text = default if element is None else element.get(attribute, default)
    try:
        values = np.array([float(word) for word in text.split()])
    except ValueError:
        values = np.zeros(0)
    if values.shape != (3,) or not np.isfinite(values).all():
        raise PoseError(f"{name}: joint {joint}: {attribute} must be three numbers; is '{text[:40]}'")
    return values


def urdf_joint(element, name) -> tuple[str, str, Joint]:
    """Parent link, child link and joint."""
    joint, kind = element.get("name"), element.get("type")
    ends = [element.find(one) for one in ("parent", "child")]
    if joint is None or any(one is None or one.get("link") is None for one in ends):
        raise PoseError(f"{name}: joint {joint or 'without name'} has no parent or no child link")
    origin = element.find("origin")
    before = vector(origin, "xyz", "0 0 0", name, joint), Rotation.from_euler("xyz", vector(origin, "rpy", "0 0 0", name, joint))
    limits = urdf_limits(element.find("limit"), kind, name, joint)
    kind = "revolute" if kind == "continuous" else kind
    axis = vector(element.find("axis"), "xyz", "1 0 0", name, joint)
    if kind in ("revolute", "prismatic"):
        if not axis.any():
            raise PoseError(f"{name}: joint {joint}: the axis is 0 0 0")
        axis = axis / np.linalg.norm(axis)
    copy, mimic = element.find("mimic"), None
    if copy is not None:
        try:
            mimic = (copy.get("joint"), float(copy.get("multiplier", "1")), float(copy.get("offset", "0")))
        except ValueError:
            raise PoseError(f"{name}: joint {joint}: mimic must have numbers") from None
    return ends[0].get("link"), ends[1].get("link"), Joint(joint, kind, axis, before, NOWHERE, mimic, limits)


def urdf_limits(element, kind, name, joint) -> tuple[float, float, float]:
    """A continuous joint has no lower and upper limit; equal ones, and a velocity of 0, are those of a file that does not state them."""
    if element is None:
        return UNLIMITED
    try:
        low, high, speed = (float(element.get(one, default)) for one, default in (("lower", "0"), ("upper", "0"), ("velocity", "inf")))
    except ValueError:
        low = high = speed = float("nan")
    if not (low <= high and speed >= 0):
        raise PoseError(f"{name}: joint {joint}: limit must have numbers, lower below upper")
    return (*(UNLIMITED[:2] if kind == "continuous" or low == high else (low, high)), speed or np.inf)


def urdf(data, name, link) -> Chain:
    root = root_of(data, name)
    if root.tag != "robot":
        raise PoseError(f"{name}: is no URDF: its root element is '{root.tag[:40]}', not robot")
    to = {}  # child: (parent, joint)
    for element in root.findall("joint"):
        parent, child, joint = urdf_joint(element, name)
        if child in to:
            raise PoseError(f"{name}: link {child} has two parent joints, {to[child][1].name} and {joint.name}: a loop is no chain")
        to[child] = (parent, joint)
    links = {one.get("name") for one in root.findall("link")}
    for child, (parent, joint) in to.items():
        unknown = next((one for one in (parent, child) if one not in links), None)
        if unknown is not None:
            raise PoseError(f"{name}: joint {joint.name} has the link {unknown}, which is not in the file")
    parents = {parent for parent, _ in to.values()}
    leaves = sorted(links - parents)
    if link is None:
        if len(leaves) != 1:
            raise PoseError(f"{name}: ends in {', '.join(leaves[:6]) or 'no link: it is a loop'}" + ("; choose one with --link" if leaves else ""))
        link = leaves[0]
    if link not in links:
        raise PoseError(f"{name}: has no link {link}; it has {', '.join(sorted(links)[:8])}")
    joints, seen, tip = [], set(), link
    while tip in to:
        if tip in seen:
            raise PoseError(f"{name}: the joints of link {link} are a loop")
        seen.add(tip)
        tip, joint = to[tip]
        joints.insert(0, joint)
    for joint in joints:
        if joint.kind not in TYPES:
            raise PoseError(f"{name}: joint {joint.name} is of type {joint.kind}; only revolute, continuous, prismatic and fixed ones are possible")
    names = {element.get("name") for element in root.findall("joint")}
    for joint in joints:
        if joint.mimic and joint.mimic[0] not in names:
            raise PoseError(f"{name}: joint {joint.name} mimics {joint.mimic[0]}, which is not in the file")
    return Chain(name, joints)


def joint_poses(chain: Chain, path) -> Poses:
    """Poses of the last link from a table of time_s and one column a joint, NAME, NAME_rad or NAME_m, or NAME_deg or NAME_mm. Raises PoseError."""
    name = os.fspath(path)
    data = content_of(name)
    content = table(data, name)
    titles = [column.strip() for column in content.columns]
    kinds = {one.name: one.kind for one in chain.joints}
    used = {"": (titles.index("time_s"), 1.0)} if "time_s" in titles else {}
    if not used:
        raise PoseError(f"{name}: has no column time_s")
    for wanted in chain.wanted():
        units = METRES if kinds.get(wanted) == "prismatic" else RADIANS
        given = {wanted: 1.0, **{f"{wanted}_{unit}": factor for unit, factor in units.items()}}
        found = [(titles.index(title), factor) for title, factor in given.items() if title in titles]
        if len(found) != 1:
            raise PoseError(f"{name}: has {'two columns' if found else 'no column'} of joint {wanted}; {chain.name} has the joints {', '.join(chain.wanted())}")
        used[wanted] = found[0]
    _, some = content.empty([n for n, _ in used.values()])
    notes = (f"{some.sum()} rows with empty fields are left out",) if some.any() else ()
    content = content.taken(np.flatnonzero(~some))
    values = {one: factor * content.numbers(n) for one, (n, factor) in used.items()}
    broken = ~np.isfinite(np.column_stack(list(values.values()))).all(axis=1)
    if broken.any():
        raise PoseError(f"{content.where(int(np.argmax(broken)))}: is not finite; leave the field empty, or remove the line")
    time_s = values.pop("")
    if not values:
        raise PoseError(f"{chain.name}: has no joint that moves")
    position, turn = chain.pose(values)
    return checked(time_s, position, wxyz(turn), name, content.where, notes)
