"""Joint values of a robot along a planned path, within the limits of its joints."""

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from ._chain import Chain
from ._poses import PoseError

KNOT_S = 0.2  # between rows that are solved in turn; splines through them start the others
STEP = 1e-6  # of a joint, for differences
DAMPING = 1e-4  # of a step, m and rad
LONGEST_STEP = 0.3  # of a joint, rad and m; near singular positions
STEPS_TO_KNOT, STEPS_TO_ROW = 30, 8
LEAST_LEFT = 1e-6  # m and rad


def _pose(chain: Chain, names: list[str], values: NDArray):
    return chain.pose(dict(zip(names, values.T)))


def _step(chain: Chain, names: list[str], values: NDArray, target) -> tuple[NDArray, NDArray]:
    """A damped Newton step of each row, and what was left before it: values (N, joints) -> (N, joints), (N, 6)."""
    count, joints = values.shape
    around = np.repeat(values[None], joints + 1, axis=0)
    around[np.arange(joints), :, np.arange(joints)] += STEP
    position, turn = _pose(chain, names, around.reshape(-1, joints))
    position, turn = position.reshape(joints + 1, count, 3), turn.as_matrix().reshape(joints + 1, count, 3, 3)
    here, attitude = position[-1], turn[-1]
    moved = np.transpose((position[:-1] - here) / STEP, (1, 2, 0))
    turned = Rotation.from_matrix((turn[:-1] @ np.swapaxes(attitude, -1, -2)).reshape(-1, 3, 3)).as_rotvec().reshape(joints, count, 3) / STEP
    jacobian = np.concatenate((moved, np.transpose(turned, (1, 2, 0))), axis=1)
    left = np.hstack((target[0] - here, (target[1] * Rotation.from_matrix(attitude).inv()).as_rotvec()))
    square = jacobian @ np.swapaxes(jacobian, -1, -2) + DAMPING**2 * np.eye(6)
    step = np.einsum("nij,ni->nj", jacobian, np.linalg.solve(square, left[..., None])[..., 0])
    return step * np.minimum(1, LONGEST_STEP / np.maximum(np.abs(step).max(axis=1, keepdims=True), 1e-12)), left


def _solved(chain, names, values, target, steps) -> tuple[NDArray, NDArray]:
    """Values (N, joints) after at most so many steps, and what is left (N, 6)."""
    values, left, rows = values.copy(), np.zeros((len(values), 6)), np.arange(len(values))
    for n in range(steps + 1):
        step, left[rows] = _step(chain, names, values[rows], (target[0][rows], target[1][rows]))
        is_open = np.abs(left[rows]).max(axis=1) > LEAST_LEFT / 10
        rows, step = rows[is_open], step[is_open]
        if n == steps or not len(rows):
            break
        values[rows] += step
    return values, left


def _targets(chain, names, start, center_m, rows):
    """Poses of the last link: at `start` (joint values) it is in the middle of the box, and parallel to the axes of the source."""
    position, turn = _pose(chain, names, start[None])
    return position + turn.apply(rows[:, :3] - center_m), turn * Rotation.from_rotvec(rows[:, 3:])


def follow(chain: Chain, start: NDArray, center_m: NDArray, rows: NDArray, rate_hz: float, part_of) -> NDArray:
    """Joint values (N, joints; rad, m) with which the last link follows rows of position (m) and rotation vector (rad).

    start: joint values at center_m. part_of(row): name of a part of the path. Raises PoseError if the robot cannot, or not within its limits.
    """
    names = chain.wanted()
    position, turn = _targets(chain, names, start, center_m, rows)

    def refuse_unreachable(indices, left):
        if np.abs(left).max() > LEAST_LEFT:
            n = int(np.argmax(np.abs(left).max(axis=1)))
            move, rotation = np.linalg.norm(left[n, :3]), np.linalg.norm(left[n, 3:])
            raise PoseError(f"--chain: {chain.name} cannot reach the pose at {indices[n] / rate_hz:.2f} s ({part_of(indices[n])}): {1e3 * move:.1f} mm and {np.degrees(rotation):.1f} deg are left; "
                            "give other --start-joints, or a smaller --size or --turn")

    knots = np.unique(np.append(np.arange(0, len(rows), max(1, round(KNOT_S * rate_hz))), len(rows) - 1))
    values = [start]
    for n in knots:
        found, left = _solved(chain, names, values[-1][None], (position[[n]], turn[[n]]), STEPS_TO_KNOT)
        refuse_unreachable([n], left)
        values.append(found[0])
    guess = CubicSpline(knots, np.array(values[1:]))(np.arange(len(rows))) if len(knots) > 1 else np.array(values[1:])
    result, left = _solved(chain, names, guess, (position, turn), STEPS_TO_ROW)
    refuse_unreachable(np.arange(len(rows)), left)
    _refuse_beyond_limits(chain, names, result, rate_hz, part_of)
    return result


def _refuse_beyond_limits(chain, names, values, rate_hz, part_of):
    for joint, name, value in zip((chain.joint(one) for one in names), names, values.T):
        unit, factor = ("deg", np.degrees(1)) if joint.kind == "revolute" else ("mm", 1e3)
        low, high, most = joint.limits
        for n, limit, beyond in ((int(value.argmin()), low, value.min() < low), (int(value.argmax()), high, value.max() > high)):
            if beyond:
                raise PoseError(f"--chain: joint {name} would be at {factor * value[n]:.1f} {unit} at {n / rate_hz:.2f} s ({part_of(n)}); its limit is {factor * limit:.1f}; "
                                "give other --start-joints, or a smaller --size or --turn")
        speed = np.abs(np.diff(value)) * rate_hz
        if len(speed) and speed.max() > most:
            n = int(speed.argmax())
            raise PoseError(f"--chain: joint {name} would need {factor * speed[n]:.1f} {unit}/s at {n / rate_hz:.2f} s ({part_of(n)}); its limit is {factor * most:.1f}; "
                            f"give --limits and --turn-limits with at most {most / speed[n]:.2f} of these speeds, or other --start-joints")


def summary_of(chain: Chain, values: NDArray, rate_hz: float) -> list[dict]:
    """Range and largest speed of each joint, rad or m."""
    speed = np.abs(np.diff(values, axis=0)).max(axis=0) * rate_hz
    return [{"joint": name, "lowest": float(value.min()), "highest": float(value.max()), "max_speed": float(most)}
            for name, value, most in zip(chain.wanted(), values.T, speed)]
