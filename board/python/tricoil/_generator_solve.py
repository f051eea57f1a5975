"""`tricoil generator solve`: poses of sensors of one coil from a table of couplings, compared with the truth if the table has it."""

import json
import os

import numpy as np

from . import _generator_table as tables
from ._dynamic import number
from ._generator import Generator, read_generator
from ._generator_motion import generator_motion_error
from ._generator_result import compared, result_lines, summary
from ._output_file import refuse_input_as_output, write_whole
from ._poses import refuse_others
from ._single_coil import ENDS, solve_5dof
from ._truth_command import numbers

LONGEST_SLOT_S = 1
ROLL = "the rotation about the axis of the coil is undefined"
COLUMNS = ("x_m", "y_m", "z_m", "nx", "ny", "nz", "roll_rad", "gain", "std_x_m", "std_y_m", "std_z_m", "std_axis_rad", "chi_square")


def _truth(frames, generator: Generator, where):
    """Positions and axes of the coils, (M, 3) each, or None."""
    if frames.position_m is None:
        return None
    if frames.turn is None:
        return None if frames.axis is None else (frames.position_m, frames.axis)
    turn = frames.turn.inv() if frames.is_stage and generator.left_handed_stage else frames.turn
    mounts = [generator.sensors.get(sensor) for sensor in frames.sensor]
    if any(mount is None or mount.offset_m is None for mount in mounts):
        raise ValueError(f"{where}: has poses of a body; the generator has no mount of sensor coil {next(n for n, m in zip(frames.sensor, mounts) if m is None or m.offset_m is None)}")
    offset, axis = (np.array([getattr(mount, name) for mount in mounts]) for name in ("offset_m", "axis"))
    return frames.position_m + turn.apply(offset), turn.apply(axis)


def _compared(rows, truth):
    """Errors of good poses against the truth."""
    p, n = truth
    turn = np.arccos(np.clip(np.sum(rows["axis"] * n, axis=1), -1, 1))
    unit = np.concatenate((np.full(3, 0.1), np.ones(3)))

    def nees(right):
        five = np.concatenate((rows["position_m"] - p, rows["axis"] - n), axis=1)[right]
        return np.einsum("mi,mij,mj->m", five / unit, np.linalg.pinv(rows["covariance"][right] / unit / unit[:, None], rcond=1e-9, hermitian=True), five / unit) / 5

    return compared(rows, p, turn, "axis_rms_deg", nees)


def _motion(frames, generator, rows, is_good, slot_s, known_gain, sigma, used):
    """Predicted motion errors of position (M, 3), m, and axis (M, 3), from the velocities of the good poses; NaN for other rows. Coil n is
    measured n slots after the first one, and a pose is at the middle of its slots. known_gain: that of the table's sensor coil."""
    if frames.time_s is None or len(frames) < 3:
        raise ValueError("--slot-s: needs a column time_s and three rows")
    if len(set(frames.sensor.tolist())) > 1 or not np.all(np.diff(frames.time_s) > 0):
        raise ValueError("--slot-s: needs rows of one sensor coil with increasing time_s")
    times = slot_s * (np.arange(len(generator)) - (len(generator) - 1) / 2)
    good, error = rows[is_good], np.full((2, len(rows), 3), np.nan)
    velocity, rate = (np.gradient(good[name], frames.time_s[is_good], axis=0) for name in ("position_m", "axis"))
    noise = np.where(used, np.broadcast_to(np.reshape(sigma, (-1, 1)), (len(rows), len(generator))), np.inf)[is_good]  # no weight for coils that are left out
    error[:, is_good] = generator_motion_error(generator, good["position_m"], good["axis"], velocity, rate, times, known_gain=known_gain, sigma=noise,
                                               gain=float(np.median(good["gain"])))
    return error


def known_gain(generator, sensor, gain):
    """Arguments of the gain: the given one, 0 if it is unknown, or that of the calibration."""
    own = generator.sensors.get(sensor) if gain is None else None
    return {"gain": gain or None} if own is None else {"gain": own.gain, "gain_deviation": own.gain_deviation}


def _solved(frames, generator, couplings, sigma, gain, options):
    """Rows of all sensor coils, each with its gain. Where most rows fit no pose, the generator is another one: the others fit by chance."""
    rows = None
    for sensor in sorted(set(frames.sensor.tolist())):
        part = frames.sensor == sensor
        found = solve_5dof(couplings[part], generator, sigma if np.ndim(sigma) == 0 else sigma[part], **known_gain(generator, sensor, gain), **options)
        if np.mean(found["end"] == ENDS.index("misfit")) > 0.5:
            found["end"][found["end"] == 0] = ENDS.index("misfit")
        rows = np.empty(len(frames), found.dtype) if rows is None else rows
        rows[part] = found
    return rows


def _gain(given):
    """None: that of the calibration; 0: it is estimated."""
    if given is None or given == "unknown":
        return None if given is None else 0.0
    value = number("--gain", given)
    if not 0 < value < np.inf:
        raise ValueError(f"--gain: must be positive, or unknown, so that it is estimated; is {given}")
    return value


def _sigma(given, frames, generator, where):
    if given is not None:
        value = number("--sigma", given)
        if not 0 < value < np.inf:
            raise ValueError(f"--sigma: must be positive; is {given}")
        return value
    if frames.sigma is None and not generator.misfit.all():
        raise ValueError(f"{where}: no column sigma, and the generator states no misfit; give the noise of a coupling with --sigma")
    return 0.0 if frames.sigma is None else frames.sigma


