"""`tricoil evaluate --dynamic`: files, result, text, CSV and picture."""

import contextlib
import os

import numpy as np

from . import _poses
from ._drawing import draw_and_publish
from ._poses import Poses, PoseError
from ._output_file import refuse_input_as_output
from ._staged_folder import StagedFolder

OPTIONS = ("time_offset", "same_clock", "sensor", "reference_sensor", "unit", "time_unit", "rate_hz", "rotation", "columns", "out", "csv_only")
WRITTEN = ("dynamic_errors.csv", "dynamic_errors.svg")
NO_SCIPY = "needs NumPy and SciPy: install the packages python3-numpy and python3-scipy"


def number(name, value):
    try:
        return None if value is None else float(value)
    except (TypeError, ValueError):
        raise PoseError(f"{name} must be a number; is '{value}'") from None


def of_both(name, value, files):
    """Values for the first and for the second of two files: "mm,in", or one for both."""
    value = ",".join(map(str, value)) if isinstance(value, (list, tuple)) else value
    parts = [None] if value is None else [part or None for part in str(value).split(",")]
    if len(parts) > 2:
        raise PoseError(f"{name} takes one value, or {files}; is '{value}'")
    return parts[0], parts[-1]


def readers(options, files):
    """Options of the reader for the first and for the second of two files."""
    both = {name: of_both("--" + name.replace("_", "-"), options.get(name), files) for name in ("unit", "time_unit", "rate_hz", "rotation")}
    both["rate_hz"] = tuple(number("--rate-hz", value) for value in both["rate_hz"])
    return [{name: values[n] for name, values in both.items()} for n in range(2)]


def evaluate(files, **options):
    """Result of the verification, as `--json` prints it. Throws PoseError; OSError if a file cannot be read."""
    from . import _verify

    unknown = sorted(options.keys() - set(OPTIONS))
    if unknown:
        raise TypeError(f"unknown option {unknown[0]} with dynamic")
    if len(files) != 2:
        raise PoseError("--dynamic takes two files, TRUTH and POSES")
    for name in WRITTEN if options.get("out") else ():
        refuse_input_as_output({"--out": os.path.join(options["out"], name)}, files)
    of_reference, of_poses = readers(options, "TRUTH,POSES")
    reference = _poses.read(files[0], sensor=options.get("reference_sensor"), **of_reference)
    poses = _poses.read(files[1], sensor=options.get("sensor"), columns=options.get("columns"), **of_poses)
    result, errors = _verify.verified(poses, reference, time_offset=number("--time-offset", options.get("time_offset")),
                                      same_clock=bool(options.get("same_clock")))
    if options.get("out"):
        write(os.fspath(options["out"]), errors, csv_only=bool(options.get("csv_only")))
    return result


def verify(poses, reference, *, time_offset_s: float | None = None, same_clock: bool = False) -> dict:
    """Errors of a tracker in motion, measured against a reference and predicted by the error model.

    poses: of the tracker, in its source frame. reference: of a robot or an optical system, in its own frame and clock. Each is what
    read_poses() returns, an array with the fields time_s, position_m and quaternion_wxyz, or a tuple (time_s (N,), position_m (N, 3),
    quaternion_wxyz (N, 4) or None). time_offset_s: reference time minus tracker time, where the search begins; None: everywhere.
    same_clock: time_offset_s (default 0) is exact, and the latency is measured.

    Fitted are clock offset and rate, frames, mounting, scale, multiplexing and slot time. Returns the dictionary that `tricoil evaluate
    --dynamic --json` prints, with "errors", a dictionary of arrays: time_s, measured_m and predicted_m (N, 3; tracker minus reference, source
    frame), speed_m_s, rate_rad_s, range_m and is_outlier. Raises ValueError with the reason if the two do not fit.
    """
    from . import _verify
    from ._command import own_names

    try:
        result, errors = _verify.verified(of_arrays(poses, "poses"), of_arrays(reference, "reference"), time_offset=number("--time-offset", time_offset_s),
                                          same_clock=same_clock)
    except PoseError as error:
        raise ValueError(own_names(str(error), {"--time-offset": "time_offset_s"})) from None
    result["errors"] = {name: getattr(errors, name) for name in ("time_s", "measured_m", "predicted_m", "speed_m_s", "rate_rad_s", "range_m", "is_outlier")}
    return result


def of_arrays(value, name):
    if isinstance(value, Poses):
        return value
    if isinstance(value, np.ndarray) and value.dtype.names:
        if "valid" in value.dtype.names:
            value = value[value["valid"]]
        value = (value["time_s"], value["position_m"], value["quaternion_wxyz"])
    try:
        time_s, position_m, q = value
    except (TypeError, ValueError):
        raise PoseError(f"{name}: give what read_poses() returns, or (time_s, position_m, quaternion_wxyz)") from None
    return _poses.checked(time_s, position_m, q, name, lambda row: f"{name}, row {row}")


# Output


