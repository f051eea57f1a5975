"""`tricoil generator simulate`: a table of couplings of one sensor coil, at random poses or along a path."""

import dataclasses
import os

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation, RotationSpline

from ._dynamic import number
from ._generator import MOST_COILS, Generator, SensorCoil, planar_generator, read_generator, to_toml
from ._output_file import refuse_input_as_output, write_all
from ._poses import read, refuse_others
from ._rotation import rotations, with_x_along, wxyz
from ._truth_command import numbers

PLANAR_M = 0.3  # edge of the planar generator
VOLUME_M = ((-0.15, -0.15, 0.1), (0.15, 0.15, 0.4))  # of random poses, above it
LIMITS = {"coils": (1, MOST_COILS), "count": (1, 1e7), "rate_hz": (1e-3, 1e6), "gain": (1e-9, 1e9), "slot_s": (0, 1), "snr_db": (-100, 400), "seed": (0, 2**32)}
DEFAULTS = {"coils": 8, "count": 1000, "place": "0,0,0.25", "slot_s": 0.0, "rate_hz": 40}
ALONG = {"place", "slot_s", "rate_hz"}  # options of a path
COIL = SensorCoil(1.0, np.zeros(3), np.array([1.0, 0.0, 0.0]))  # of the body of a path; the axis is x
BODY = {1: SensorCoil(1.0, np.array([-5e-3, 0, 0]), np.array([1.0, 0, 0])), 2: SensorCoil(1.0, np.array([5e-3, 0, 0]), np.array([0, 1.0, 0]))}


def _random(count, rng):
    axis = rng.normal(size=(count, 3))
    return rng.uniform(*VOLUME_M, (count, 3)), axis / np.linalg.norm(axis, axis=1, keepdims=True)


def _along(path, place, times_s):
    """Times (M, S), and positions (M, S, 3) and attitudes (M S) of the body; the middle of the path is at `place`."""
    poses = read(path)
    if poses.quaternion_wxyz is None or len(poses) < 4:
        raise ValueError(f"{path}: four poses with attitudes are needed")
    middle = poses.position_m.mean(axis=0)
    position = CubicSpline(poses.time_s, poses.position_m - middle + place)
    turn = RotationSpline(poses.time_s, rotations(poses.quaternion_wxyz))
    times = times_s(poses.time_s[0], poses.time_s[-1])
    if not len(times):
        raise ValueError(f"{path}: lasts {poses.time_s[-1] - poses.time_s[0]:g} s, less than the slots of a frame; choose a longer path or a smaller --slot-s")
    return times, position(times), turn(times.ravel())


def couplings_at_slots(generator: Generator, position_m, axis, gain):
    """Couplings (M, N): that of coil i at positions and axes (M, N, 3)[:, i]."""
    count = len(generator)
    alone = np.stack([generator.field(position_m[:, i], axis[:, i] * gain)[:, i, 0] for i in range(count)], axis=1)
    return alone @ np.linalg.inv(np.eye(count) + generator.crosstalk).T


def _table(generator, columns, couplings):
    """columns: values by their names, separated by commas."""
    parts = [np.reshape(values, (len(couplings), -1)) for values in columns.values()]
    return ",".join((*columns, *generator.names)) + "\n" + "".join(",".join(f"{v:.12g}" for v in row) + "\n" for row in np.hstack((*parts, couplings)))


def _mounts(generator, name):
    """Sensor coils with their places in the body, by number. Raises ValueError if the generator has none."""
    mounts = BODY if name is None else {number: one for number, one in sorted(generator.sensors.items()) if one.offset_m is not None}
    if not mounts:
        raise ValueError(f"{name}: has no sensor coil with a place in a body; --body needs [[sensor]] with number, gain, offset_m and axis")
    return mounts


def _coil_at(generator, position, turn, mount, gain):
    """Position and axis (M, 3) of a coil at the end of each row, and its couplings (M, N). position: (M, 1 or N + 1, 3) of the body: at one
    time, or at that of each slot and of the pose."""
    at = position + turn.apply(mount.offset_m).reshape(position.shape)
    n = turn.apply(mount.axis).reshape(position.shape)
    true = generator.couplings(at[:, 0], n[:, 0], gain) if position.shape[1] == 1 else couplings_at_slots(generator, at[:, :-1], n[:, :-1], gain)
    return at[:, -1], n[:, -1], true


