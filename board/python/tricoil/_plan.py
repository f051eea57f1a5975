"""`tricoil motion --plan`: path of a robot for the verification of a tracker, within its limits."""

import dataclasses

import numpy as np
from numpy.typing import NDArray

from ._output_file import refuse_input_as_output, write_whole
from ._poses import PoseError

RATE_HZ = 100.0
DWELL_S = 2.0
PAUSE_S = 0.5
SHARES = (0.25, 0.5, 1.0)  # of the limits
FREQUENCIES_HZ = (0.5, 1.0, 2.0)
SINE_S = 6.0
MIXED = ((1.0, 0.73, 0.59), (0.47, 0.61, 0.83))  # relative frequencies of combined motions: translation, rotation
MARGIN = 0.98  # of a limit
NEAREST_M, LONGEST_S, MOST_GRID = 0.1, 3600.0, 12
QUINTIC = (1.875, 5.7735026919, 60.0)  # largest derivatives of 10 u^3 - 15 u^4 + 6 u^5: Flash and Hogan, J. Neurosci. 5, 1688 (1985)
NAMES = ("speed", "acceleration", "jerk")


@dataclasses.dataclass(frozen=True)
class Limits:
    """Speed, acceleration and jerk of translations (m, s) and rotations (rad, s)."""

    move: NDArray
    turn: NDArray


@dataclasses.dataclass(frozen=True)
class Box:
    """center_m and size_m of the box, m; turn_rad: largest rotation from the mean attitude."""

    center_m: NDArray
    size_m: NDArray
    turn_rad: float


class Path:
    """Rows of position (m) and rotation vector (rad) at a fixed rate, with the names of their parts."""

    def __init__(self, rate_hz: float, start: NDArray):
        self.rate_hz, self.rows, self.parts, self.count = rate_hz, [start[None]], [], 1

    def _extend(self, count: int):
        """Before rows are made. Raises PoseError."""
        self.count += count
        if self.count - 1 > LONGEST_S * self.rate_hz:
            raise PoseError(f"--limits, --turn-limits: the plan takes more than {LONGEST_S:g} s, which is the longest; give larger limits, or a smaller grid or box")

    @property
    def here(self) -> NDArray:
        return self.rows[-1][-1]

    def begin(self, name: str):
        self.parts.append((name, self.count))

    def rest(self, seconds: float):
        count = max(1, round(seconds * self.rate_hz))
        self._extend(count)
        self.rows.append(np.repeat(self.here[None], count, axis=0))

    def go(self, there: NDArray, seconds: float):
        """A smooth move from rest to rest."""
        count = int(np.ceil(seconds * self.rate_hz))
        self._extend(count)
        if count:
            u = np.arange(1, count + 1)[:, None] / count
            self.rows.append(self.here + (there - self.here) * (10 * u**3 - 15 * u**4 + 6 * u**5))

    def add(self, offsets: NDArray):
        """Offsets (N, 6) that begin and end with 0."""
        self._extend(len(offsets))
        self.rows.append(self.here + offsets)


def shortest_s(distance: float, limits: NDArray) -> float:
    """Duration of the smooth move with which no limit is exceeded, s."""
    return max((factor * distance / (MARGIN * limit)) ** (1 / order) for factor, limit, order in zip(QUINTIC, limits, (1, 2, 3)))


def move_s(here, there, limits: Limits) -> float:
    return max(shortest_s(float(np.linalg.norm((there - here)[:3])), limits.move), shortest_s(float(np.linalg.norm((there - here)[3:])), limits.turn))


def travel(path: Path, there: NDArray, limits: Limits):
    path.go(there, move_s(path.here, there, limits))


def approach(path: Path, there: NDArray, limits: Limits):
    path.begin("approach")
    travel(path, there, limits)


def sweep(path: Path, step: NDArray, share: float, limits: NDArray, option: str, what: str):
    """There and back along `step` (6), with a share of the largest speed. Raises PoseError if it cannot be reached."""
    distance = float(np.linalg.norm(step))
    seconds = QUINTIC[0] * distance / (MARGIN * share * limits[0])
    for n in (1, 2):
        needed = QUINTIC[n] * distance / seconds ** (n + 1)
        if needed > limits[n]:
            raise PoseError(f"{option}: to reach the {NAMES[0]} {share * limits[0]:.3g} within {what}, the {NAMES[n]} must be {needed:.3g}; the limit is {limits[n]:.3g}. "
                            "Enlarge the box or the angle, or give a smaller speed")
    there = path.here + step
    start = path.here.copy()
    for target in (there, start):
        path.go(target, seconds)
        path.rest(PAUSE_S)


