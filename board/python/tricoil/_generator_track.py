"""`tricoil generator track`: poses of sensor coils, or of a body, by the filter, from a table of couplings that were measured in turn."""

import contextlib
import itertools
import json
import os

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import RotationSpline

from . import _generator_table as tables
from . import _tricoil
from ._coil_filter import COUNTERS, CoilFilter
from ._dynamic import number
from ._flags import Flag
from ._generator import read_generator
from ._generator_body import _compared as body_compared
from ._generator_body import _frames_of_body
from ._generator_result import compared_lines
from ._generator_solve import LONGEST_SLOT_S, ROLL, _compared, _gain, _sigma, _truth, _used, known_gain
from ._output_file import OutputFile, refuse_input_as_output
from ._poses import refuse_others
from ._rotation import crosses
from ._truth_command import numbers

NAMES = ("x_m", "y_m", "z_m", "qw", "qx", "qy", "qz", "std_x_m", "std_y_m", "std_z_m", "std_rx_rad", "std_ry_rad", "std_rz_rad", "vx_m_s", "vy_m_s", "vz_m_s",
         "wx_rad_s", "wy_rad_s", "wz_rad_s", "snr_db", "gain", "gain_std", "nx", "ny", "nz")
FEW_ROWS = 3  # with which the duration of a frame is known


class _Source:
    """Frames of a table, or as they come from standard input."""

    def __init__(self, files, body):
        self.where = os.fspath(files[0]) if files else ""
        self.is_live = len(files) == 1 and files[0] == "-" and not body
        self._parts = tables.parts_of("-") if self.is_live else iter([tables.read(files)])

    def first(self):
        """Rows from which the duration of a frame follows."""
        frames = next(self._parts, None)
        while self.is_live and frames is not None and len(frames) < FEW_ROWS and (more := next(self._parts, None)) is not None:
            frames = tables.joined([frames, more])
        if frames is None:
            raise ValueError(f"{self.where}: has no rows")
        return frames

    def __iter__(self):
        return self._parts


def _frame_s(frames, where, slots_s):
    if frames.time_s is None:
        raise ValueError(f"{where}: a column time_s is needed, the middle of the slots of a row")
    steps = np.diff(frames.time_s[frames.sensor == frames.sensor[0]])
    if not (steps > 0).all():
        raise ValueError(f"{where}: time_s must increase")
    frame_s = float(np.median(steps)) if len(steps) else 0.0
    if not 0 < frame_s < 10 or np.ptp(slots_s) > frame_s * (1 + 1e-6):
        raise ValueError(f"{where}: rows are {frame_s:g} s apart, and their slots last {np.ptp(slots_s):g} s; is --slot-s right?")
    return frame_s


def _json_lines(poses, sensor, is_single):
    deviation = np.sqrt(np.diagonal(poses["covariance"], axis1=1, axis2=2))
    columns = [poses["position_m"], poses["quaternion_wxyz"], deviation, poses["velocity_m_s"], poses["rate_rad_s"], poses["snr_db"][:, None]]
    columns += [poses["gain"][:, None], poses["gain_deviation"][:, None], poses["axis"]] if is_single else []
    roll = {"roll_rad": None} if is_single else {}
    for time, valid, flags, values in zip(poses["time_s"].tolist(), poses["valid"].tolist(), poses["flags"].tolist(), np.hstack(columns).tolist()):
        row = {"time_s": round(time, 9), "sensor": sensor, "valid": valid, "flags": flags, "flag_names": str(Flag(flags))}
        yield json.dumps(row | {name: value if np.isfinite(value) else None for name, value in zip(NAMES, values)} | roll)


def _recorded_lines(poses, sensor, first):
    """Lines of a recording's poses.csv; what the filter does not have is empty, and the couplings are zero."""
    upper = np.triu_indices(6)
    for n, pose in enumerate(poses):
        numbers = (*pose["position_m"], *pose["quaternion_wxyz"], *pose["covariance"][upper], np.nan, pose["snr_db"])
        head = (sensor, first + n, round(1e6 * pose["time_s"]), int(pose["valid"]), pose["flags"], 1 if np.isfinite(pose["position_m"][0]) else 0)
        yield ",".join((*map(str, head), *(f"{v:.9g}" if np.isfinite(v) else "" for v in numbers), "", "", *["0"] * 9))


def _header(is_single):
    return (f"# {ROLL}: flag {int(Flag.ROLL_UNDEFINED)}; x of the sensor frame is along the coil\n" if is_single else "") + _tricoil.RECORDED_POSE + "\n"


def _errors(poses, frames, generator, where, rows_of):
    """Errors of valid poses against the truth of the rows, by splines at the times of the poses; None: the table has no truth."""
    rows = {name: poses[name] for name in ("position_m", "quaternion_wxyz", "axis", "covariance")} | {"end": np.where(poses["valid"], 0, 1)}
    at = poses["time_s"]
    if rows_of is not None:
        first = rows_of[0]
        if frames.turn is None or frames.position_m is None or len(first) < 4:
            return None
        times = frames.time_s[first]
        return body_compared(rows, CubicSpline(times, frames.position_m[first])(at), RotationSpline(times, frames.turn[first])(at))
    truth = _truth(frames, generator, where)
    if truth is None or len(frames) < 4:
        return None
    p, n = (CubicSpline(frames.time_s, one)(at) for one in truth)
    turned = np.tile(np.eye(6), (len(at), 1, 1))
    turned[:, 3:, 3:] = -crosses(rows["axis"])  # of a small rotation
    known = np.where(poses["valid"][:, None, None], rows["covariance"], 0)
    rows["covariance"] = turned @ known @ turned.transpose(0, 2, 1)
    return _compared(rows, (p, n / np.linalg.norm(n, axis=1, keepdims=True)))


