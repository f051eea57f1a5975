"""tricoil motion --poses and --trajectory: tables of the predicted error, and files of the poses without it."""

import numpy as np

from ._dynamic import number, of_both, readers
from ._fitted_timing import rms_by_reference
from ._motion_along import along
from ._motion_analysis import CAUSES
from ._motion_error import MotionError, chosen_timing, motion_error
from ._motion_example import PLAN_OPTIONS
from ._output_file import refuse_input_as_output, write_all, write_whole
from ._picture import check_picture, picture
from ._poses import READER_OPTIONS, PoseError, read, refuse_others
from ._timing import TIMINGS
from ._verify import RANGE_EDGES, RATE_EDGES, SPEED_EDGES, rms

EDGES = {"speed_m_s": SPEED_EDGES, "angular_rate_rad_s": RATE_EDGES, "range_m": RANGE_EDGES}
TITLES = {"speed_m_s": "speed, m/s", "angular_rate_rad_s": "angular rate, rad/s", "range_m": "range, m"}
UPDATES_HZ = 240.0
CARRIER_HZ, LIGHT_M_S = 14_000.0, 299_792_458.0  # FASTRAK and LIBERTY use 8 to 14 kHz
UNCHECKED = "an assumption: without a reference it cannot be checked"


def _errors(rows):
    """RMS of the predicted error and of its standard deviation."""
    return {
        "position_rms_m": rms(rows["total"][:, :3]),
        "position_deviation_m": rms(rows["total_deviation"][:, :3]),
        "rotation_rms_rad": rms(rows["total"][:, 3:]),
        "rotation_deviation_rad": rms(rows["total_deviation"][:, 3:]),
    }


def table(rows, by: str) -> list[dict]:
    """Predicted errors in intervals of speed_m_s, angular_rate_rad_s or range_m; empty intervals are left out. The last one has no end (None)."""
    edges = EDGES[by]
    result = []
    for low, high in zip(edges[:-1], edges[1:]):
        part = rows[(rows[by] >= low) & (rows[by] < high)]
        if len(part):
            result.append({"from": low, "to": None if np.isinf(high) else high, "poses": len(part), **_errors(part)})
    return result


def near_field(position_m) -> dict:
    """Relative error of the dipole's near field, (r k)^2 / 2 with k = 2 pi f / c, at the farthest pose and the highest carrier of common trackers."""
    range_m = float(np.linalg.norm(position_m, axis=1).max())
    return {"range_m": range_m, "carrier_hz": CARRIER_HZ, "share": float((2 * np.pi * CARRIER_HZ / LIGHT_M_S * range_m) ** 2 / 2)}


def near_field_line(found: dict) -> str:
    return f"  near field   assumed: (r k)^2 / 2 = {found['share']:.1e} at {found['range_m']:.2f} m and {found['carrier_hz'] / 1e3:g} kHz"


def summary(result: MotionError) -> dict:
    """The result of `tricoil motion --poses --json`."""
    rows = result.rows[result.rows["is_predicted"]]
    stated = {name: rms(np.sqrt(np.diagonal(poses.covariance[result.rows["is_predicted"], :3, :3], axis1=1, axis2=2)))
              for name, poses in (("corrected", result.corrected), ("smoothed", result.smoothed))}
    causes = {cause: {"position_rms_m": rms(rows[cause][:, :3]), "position_deviation_m": rms(rows[cause + "_deviation"][:, :3]),
                      "rotation_rms_rad": rms(rows[cause][:, 3:])} for cause in CAUSES}
    return {
        "file": result.corrected.name,
        "timing": result.timing.text,
        "assumed": result.timing.describe(),
        "poses": len(result.rows),
        "poses_beside_gaps": int(np.sum(~result.rows["is_predicted"])),
        "duration_s": float(result.rows["time_s"][-1] - result.rows["time_s"][0]),
        **_errors(rows),
        "causes": causes,
        "tables": {by: table(rows, by) for by in EDGES},
        "corrected_deviation_m": stated["corrected"],
        "smoothed_deviation_m": stated["smoothed"],
        "near_field": near_field(result.corrected.position_m),
        "notes": list(result.corrected.notes),
    }


def _mm(metres):
    return f"{1e3 * metres:.3f}"


