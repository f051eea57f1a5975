"""Generated bench recordings with known answers: a stylus in divots, sensors at rest, a hinge and a pendulum."""

import numpy as np
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation
from tricoil import Poses

TIP_M = np.array((0.1096, 0.0067, 0.0028))
HOLES_M = 1e-3 * np.array([[104.3, 5, 20], [104.3, 45, 20], [104.3, 45, 0], [104.3, -5, 0], [-34.3, 45, 15], [-34.3, -5, 20], [-34.3, -5, 0], [-34.3, 45, 0]])
NAMES = [f"#{n + 1}" for n in range(len(HOLES_M))]
BOARD = Rotation.from_euler("ZYX", (0, 89.2, 0.5), degrees=True)  # x of the board along -z of the frame, nearly
SHIFT_M = np.array((0.02, -0.04, 0.03))
RATE_HZ = 15.0


def poses_of(time_s, position_m, turns: Rotation, name="bench") -> Poses:
    return Poses(time_s, position_m, turns.as_quat()[:, [3, 0, 1, 2]], name)


def board_csv(unit="mm") -> str:
    scale = {"mm": 1e3, "m": 1.0, "in": 1 / 0.0254}[unit]
    rows = [f'"{name}",' + f"{','.join(f'{scale * value:.6f}' for value in hole)}\n" for name, hole in zip(NAMES, HOLES_M)]
    return f"name,x_{unit},y_{unit},z_{unit}\n" + "".join(rows)


def board_xml() -> str:
    rows = "".join(f'<Landmark Name="{name}" Position="{" ".join(f"{1e3 * value:.3f}" for value in hole)}"/>' for name, hole in zip(NAMES, HOLES_M))
    return f"<PlusConfiguration><PhantomDefinition><Geometry><Landmarks>{rows}</Landmarks></Geometry></PhantomDefinition></PlusConfiguration>"


def pivots_at(order, seed=1, strain=np.eye(3), noise_m=2e-4, noise_rad=5e-4, seconds=6.0, wild=0.01, of_sensor=False):
    """A stylus tilted in holes of the board in this order, with moves between. strain: of the tracker's frame, on the places of the tip, or, with
    of_sensor, on those of the sensor, whose lever it does not strain."""
    random = np.random.default_rng(seed)
    t = np.arange(round(seconds * RATE_HZ)) / RATE_HZ
    centers = BOARD.apply(HOLES_M[list(order)]) + SHIFT_M
    position, turns = [], []
    for n, center in enumerate(centers):
        lean = np.stack((0.5 * np.sin(1.1 * t + n), 0.5 * np.cos(0.83 * t), 0.4 * np.sin(0.57 * t + 1)), axis=1)
        turn = Rotation.from_rotvec(lean) * Rotation.from_rotvec((0, 0, 0.7 * n))
        place = center - turn.apply(TIP_M)
        if n:  # the way from the last hole
            u = np.linspace(0, 1, 12)[1:-1, None]
            position.append(position[-1][-1] * (1 - u) + place[0] * u + 0.08 * np.sin(np.pi * u))
            turns.append(Rotation.concatenate([turn[0]] * len(u)) * Rotation.from_rotvec(0.4 * random.normal(size=(len(u), 3))))
        position.append(place)
        turns.append(turn)
    p, q = np.concatenate(position), Rotation.concatenate(turns)
    places = p if of_sensor else p + q.apply(TIP_M)
    p = p + places @ (strain - np.eye(3)).T + random.normal(size=p.shape) * noise_m
    q = Rotation.from_rotvec(noise_rad * random.normal(size=p.shape)) * q
    bad = random.random(len(p)) < wild
    p[bad] += random.normal(size=(int(np.sum(bad)), 3)) * 0.02
    return poses_of(100 + np.arange(len(p)) / RATE_HZ, p, q)


def mha(poses: Poses, reference: Rotation, shift_m) -> str:
    """Sequence of PlusToolkit: the stylus and a reference on the board, both in the frame of the tracker."""
    lines = ["ObjectType = Image", "NDims = 3", f"DimSize = 0 0 {len(poses)}", "ElementType = MET_OTHER"]
    stylus = Rotation.from_quat(poses.quaternion_wxyz[:, [1, 2, 3, 0]])
    for n, time_s in enumerate(poses.time_s):
        moved = shift_m * (1 + 0.1 * np.sin(0.2 * n))
        for name, turn, place in (("ReferenceToTracker", reference, moved), ("StylusToTracker", reference * stylus[n], reference.apply(poses.position_m[n]) + moved)):
            matrix = np.vstack((np.hstack((turn.as_matrix(), 1e3 * np.reshape(place, (3, 1)))), (0, 0, 0, 1)))
            lines += [f"Seq_Frame{n:04d}_{name}Transform = {' '.join(map(repr, matrix.ravel().tolist()))} ", f"Seq_Frame{n:04d}_{name}TransformStatus = OK"]
        lines += [f"Seq_Frame{n:04d}_Timestamp = {time_s:.6f}", f"Seq_Frame{n:04d}_ImageStatus = INVALID"]
    return "\n".join([*lines, "ElementDataFile = LOCAL"]) + "\n"


def rests_at(places_m, seed=1, noise_m=1e-4, drift_m_s=0.0, seconds=4.0, rate_hz=60.0) -> Poses:
    """A sensor that rests at places, without turning, with moves of 1 s between."""
    random = np.random.default_rng(seed)
    rows = []
    for n, place in enumerate(np.asarray(places_m)):
        if n:
            u = np.linspace(0, 1, round(rate_hz))[1:-1, None]
            rows.append(rows[-1][-1] * (1 - u) + place * u)
        count = round(seconds * rate_hz)
        rows.append(place + np.arange(count)[:, None] / rate_hz * (drift_m_s, 0, 0))
    p = np.concatenate(rows)
    turns = Rotation.from_rotvec(3e-4 * random.normal(size=p.shape))
    return poses_of(np.arange(len(p)) / rate_hz, p + noise_m * random.normal(size=p.shape), turns)


AXIS = np.array((0.1, 0.99, -0.05)) / np.linalg.norm((0.1, 0.99, -0.05))
ARM_M = np.array((0.25, 0.0, 0.02))
OMEGA, DAMPING = 2 * np.pi / 1.3, 0.04


def pendulum(seed=1, noise_m=1e-4, noise_rad=5e-4, seconds=15.0, rate_hz=120.0) -> Poses:
    """A free pendulum about AXIS with a sensor on its arm."""
    random = np.random.default_rng(seed)
    t = np.arange(round(seconds * rate_hz)) / rate_hz
    angle = solve_ivp(lambda _, a: (a[1], -(OMEGA**2) * np.sin(a[0]) - DAMPING * a[1]), (0, t[-1]), (0.6, 0.0), t_eval=t, rtol=1e-9, atol=1e-10).y[0]
    turn = Rotation.from_rotvec(angle[:, None] * AXIS)
    arm = ARM_M - AXIS * (AXIS @ ARM_M)
    p = np.array((0.5, 0.1, 0.3)) + turn.apply(arm) + noise_m * random.normal(size=(len(t), 3))
    q = Rotation.from_rotvec(noise_rad * random.normal(size=(len(t), 3))) * turn * Rotation.from_euler("x", 0.4)
    return poses_of(t, p, q)