def run(files, generator=None, out=None, gain=None, sigma=None, side=None, without=None, slot_s=None, body=False):
    """Result as `--json` prints it, and the poses of tricoil.CoilFilter by sensor. Raises ValueError, OSError."""
    if generator is None or slot_s is None:
        raise ValueError("--generator FILE is needed: the file of tricoil generator calibrate or simulate" if generator is None else
                         "--slot-s SECONDS is needed: the coils are measured in turn; 0: at once")
    if body:
        refuse_others({"gain": gain} if gain is not None else {}, (), "not with --body, whose coils have the gains of the calibration")
    refuse_input_as_output({"--out": out}, [*files, generator])
    coils, known, towards, slot = read_generator(generator), _gain(gain), numbers("side", side, 3), number("--slot-s", slot_s)
    if not 0 <= slot <= LONGEST_SLOT_S:
        raise ValueError(f"--slot-s: must be from 0 to {LONGEST_SLOT_S}; is {slot_s}")
    source = _Source(files, body)
    frames, where, used = source.first(), source.where, _used(without, coils, generator)
    slots_s = slot * (np.arange(len(coils)) - (len(coils) - 1) / 2)
    sensors, rows_of = _frames_of_body(frames, where) if body else (None, None)
    if not source.is_live:
        tables.refuse_silent(tables.in_order(frames, coils.names, where)[:, used], np.array(coils.names)[used], frames.sigma, where, "; leave it out with --without")
    frame_s = _frame_s(frames, where, slots_s)
    filters: dict[int, CoilFilter] = {}
    poses: dict[int, list] = {}

    def tracked(part):
        couplings, noise, found = tables.in_order(part, coils.names, where), _sigma(sigma, part, coils, where), []
        for one in [0] if body else sorted(set(part.sensor.tolist())):
            rows = rows_of if body else np.flatnonzero(part.sensor == one)
            if one not in filters:
                filters[one] = CoilFilter(coils, frame_s, side=towards, used=used, **({"sensors": sensors} if body else known_gain(coils, one, known)))
            spread = noise if np.ndim(noise) == 0 else noise[rows][..., None]
            try:
                here = filters[one].update(part.time_s[rows[0] if body else rows][:, None] + slots_s, couplings[rows], spread)
            except ValueError as error:
                raise ValueError(f"{where}: {error}") from None
            if not source.is_live:
                poses.setdefault(one, []).append(here)
            counts["poses"] += len(here)
            counts["valid"] += int(here["valid"].sum())
            ambiguous.append(bool((here["flags"] & Flag.HEMISPHERE_UNKNOWN).any()))
            number_of = sorted(filters).index(one)
            found.append((here["time_s"], _json_lines(here, number_of, not body) if is_json else _recorded_lines(here, number_of, counts["poses"] - len(here))))
        at, lines = (np.concatenate([f[0] for f in found]), [line for f in found for line in f[1]])
        return "".join(lines[n] + "\n" for n in np.argsort(at, kind="stable"))

    counts, ambiguous = {"poses": 0, "valid": 0}, []
    is_json = out is not None and os.fspath(out).endswith((".jsonl", ".json"))
    with OutputFile(os.fspath(out)) if out is not None else contextlib.nullcontext() as file:
        if file and not is_json:
            file.write(_header(not body))
        for part in itertools.chain([frames], source):
            text = tracked(part)
            if file:
                file.write(text, flush=True)
        if file:
            file.commit()
    every = {one: np.concatenate(parts) for one, parts in poses.items()}
    truth = None
    if len(every) == 1:
        truth = _errors(next(iter(every.values())), frames, coils, where, rows_of)
    total = {name: sum(one.counters[name] for one in filters.values()) for name in COUNTERS}
    notes = []
    if any(ambiguous) and side is None:
        notes.append("poses on both sides of the generator fit: give the side of the sensor with --side")
    elif counts["valid"] < counts["poses"] / 2:
        notes.append("few poses are valid: are the coils those of the generator's calibration, in the same order?")
    return counts | total | {"roll": "determined" if body else "undefined", "truth": truth, "notes": notes}, every


def text(r: dict) -> str:
    """The result as lines."""
    angle = "axis_rms_deg" if r["roll"] == "undefined" else "rotation_rms_deg"
    lines = [f"{r['valid']} of {r['poses']} poses valid{'; ' + ROLL if r['roll'] == 'undefined' else ''}",
             f"  {r['starts']} starts, {r['losses']} losses, {r['outliers']} columns refused", *compared_lines(r["truth"], angle),
             *(f"  note: {note}" for note in r["notes"])]
    return "\n".join(lines) + "\n"