def window(time_s: NDArray, ramp_s: float) -> NDArray:
    """1 with smooth ramps from and to 0."""
    u = np.clip(np.minimum(time_s, time_s[-1] - time_s) / ramp_s, 0, 1)
    return 10 * u**3 - 15 * u**4 + 6 * u**5


def largest(offsets: NDArray, rate_hz: float) -> NDArray:
    """Largest speed, acceleration and jerk of rows (N, 3)."""
    found, rows = [], np.concatenate((np.repeat(offsets[:1], 4, axis=0), offsets, np.repeat(offsets[-1:], 4, axis=0)))
    for _ in range(3):
        rows = np.diff(rows, axis=0) * rate_hz
        found.append(np.linalg.norm(rows, axis=1).max())
    return np.array(found)


def oscillate(path: Path, amplitude: NDArray, frequencies_hz: NDArray, limits: Limits):
    """Sines (6), as large as the amplitudes and the limits permit."""
    time_s = np.arange(1, round(SINE_S * path.rate_hz) + 1) / path.rate_hz
    offsets = amplitude * np.sin(2 * np.pi * frequencies_hz * time_s[:, None]) * window(time_s, SINE_S / 4)[:, None]
    for part, limit in ((slice(0, 3), limits.move), (slice(3, 6), limits.turn)):
        used = (largest(offsets[:, part], path.rate_hz) / limit).max()
        offsets[:, part] *= min(1.0, MARGIN / used) if used > 0 else 1.0
    path.add(offsets)
    path.rest(PAUSE_S)


def grid_of(box: Box, count: int) -> NDArray:
    """Places of a grid (count^3, 3), in an order without long ways."""
    steps = np.linspace(-0.5, 0.5, count)
    places = []
    for n, x in enumerate(steps):
        for k, y in enumerate(steps if n % 2 == 0 else steps[::-1]):
            places += [(x, y, z) for z in (steps if (n * count + k) % 2 == 0 else steps[::-1])]
    return box.center_m + np.array(places) * box.size_m


def make(box: Box, limits: Limits, count: int, rate_hz: float) -> Path:
    """Static grid, then speeds, oscillations, distances: each axis alone, then combined."""
    centre = np.append(box.center_m, np.zeros(3))
    turns = box.turn_rad * np.eye(3)
    path = Path(rate_hz, centre)
    path.begin("grid at rest")
    for place in grid_of(box, count):
        travel(path, np.append(place, np.zeros(3)), limits)
        path.rest(DWELL_S)
    edges = [(f"axis {name}", edge) for name, edge in zip("xyz", np.diag(box.size_m))] + [("diagonal", box.size_m)]
    angles = [(f"axis {name}", turn) for name, turn in zip("xyz", turns)] + [("all axes", turns.sum(axis=0) / np.sqrt(3))]
    for share in SHARES:
        for name, edge in edges:
            step = np.append(edge, np.zeros(3))
            approach(path, centre - step / 2, limits)
            path.begin(f"speed {share * limits.move[0]:g} m/s, {name}")
            sweep(path, step, share, limits.move, "--limits", f"{np.linalg.norm(edge):.3g} m ({name})")
        for name, angle in angles:
            step = 2 * np.append(np.zeros(3), angle)
            approach(path, centre - step / 2, limits)
            path.begin(f"rate {share * limits.turn[0]:g} rad/s, {name}")
            sweep(path, step, share, limits.turn, "--turn-limits", f"{2 * np.degrees(box.turn_rad):.3g} deg ({name})")
    approach(path, centre, limits)
    for frequency in FREQUENCIES_HZ:
        for n, name in enumerate(("x", "y", "z", "rotation about x", "rotation about y", "rotation about z")):
            path.begin(f"oscillation {frequency:g} Hz, {name}")
            oscillate(path, np.append(box.size_m / 2, np.full(3, box.turn_rad))[n] * np.eye(6)[n], np.full(6, frequency), limits)
    depth = int(np.argmax(np.abs(box.center_m)))
    for name, share in (("near", -0.5), ("middle", 0.0), ("far", 0.5)):
        there = centre.copy()
        there[depth] += np.sign(box.center_m[depth]) * share * box.size_m[depth]
        approach(path, there, limits)
        path.begin(f"combined, {name}")
        reach = box.size_m / 2
        reach[depth] = 0.0 if share else reach[depth]
        for frequency in FREQUENCIES_HZ:
            oscillate(path, np.append(reach / np.sqrt(3), np.full(3, box.turn_rad / np.sqrt(3))), frequency * np.concatenate(MIXED), limits)
    approach(path, centre, limits)
    path.rest(DWELL_S)
    return path