def text(result: dict) -> str:
    """The result as the program prints it."""
    lines = [f"{result['file']}: {result['poses']} poses, {result['duration_s']:.2f} s"]
    lines += [f"  {note}" for note in result["notes"]]
    against = result.get("reference")
    lines += [f"  timing       {result['timing']}: {result['assumed']}"]
    seen = seen_timing(against)
    if against is None:
        lines.append(f"               {seen}")
    else:
        lines.append(f"               {seen}; against {against['file']}: {_mm(against['given_rms_m'])} mm RMS as given, "
                     f"{_mm(against['corrected_rms_m'])} mm corrected")
    lines.append(near_field_line(result["near_field"]))
    if result["poses_beside_gaps"]:
        lines.append(f"  left out     {result['poses_beside_gaps']} poses between gaps that are too close")
    lines.append(f"  motion error {_mm(result['position_rms_m'])} mm RMS, deviation {_mm(result['position_deviation_m'])} mm; "
                 f"{np.degrees(result['rotation_rms_rad']):.4f} deg, deviation {np.degrees(result['rotation_deviation_rad']):.4f}")
    causes = [f"{cause} {_mm(error['position_rms_m'])} mm" for cause, error in result["causes"].items()]
    lines.append(f"  by cause     {', '.join(causes)}")
    lines.append(f"  corrected    deviation {_mm(result['corrected_deviation_m'])} mm, smoothed {_mm(result['smoothed_deviation_m'])} mm")
    for by, intervals in result["tables"].items():
        lines.append(f"  {TITLES[by]:<20} {'poses':>7} {'error, mm':>11} {'deviation':>10} {'error, deg':>11}")
        for one in intervals:
            ends = f"{one['from']:g} and more" if one["to"] is None else f"{one['from']:g} to {one['to']:g}"
            lines.append(f"    {ends:<18} {one['poses']:>7} {_mm(one['position_rms_m']):>11} {_mm(one['position_deviation_m']):>10} "
                         f"{np.degrees(one['rotation_rms_rad']):>11.4f}")
    return "\n".join(lines) + "\n"


def seen_timing(against: dict | None) -> str:
    """How the timing is known. against: the comparison with a reference."""
    if against is None:
        return UNCHECKED
    return f"found with {against['file']} ({against['multiplexing']})" if against["multiplexing"] else "given"


def corrected_csv(result: MotionError, smooth: bool, against: dict | None) -> str:
    """Corrected poses as CSV; a comment line says how the timing is known."""
    poses = result.smoothed if smooth else result.corrected
    names = ["time_s", "x_m", "y_m", "z_m", "qw", "qx", "qy", "qz", "std_x_m", "std_y_m", "std_z_m", "std_rx_rad", "std_ry_rad", "std_rz_rad",
             "error_x_m", "error_y_m", "error_z_m", "error_rx_rad", "error_ry_rad", "error_rz_rad", "corrected"]
    deviations = np.sqrt(np.diagonal(poses.covariance, axis1=1, axis2=2))
    values = np.hstack((poses.position_m, poses.quaternion_wxyz, deviations, result.rows["total"]))
    kind = "smoothed poses" if smooth else "poses"
    lines = [f"# {kind} without motion error; timing {result.timing.text}: {result.timing.describe()}; {seen_timing(against)}", ",".join(names)]
    for time_s, row, is_corrected in zip(poses.time_s, values, poses.is_corrected):
        fields = ["" if np.isnan(value) else f"{value:.10g}" for value in row]
        lines.append(",".join((f"{time_s:.9f}", *fields, str(int(is_corrected)))))
    return "\n".join(lines) + "\n"


def read_both(poses, reference, options):
    """Poses, and the reference (None without). Options are POSES,REFERENCE or one for both; one --sensor is that of the poses."""
    if reference is None:
        return read(poses, **options), None
    of_poses, of_reference = readers(options, "POSES,REFERENCE")
    sensor = options.get("sensor")
    sensors = (sensor, None)
    if isinstance(sensor, (list, tuple)) or "," in str(sensor):
        sensors = of_both("--sensor", sensor, "POSES,REFERENCE")
    return (read(poses, sensor=sensors[0], columns=options.get("columns"), **of_poses), read(reference, sensor=sensors[1], **of_reference))


def run_poses(poses, timing=None, reference=None, out=None, plot=None, smooth=False, **reader) -> dict:
    """Reads a file of poses, predicts its motion error, and writes what is wanted. Raises PoseError, OSError."""
    if timing is None:
        raise PoseError(f"motion --poses needs --timing: tdm:SLOTS/RATE, for example tdm:3/720, fdm, {', '.join(TIMINGS)}, or fit with --reference")
    refuse_others(reader, READER_OPTIONS, "not with --poses")
    check_picture(plot)
    refuse_input_as_output({"--out": out, "--plot": plot}, [poses, reference])
    given, known_path = read_both(poses, reference, reader)
    known, verified = chosen_timing(given, timing, known_path)
    result = motion_error(given, known)
    found = summary(result)
    if reference is not None:
        corrected = result.smoothed if smooth else result.corrected
        is_changed = not np.array_equal(corrected.position_m, given.position_m)
        given_m = verified["position_rms_m"] if verified else rms_by_reference(given, known_path)
        found["reference"] = {"file": known_path.name, "given_rms_m": given_m,
                              "corrected_rms_m": rms_by_reference(corrected, known_path) if is_changed else given_m,
                              "multiplexing": verified["multiplexing"] if verified else None}
    contents: dict[str, str | bytes] = {} if out is None else {out: corrected_csv(result, bool(smooth), found.get("reference"))}
    if plot is not None:
        from . import plot as drawing

        contents[plot] = picture(plot, drawing.motion_error(result))
    write_all(contents)
    return found