def csv_text(e):
    """Errors of each pose as CSV: measured and predicted, source frame."""
    names = ["time_s", "speed_m_s", "angular_rate_rad_s", "range_m", *(f"{kind}_{axis}_mm" for kind in ("measured", "predicted") for axis in "xyz"),
             "position_error_mm", "predicted_error_mm", "left_mm", "orientation_error_deg", "outlier"]
    length = [1e3 * np.linalg.norm(v, axis=1) for v in (e.measured_m, e.predicted_m, e.left_m)]
    turned = np.full(len(e.time_s), np.nan) if e.orientation_rad is None else np.degrees(e.orientation_rad)
    table = np.column_stack((e.time_s, e.speed_m_s, e.rate_rad_s, e.range_m, 1e3 * e.measured_m, 1e3 * e.predicted_m, *length, turned))
    lines = [",".join(names)]
    for row, outlier in zip(table, e.is_outlier):
        lines.append(f"{row[0]:.6f}," + ",".join("" if np.isnan(v) else f"{v:.5f}" for v in row[1:]) + f",{int(outlier)}")
    return "\n".join(lines) + "\n"


def write(out, errors, *, csv_only=False):
    """dynamic_errors.csv and dynamic_errors.svg, complete or not at all. csv_only: removes an older picture instead."""
    try:
        with StagedFolder(out) as staged:
            with open(os.path.join(staged.path, WRITTEN[0]), "w", encoding="utf-8") as file:
                file.write(csv_text(errors))
            if csv_only:
                staged.publish()
                with contextlib.suppress(FileNotFoundError):
                    os.unlink(os.path.join(out, WRITTEN[1]))
            else:
                draw_and_publish(staged, out, WRITTEN[1:])
    except ValueError as error:
        raise PoseError(str(error)) from None


def text(r):
    """The result as lines."""
    lines = [f"{r['poses']} poses compared; reference clock minus tracker clock {1e3 * r['time_offset_s']:+.3f} ms at {r['time_offset_at_s']:.3f} s, "
             f"rate {r['clock_rate_ppm']:+.1f} +- {r['clock_rate_std_ppm']:.1f} ppm"]
    for count, why in ((r["poses_in_gaps"], "poses not compared: gaps in the reference"),
                       (r["outliers"], "poses are outliers, not compared; the first at " + ", ".join(f"{t:.3f} s" for t in r["outlier_times_s"][:3]))):
        if count:
            lines.append(f"  {count} {why}")
    at_rest = f"RMS {1e3 * r['rest_rms_m']:.3f} mm ({r['poses_at_rest']} poses)" if r["rest_rms_m"] is not None else "too few poses at rest"
    lines.append(f"  static       {at_rest}; noise from pose to pose {1e3 * r['noise_m']:.3f} mm")
    lines.append(f"  position     RMS {1e3 * r['position_rms_m']:.3f} mm   95 % {1e3 * r['position_p95_m']:.3f} mm   max {1e3 * r['position_max_m']:.3f} mm")
    if r["orientation_rms_deg"] is not None:
        lines.append(f"  orientation  RMS {r['orientation_rms_deg']:.4f} deg  95 % {r['orientation_p95_deg']:.4f} deg  max {r['orientation_max_deg']:.4f} deg")
    slot = f", slot {1e3 * r['slot_s']:.4f} +- {1e3 * r['slot_std_s']:.4f} ms" if r["slot_s"] is not None else ""
    lines.append(f"  multiplexing {r['multiplexing']}{slot}")
    lines.append(f"  latency      {1e3 * r['lag_s']:+.3f} +- {1e3 * r['lag_std_s']:.3f} ms" if r["lag_s"] is not None
                 else "  latency      not observable without a common clock (--same-clock)")
    lines.append(f"  scale        {r['scale_factor']:.5f} +- {r['scale_factor_std']:.5f}")
    motion = f"  motion error {1e3 * r['motion_error_m']:.3f} mm RMS"
    if r["distinguishable"] and r["r2"] is not None:
        between = " ({:.4f} to {:.4f})".format(*r["r2_interval"]) if r["r2_interval"] else ""
        lines.append(f"{motion}, predicted {1e3 * r['predicted_rms_m']:.3f} mm: R2 {r['r2']:.4f}{between}")
    else:
        lines.append(f"{motion}: not distinguishable from noise")
    first_tdm = next((one for one in r["alternatives"] if one["name"].startswith("TDM")), None)
    shown = [one for one in r["alternatives"] if one is first_tdm or not one["name"].startswith("TDM")]
    for verdict, wanted in (("rejected", True), ("not rejected", False)):
        named = [f"{one['name']} (residual x{one['residual_ratio']:.3f})" for one in shown if one["rejected"] is wanted]
        if named:
            lines.append(f"  {verdict:<12} " + ", ".join(named))
    lines.append("                           poses  measured  predicted       left, 95 %")
    for key, unit in (("speed_m_s", "m/s"), ("rate_rad_s", "rad/s"), ("range_m", "m")):
        for band in r["by"][key]:
            named = f"above {band['from']:g}" if band["to"] is None else f"{band['from']:g} to {band['to']:g}"
            lines.append(row(f"{named} {unit}", band["poses"], band))
    lines += [row(band["name"], "", band) for band in r["by"]["direction"]]
    return "\n".join([*lines, *(f"  note: {note}" for note in r["notes"])]) + "\n"


def row(name, poses, band):
    predicted = f"{1e3 * band['predicted_rms_m']:.3f} mm" if "predicted_rms_m" in band else ""
    low, high = band["left_interval_m"]
    between = "" if low is None else f" ({1e3 * low:.3f} to {1e3 * high:.3f})"
    return f"  {name:<23} {poses:>7} {1e3 * band['position_rms_m']:>6.3f} mm {predicted:>10}  {1e3 * band['left_rms_m']:.3f}{between} mm"