def numbers(option, value, default, count, least=0.0) -> NDArray:
    """Numbers of an option, all larger than `least`. Raises PoseError."""
    words = default if value is None else value.split(",") if isinstance(value, str) else np.atleast_1d(value)
    try:
        found = np.array([float(word) for word in words])
    except (TypeError, ValueError):
        found = np.zeros(0)
    if found.shape != (count,) or not np.isfinite(found).all() or not (found > least).all():
        larger = " larger than 0" if least == 0 else ""
        what = f"a number{larger}" if count == 1 else f"{count} numbers{larger}, separated by commas"
        raise PoseError(f"{option} must be {what}; is '{value}'")
    return found


def summary(path: Path, rows: NDArray, plan: str) -> dict:
    """The result of `tricoil motion --plan --json`."""
    ends = [begin for _, begin in path.parts[1:]] + [len(rows)]
    parts = []
    for (name, begin), end in zip(path.parts, ends):
        move, turn = (largest(rows[begin:end, part], path.rate_hz) for part in (slice(0, 3), slice(3, 6)))
        parts.append({"name": name, "from_s": begin / path.rate_hz, "duration_s": (end - begin) / path.rate_hz, "max_speed_m_s": float(move[0]),
                      "max_acceleration_m_s2": float(move[1]), "max_rate_rad_s": float(turn[0]), "max_angular_acceleration_rad_s2": float(turn[1])})
    range_m = np.linalg.norm(rows[:, :3], axis=1)
    return {"plan": plan, "poses": len(rows), "duration_s": (len(rows) - 1) / path.rate_hz, "rate_hz": path.rate_hz, "nearest_m": float(range_m.min()),
            "farthest_m": float(range_m.max()), "parts": parts}


def text(result: dict) -> str:
    """The result as the program prints it."""
    lines = [f"{result['plan']}: {result['poses']} poses at {result['rate_hz']:g} Hz, {result['duration_s']:.1f} s, {result['nearest_m']:.2f} to {result['farthest_m']:.2f} m from the source",
             "  part                                     from, s      m/s    m/s^2    rad/s  rad/s^2"]
    lines += [f"  {one['name']:<40}{one['from_s']:8.1f} {one['max_speed_m_s']:8.3f} {one['max_acceleration_m_s2']:8.3f} {one['max_rate_rad_s']:8.3f} {one['max_angular_acceleration_rad_s2']:8.2f}"
              for one in result["parts"] if one["name"] != "approach"]
    if "joints" in result:
        lines.append("  joint                                 lowest, rad or m  highest  largest speed")
        lines += [f"  {one['joint']:<40}{one['lowest']:14.3f} {one['highest']:8.3f} {one['max_speed']:14.3f}" for one in result["joints"]]
    return "\n".join(lines) + "\n"


def part_names(path: Path, count: int) -> list[str]:
    """Of each row."""
    names, begins = [name.replace(",", "") for name, _ in path.parts], np.array([begin for _, begin in path.parts])
    return [names[max(0, n)] for n in np.searchsorted(begins, np.arange(count), side="right") - 1]


def csv(rows: NDArray, rate_hz: float, parts: list[str], joints: dict[str, NDArray]) -> str:
    """time_s, position, quaternion, joint values (rad or m) and the name of the part."""
    from scipy.spatial.transform import Rotation

    from ._rotation import wxyz

    q = wxyz(Rotation.from_rotvec(rows[:, 3:]))
    lines = [",".join(("time_s,x_m,y_m,z_m,qw,qx,qy,qz", *joints, "part"))]
    for n, values in enumerate(np.column_stack((rows[:, :3], q, *joints.values()))):
        lines.append(f"{n / rate_hz:.6f}," + ",".join(f"{value:.9f}" for value in values) + f",{parts[n]}")
    return "\n".join(lines) + "\n"