def place_of(text):
    """Three numbers of --place; None: as recorded."""
    if text is None:
        return None
    try:
        place = [float(word) for word in (text.split(",") if isinstance(text, str) else text)]
    except (TypeError, ValueError):
        place = []
    if len(place) != 3 or not np.all(np.isfinite(place)):
        raise PoseError(f"--place must be three numbers x,y,z in m; is '{text}'")
    return place


def run_trajectory(trajectory, kappa="exact", loop="open", rate_hz=None, place=None, out=None, **reader) -> dict:
    """Errors by the paper's formulas along the path of a file. rate_hz: updates per second; of a file without time, that of its rows; or both, UPDATES,POSES. Raises PoseError, OSError."""
    refuse_others(reader, READER_OPTIONS, "not with --trajectory")
    refuse_input_as_output({"--out": out}, [trajectory])
    updates, rows_hz = (number("--rate-hz", one) for one in of_both("--rate-hz", rate_hz, "UPDATES,POSES"))
    updates_hz = UPDATES_HZ if updates is None else updates
    try:
        path = read(trajectory, **reader)
    except PoseError:
        if rows_hz is None:
            raise
        path = read(trajectory, rate_hz=rows_hz, **reader)
        updates_hz = UPDATES_HZ if updates == rows_hz else updates_hz
    rows = along(path, kappa, loop, updates_hz, place_of(place))
    if out is not None:
        names = ("time_s", "range_m", "azimuth_rad", "elevation_rad", "e_rho_m", "e_alpha_rad", "e_beta_rad")
        write_whole(out, "\n".join([",".join(names), *(",".join(f"{row[name]:.10g}" for name in names) for row in rows)]) + "\n")
    maxima = {f"max_abs_{name}": float(np.max(abs(rows[name]))) for name in ("e_rho_m", "e_alpha_rad", "e_beta_rad")}
    apart = np.linalg.norm(rows["position_error_m"], axis=1)
    return {
        "file": path.name,
        "kappa": kappa,
        "loop": loop,
        "update_s": 1 / updates_hz,
        "updates": len(rows) - 1,
        "placed": place is not None,
        "predicted": {**maxima, "final_e_beta_rad": float(rows["e_beta_rad"][-1])},
        "position_error_rms_m": float(np.sqrt(np.mean(apart**2))),
        "max_position_error_m": float(apart.max()),
        "max_speed_m_s": float(rows["speed_m_s"].max()),
        "near_field": near_field(rows["position_m"]),
        "notes": list(path.notes),
    }


def trajectory_text(result: dict) -> str:
    where = "moved by --place" if result["placed"] else "where it was recorded"
    predicted = result["predicted"]
    lines = [f"{result['file']}: path {where}, spline between its poses, up to {result['max_speed_m_s']:.2f} m/s"]
    lines += [f"  {note}" for note in result["notes"]]
    lines.append(f"  {result['loop']} loop, {result['updates']} updates of {result['update_s']:.6f} s, kappa {result['kappa']}")
    lines.append(f"  max|e_rho| {predicted['max_abs_e_rho_m']:.9f} m, max|e_alpha| {predicted['max_abs_e_alpha_rad']:.9f} rad, "
                 f"max|e_beta| {predicted['max_abs_e_beta_rad']:.9f} rad, final e_beta {predicted['final_e_beta_rad']:.9f} rad")
    lines.append(near_field_line(result["near_field"]))
    lines.append(f"  position error {_mm(result['position_error_rms_m'])} mm RMS, at most {_mm(result['max_position_error_m'])} mm")
    return "\n".join(lines) + "\n"


def run(poses=None, trajectory=None, plan=None, **options) -> tuple[dict, str]:
    """Result and text of tricoil motion with --poses, --trajectory or --plan."""
    if plan is not None:
        from . import _plan

        if poses is not None or trajectory is not None:
            raise PoseError("--plan: not with --poses or --trajectory")
        refuse_others(options, PLAN_OPTIONS, "not with --plan")
        return _plan.run(plan, **options)
    if poses is not None and trajectory is not None:
        raise PoseError("give --poses or --trajectory, not both")
    if poses is not None:
        result = run_poses(poses, **options)
        return result, text(result)
    result = run_trajectory(trajectory, **options)
    return result, trajectory_text(result)