def _used(without, generator, where):
    names = [] if without is None else without.split(",") if isinstance(without, str) else list(without)
    for name in names:
        if name not in generator.names:
            raise ValueError(f"--without {name}: is not a coil of {where}: {', '.join(generator.names)}")
    return np.array([name not in names for name in generator.names])


def csv_text(frames, rows, error) -> str:
    """Poses as CSV; roll_rad is nan."""
    names = [*(["time_s"] if frames.time_s is not None else []), "sensor", *COLUMNS, *(["motion_x_m", "motion_y_m", "motion_z_m"] if error is not None else []), "status"]
    lines = [",".join(names)]
    for m, values in enumerate(np.insert(_values(rows, error), 6, np.nan, axis=1)):
        head = [] if frames.time_s is None else [f"{frames.time_s[m]:.9f}"]
        lines.append(",".join([*head, str(frames.sensor[m]), *(f"{v:.9g}" for v in values), ENDS[rows["end"][m]]]))
    return "\n".join(lines) + "\n"


def _values(rows, error):
    variance = np.diagonal(rows["covariance"], axis1=1, axis2=2)
    parts = [rows["position_m"], rows["axis"], rows["gain"][:, None], np.sqrt(variance[:, :3]), np.sqrt(variance[:, 3:].sum(axis=1, keepdims=True)), rows["chi_square"][:, None]]
    return np.hstack(parts if error is None else [*parts, error])


def json_lines(frames, rows, error) -> str:
    """Poses as JSON lines; roll is null."""
    lines = []
    for m, values in enumerate(_values(rows, error).tolist()):
        one = {} if frames.time_s is None else {"time_s": float(frames.time_s[m])}
        one |= {"sensor": int(frames.sensor[m]), "position_m": values[:3], "axis": values[3:6], "roll_rad": None, "gain": values[6], "position_std_m": values[7:10],
                "axis_std_rad": values[10], "chi_square": values[11]}
        lines.append(json.dumps(one | ({} if error is None else {"motion_error_m": values[12:15] if np.all(np.isfinite(values[12:15])) else None}) | {"status": ENDS[rows["end"][m]]}))
    return "\n".join(lines) + "\n"


def run(files, generator=None, out=None, gain=None, sigma=None, side=None, follow=False, without=None, slot_s=None, body=False):
    """Result as `--json` prints it, and the rows of solve_5dof(), or with body those of solve_6dof(). Raises ValueError, OSError."""
    if body:
        refuse_others({name: one for name, one in (("gain", gain), ("slot_s", slot_s)) if one is not None}, (), "not with --body, whose coils have the gains of the calibration")
    if generator is None:
        raise ValueError("--generator FILE is needed: the file of tricoil generator calibrate or simulate")
    refuse_input_as_output({"--out": out}, [*files, generator])
    coils, known, towards, slot = read_generator(generator), _gain(gain), numbers("side", side, 3), number("--slot-s", slot_s)
    if slot is not None and not 0 <= slot <= LONGEST_SLOT_S:
        raise ValueError(f"--slot-s: must be from 0 to {LONGEST_SLOT_S}; is {slot_s}")
    frames, where = tables.read(files), os.fspath(files[0]) if files else ""
    couplings, used = tables.in_order(frames, coils.names, where), _used(without, coils, generator)
    tables.refuse_silent(couplings[:, used], np.array(coils.names)[used], frames.sigma, where, "; leave it out with --without")
    if not (abs(couplings[:, used]).max(axis=1) > 0).all():
        raise ValueError(f"{where}: row {int(np.argmin(abs(couplings[:, used]).max(axis=1) > 0)) + 1}: all couplings are zero: is the sensor coil connected?")
    noise, options = _sigma(sigma, frames, coils, where), {"side": towards, "used": used, "follow": bool(follow)}
    if body:
        from . import _generator_body

        return _generator_body.solved(frames, coils, couplings, noise, options, out, where)
    rows = _solved(frames, coils, couplings, noise, known, options)
    is_good = rows["end"] == 0
    truth = _truth(frames, coils, where)
    result = summary(rows) | {"roll": "undefined", "truth": None if truth is None else _compared(rows, truth), "motion": None, "notes": []}
    error = None
    if slot and is_good.sum() >= 3:
        error, turned = _motion(frames, coils, rows, is_good, slot, int(frames.sensor[0]) in coils.sensors if known is None else known != 0, noise, used)
        result["motion"] = {"position_rms_m": float(np.sqrt(np.mean(np.sum(error[is_good] ** 2, axis=1)))),
                            "axis_rms_deg": float(np.degrees(np.sqrt(np.mean(np.sum(turned[is_good] ** 2, axis=1)))))}
    if result["misfit"] > len(rows) / 2:
        result["notes"].append("most rows fit no pose: are the coils those of the generator's calibration, in the same order?")
    if result["ambiguous"] > len(rows) / 20:
        result["notes"].append("poses on both sides of the generator fit: give the side of the sensor with --side")
    if out is not None:
        write_whole(out, json_lines(frames, rows, error) if os.fspath(out).endswith((".jsonl", ".json")) else csv_text(frames, rows, error))
    return result, rows


def text(r: dict) -> str:
    """The result as lines."""
    if "sensors" in r:
        from . import _generator_body

        return _generator_body.text(r)
    found = result_lines(r, f"{r['solved']} of {r['poses']} poses solved; {ROLL}", "axis_rms_deg")
    if m := r["motion"]:
        found.append(f"  predicted motion error {1e3 * m['position_rms_m']:.3f} mm, {m['axis_rms_deg']:.3f} deg RMS")
    return "\n".join([*found, *(f"  note: {note}" for note in r["notes"])]) + "\n"