def joints_along(chain, link, start_joints, center_m, rows, rate_hz, parts) -> tuple[dict[str, NDArray], list[dict]]:
    """Columns and summary of the joints of --chain; none without it. Raises PoseError."""
    if chain is None:
        if link is not None or start_joints is not None:
            raise PoseError("--link, --start-joints: require --chain, the robot")
        return {}, []
    from . import _plan_joints
    from ._chain import read_chain

    robot = read_chain(chain, link)
    names = robot.wanted()
    if not names or any(name not in {one.name for one in robot.joints} for name in names):
        raise PoseError(f"--chain: {robot.name} has no joint that moves, or one that mimics a joint outside the chain")
    if start_joints is None:
        raise PoseError(f"--chain needs --start-joints: the values of {', '.join(names)} in the middle of the box, in deg (prismatic: mm)")
    factor = np.array([np.pi / 180 if robot.joint(name).kind == "revolute" else 1e-3 for name in names])
    start = factor * numbers("--start-joints", start_joints, (), len(names), -np.inf)
    values = _plan_joints.follow(robot, start, center_m, rows, rate_hz, parts.__getitem__)
    return dict(zip(names, values.T)), _plan_joints.summary_of(robot, values, rate_hz)


def run(plan, center=None, size=None, grid=None, limits=None, turn_limits=None, turn=None, rate_hz=None, chain=None, link=None, start_joints=None) -> tuple[dict, str]:
    """Writes the path of --plan. Result and text. Raises PoseError, OSError."""
    box = Box(numbers("--center", center, (0.6, 0.0, 0.0), 3, -np.inf), numbers("--size", size, (0.4, 0.4, 0.4), 3),
              float(np.radians(numbers("--turn", turn, (45.0,), 1)[0])))
    both = Limits(numbers("--limits", limits, (1.0, 10.0, 100.0), 3), numbers("--turn-limits", turn_limits, (3.0, 30.0, 300.0), 3))
    count = numbers("--grid", grid, (3.0,), 1)[0]
    rate = float(numbers("--rate-hz", rate_hz, (RATE_HZ,), 1)[0])
    if count != int(count) or not 2 <= count <= MOST_GRID:
        raise PoseError(f"--grid must be a whole number of 2 to {MOST_GRID}; is '{grid}'")
    if not 10 * FREQUENCIES_HZ[-1] <= rate <= 1e4:
        raise PoseError(f"--rate-hz must be {10 * FREQUENCIES_HZ[-1]:g} to 10000 poses a second for a plan; is {rate:g}")
    if box.turn_rad > np.radians(170):
        raise PoseError(f"--turn must be at most 170 deg; is {np.degrees(box.turn_rad):g}")
    nearest = float(np.linalg.norm(np.maximum(np.abs(box.center_m) - box.size_m / 2, 0)))
    if nearest < NEAREST_M:
        raise PoseError(f"--center, --size: the box comes as near as {nearest:.3g} m to the source; {NEAREST_M:g} m are needed; move it, or make it smaller")
    places = grid_of(box, int(count))
    seconds = sum(move_s(np.append(a, np.zeros(3)), np.append(b, np.zeros(3)), both) + DWELL_S for a, b in zip(places[:-1], places[1:]))
    if seconds > LONGEST_S:
        raise PoseError(f"--grid, --limits: the grid alone takes {seconds:.0f} s; at most {LONGEST_S:g} s are planned; give a smaller grid, or a larger speed")
    path = make(box, both, int(count), rate)
    rows = np.concatenate(path.rows)
    refuse_input_as_output({"--plan": plan}, [chain])
    parts = part_names(path, len(rows))
    joints, summary_of_joints = joints_along(chain, link, start_joints, box.center_m, rows, rate, parts)
    write_whole(plan, csv(rows, rate, parts, joints))
    result = summary(path, rows, plan)
    if joints:
        result["joints"] = summary_of_joints
    return result, text(result)