def _chosen(options, generator, path):
    """Options with their defaults. Raises ValueError for one that has no effect."""
    given = {name: value for name, value in options.items() if value is not None}
    refuse_others(given, given.keys() - ({"count"} if path is not None else ALONG), "only without --path" if path is not None else "only with --path")
    refuse_others(given, given.keys() - ({"coils"} if generator is not None else set()), "the generator has its own coils; leave it out")
    return DEFAULTS | given


def run(out=None, generator=None, save=None, path=None, gain=1.0, snr_db=60.0, seed=1, coils=None, count=None, place=None, slot_s=None, rate_hz=None,
        body=False):
    """Result as `--json` prints it, and the couplings (M, N). Raises ValueError, OSError."""
    if out is None:
        raise ValueError("--out FILE is needed, for the couplings")
    chosen = _chosen({"coils": coils, "count": count, "place": place, "slot_s": slot_s, "rate_hz": rate_hz}, generator, path)
    chosen |= {"gain": gain, "snr_db": snr_db, "seed": seed}
    values = {name: number(f"--{name.replace('_', '-')}", chosen[name]) for name in LIMITS}
    refuse_input_as_output({"--out": out, "--save": save}, [generator, path])
    for name, (least, most) in LIMITS.items():
        if not least <= values[name] <= most:
            raise ValueError(f"--{name.replace('_', '-')}: must be from {least:g} to {most:g}; is {values[name]:g}")
    source = planar_generator(int(values["coils"]), PLANAR_M) if generator is None else read_generator(generator)
    rng, slot = np.random.default_rng(int(values["seed"])), values["slot_s"]
    slots = slot * (np.arange(len(source)) - (len(source) - 1) / 2)
    if path is not None and slot * len(source) > 1 / values["rate_hz"] * (1 + 1e-9):
        raise ValueError(f"--slot-s: {len(source)} slots of {slot:g} s are longer than a frame at {values['rate_hz']:g} frames/s")
    mounts = _mounts(source, generator) if body else {1: COIL}
    if body and generator is None:
        source = dataclasses.replace(source, sensors=mounts)
    columns: dict[str, np.ndarray] = {}
    if path is None:
        position, axis = _random(int(values["count"]), rng)
        position = position[:, None]
        turn = Rotation.random(len(position), random_state=int(values["seed"])) if body else with_x_along(axis)
    else:
        def times(first, last):
            return np.arange(first + abs(slots[0]), last - abs(slots[0]), 1 / values["rate_hz"])[:, None] + np.append(slots, 0.0)

        every, position, turn = _along(path, np.array(numbers("place", chosen["place"], 3)), times)
        columns["time_s"] = np.tile(every[:, -1], len(mounts))
    parts = [_coil_at(source, position, turn, mount, values["gain"] * mount.gain) for mount in mounts.values()]
    true = np.concatenate([one[2] for one in parts])
    sigma = np.sqrt(np.mean(true**2, axis=1)) * 10 ** (-values["snr_db"] / 20)
    measured = true + sigma[:, None] * rng.normal(size=true.shape)
    if body:
        at = wxyz(turn).reshape(*position.shape[:2], 4)[:, -1]
        columns |= {"sensor": np.repeat(list(mounts), len(position)), "x_m,y_m,z_m": np.tile(position[:, -1], (len(mounts), 1)), "qw,qx,qy,qz": np.tile(at, (len(mounts), 1))}
    else:
        columns |= {"x_m,y_m,z_m": parts[0][0], "nx,ny,nz": parts[0][1]}
    contents = {out: _table(source, columns | {"sigma": sigma}, measured)}
    if save is not None:
        contents[save] = to_toml(source)
    write_all(contents)
    return {"rows": len(true), "coils": len(source), "snr_db": values["snr_db"], "slot_s": slot, "out": os.fspath(out)}, measured


def text(r: dict) -> str:
    """The result as a line."""
    return f"{r['rows']} rows of {r['coils']} couplings, {r['snr_db']:g} dB above noise, written to {r['out']}\n"
