"""tricoil evaluate: pose errors of a calibrated tracker against ground truth of a stage."""

import contextlib
import os

import numpy as np

from . import _tricoil
from ._drawing import draw_beside
from ._number_text import number_text
from ._output_file import refuse_input_as_output, write_whole

TABLE, PICTURE = "pose_errors.csv", "error_vectors.svg"
POSE = np.dtype([(name, float) for name in ("file", "line", "converged", "iterations")] +
                [(name, float, 3) for name in ("truth_m", "error_m", "rotation_error_rad")] +
                [(name, float) for name in ("range_m", "position_error_m", "orientation_error_deg", "misfit_share", "floor", "deviation_m", "sigmas",
                                            "surroundings_change", "unexplained_share")] + [("stage_rotation", float, 9)])
BAND_M = 0.05
NAMED = 5  # poses that did not converge
NORMAL_WITHIN = [0.1987, 0.7385, 0.9707]  # of a normal distribution in three dimensions
MOVED_SIGMAS = 3
WRONG_FACTOR, WRONG_ALWAYS = 10, 0.02
CUBIC = [(a, b, c) for a in range(4) for b in range(4 - a) for c in range(4 - a - b)]
CALIBRATED = "from the calibration"
REFITTED = "refitted on this data"


def _sum(values):
    """Sum in sequence, so that the result does not depend on the order that NumPy chooses."""
    return float(np.cumsum(values)[-1]) if len(values) else 0.0


def _rms(values):
    return float(np.sqrt(_sum(np.square(values)) / len(values)))


def _summary(name, unit, errors):
    """Percentiles by the nearest rank; all zero without errors."""
    errors = np.sort(errors) if len(errors) else np.zeros(1)
    rank = {key: float(errors[int(np.ceil(share * len(errors))) - 1]) for key, share in (("median", 0.5), ("p95", 0.95), ("max", 1))}
    return {f"{name}_{key}_{unit}": value for key, value in {"rms": _rms(errors), **rank}.items()}


def _band(poses):
    poses = poses[poses["converged"] > 0]
    return {"poses": len(poses), **_summary("position", "m", poses["position_error_m"]), **_summary("orientation", "deg", poses["orientation_error_deg"])}


def _residual(poses, paths):
    """Position error, split by least squares: a cubic polynomial of the position (surroundings, field shape, stage), the remaining part that
    depends on the attitude within each file (sensor shape, fixture), and the rest (repeatability of the stage, noise)."""
    ok = poses["converged"] > 0
    error = np.where(ok[:, None], poses["error_m"], 0)
    position = 10 * (poses["truth_m"] - poses["truth_m"].mean(axis=0))
    cubic = ok[:, None] * np.column_stack([np.prod(position ** np.array(powers), axis=1) for powers in CUBIC])
    attitude = np.column_stack([((poses["file"] == n) & ok)[:, None] * poses["stage_rotation"] for n in range(len(paths))])

    def explained(features, wanted):
        return features @ np.linalg.lstsq(features, wanted, rcond=None)[0]

    smooth = explained(cubic, error)
    turned = explained(attitude, error - smooth)
    smooth_m, attitude_m, rough_m = (float(np.linalg.norm(part) / np.sqrt(len(poses))) for part in (smooth, turned, error - smooth - turned))
    return {"source_axes_rms_m": np.sqrt(np.mean(error**2, axis=0)).tolist(), "smooth_in_position_m": smooth_m, "rough_m": rough_m,
            "repeats_with_attitude_m": attitude_m}


def _stated(poses):
    """Errors of the positions in standard deviations that a tracker states without noise; None: it states none."""
    poses = poses[(poses["converged"] > 0) & (poses["deviation_m"] > 0)]
    if not len(poses):
        return None
    sigmas = poses["sigmas"]
    return {"position_rms_m": _rms(poses["deviation_m"]), "within_1_2_3_sigma": [float(np.mean(sigmas <= n)) for n in (1, 2, 3)],
            "expected_within": NORMAL_WITHIN, "nees_per_degree": _sum(sigmas**2) / (3 * len(poses))}


def _surroundings(poses, deviation):
    """Mean change of the quadratures of the surroundings, whose calibration leaves `deviation` at each pose; None: not known. Errors of
    neighbouring poses are alike, so that of the mean is not assumed to be smaller."""
    change = poses["surroundings_change"][~np.isnan(poses["surroundings_change"])]
    if not len(change):
        return None
    mean = _sum(change) / len(change)
    return {"change": mean, "change_sigma": deviation, "moved": bool(abs(mean) > MOVED_SIGMAS * deviation)}


def _summary_of(poses, paths, known, solver, refit_fixtures):
    """The result of `tricoil evaluate --json`."""
    band = np.floor(poses["range_m"] / BAND_M)
    result = {**_band(poses), "poses_not_converged": int(np.sum(poses["converged"] == 0)), "iterations_max": int(poses["iterations"].max()),
              "misfit_share_max": float(poses["misfit_share"].max()), "solver": solver, "fixtures": REFITTED if refit_fixtures else CALIBRATED,
              "scale": REFITTED if known["fits_scale"] else CALIBRATED, "stage_errors": known["stage_errors"],
              "bands": [{**_band(poses[band == n]), "from_m": float(BAND_M * n), "to_m": float(BAND_M * (n + 1))} for n in np.unique(band)],
              "residual": _residual(poses, paths)}
    if known["misfit_floor"] > 0:
        result |= {"misfit_floor": known["misfit_floor"], "poses_distorted": int(np.sum(poses["floor"] > known["misfit_floor"]))}
    if known["beyond_quadrature_floor"] >= 0:
        result |= {"quadrature_floor": known["quadrature_floor"], "poses_beyond_quadrature_floor": known["beyond_quadrature_floor"]}
    more = {"surroundings": _surroundings(poses, known["surroundings_deviation"]), "stated": _stated(poses)}
    return result | {name: value for name, value in more.items() if value is not None}


def _refuse_wrong_fixtures(poses, residual_rms):
    """A wrong minimum, or other coils, also give poses, far from the true ones. Metal, which no pose explains, is not refused."""
    share = _rms(poses["unexplained_share"])
    if not np.any(poses["converged"]) or share > max(WRONG_FACTOR * max(residual_rms, _rms(poses["misfit_share"])), WRONG_ALWAYS):
        raise ValueError(f"--refit-fixtures: found no fixtures that fit these data: they leave {100 * share:.1f} % of the couplings unexplained, "
                         f"{100 * residual_rms:.2g} % in the calibration; are the data of these coils and of one mounting for each fixture?")


def _csv(poses, paths):
    """One line for each pose."""
    lines = ["file,line,x_mm,y_mm,z_mm,ex_mm,ey_mm,ez_mm,rx_deg,ry_deg,rz_deg,misfit_share,iterations,converged"]
    for e in poses:
        errors = ",".join(f"{value:.5f}" for value in (*(1e3 * e["error_m"]), *np.degrees(e["rotation_error_rad"])))
        lines.append(f"{os.path.basename(paths[int(e['file'])])},{e['line']:.0f}," + ",".join(f"{value:.3f}" for value in 1e3 * e["truth_m"]) +
                     f",{errors},{e['misfit_share']:.6f},{e['iterations']:.0f},{e['converged']:.0f}")
    return "\n".join(lines) + "\n"


def _write(folder, content):
    try:
        if not os.path.isdir(folder):
            os.mkdir(folder)
    except OSError as error:
        raise ValueError(f"cannot use output folder {folder}: {error.strerror}; create its parent or choose another") from None
    write_whole(os.path.join(folder, TABLE), content)
    with contextlib.suppress(OSError):
        os.unlink(os.path.join(folder, PICTURE))  # of older errors


def not_converged(poses, paths) -> str:
    """Places FILE:LINE of the poses without a solution; empty if there are none."""
    places = [f"{paths[int(e['file'])]}:{e['line']:.0f}" for e in poses[poses["converged"] == 0]]
    return ", ".join(places[:NAMED]) + (f" and {len(places) - NAMED} more" if len(places) > NAMED else "")


def run(data, calibration=None, solver="refined", stage_from="", wiring="", fixture=(), refit_fixtures=False, out="", csv_only=False) -> tuple[dict, str, str]:
    """Result, text, and places of the poses that did not converge. draw() makes the picture. Raises ValueError, OSError."""
    if not calibration:
        raise ValueError("--calibration is required: the TOML file of tricoil calibrate (or use --dynamic)")
    data, names = [os.fspath(file) for file in data], [fixture] if isinstance(fixture, str) else list(map(str, fixture))
    calibration, stage_from, wiring, out = map(os.fspath, (calibration, stage_from, wiring, out))
    refuse_input_as_output({"--out": os.path.join(out, TABLE) if out else None}, [*data, calibration, *filter(None, (wiring, stage_from))])
    rows, known = _tricoil.evaluate([os.fsencode(file) for file in data], *map(os.fsencode, (calibration, wiring, stage_from)), names,
                                    str(solver), bool(refit_fixtures))
    known["stage_errors"] = f"from {stage_from}" if stage_from else CALIBRATED if known["has_stage_errors"] else "none"
    poses = rows.view(POSE)[:, 0]
    if refit_fixtures:
        _refuse_wrong_fixtures(poses, known["residual_rms"])
    if out:
        _write(out, _csv(poses, data))
    result = _summary_of(poses, data, known, solver, refit_fixtures)
    return result, text(result), not_converged(poses, data)


def draw(out="", csv_only=False, **others) -> None:
    """The picture of the table that run() wrote with these options. Raises ValueError."""
    if out and not csv_only:
        draw_beside(os.fspath(out), TABLE, PICTURE)


def _row(name, band):
    lengths = [1e3 * band[f"position_{key}_m"] for key in ("rms", "median", "p95", "max")]
    angles = [band[f"orientation_{key}_deg"] for key in ("rms", "median", "p95", "max")]
    first, *others = [number_text(length, form) for length, form in zip(lengths, (">9.4f", *[">8.4f"] * 3))]
    return f"  {name:<14} {band['poses']:>6} {first} {' '.join(others)}   {' '.join(number_text(angle, '>8.4f') for angle in angles)}"


def text(r: dict) -> str:
    refitted = "fixtures REFITTED on this data" if r["scale"] == CALIBRATED else "fixtures and scale REFITTED on this data"
    lines = [f"{r['poses']} poses, {r['solver']} solver, {f'fixtures {CALIBRATED}' if r['fixtures'] == CALIBRATED else refitted}, errors of the stage "
             f"{r['stage_errors']}; {r['poses_not_converged']} did not converge",
             "  range           poses    RMS mm   median     95 %      max    RMS deg   median     95 %      max"]
    lines += [_row(f"{band['from_m']:.2f}-{band['to_m']:.2f} m", band) for band in r["bands"]] + [_row("all", r)]
    if "misfit_floor" in r:
        lines.append(f"  {r['poses_distorted']} poses have a misfit beyond the calibrated floor ({number_text(100 * r['misfit_floor'], '.3f')} % per coupling)")
    if "quadrature_floor" in r:
        lines.append(f"  {r['poses_beyond_quadrature_floor']} poses have a quadrature beyond the calibrated floor "
                     f"({number_text(100 * r['quadrature_floor'], '.3f')} % per coupling)")
    if s := r.get("surroundings"):
        lines.append(f"  quadratures of the surroundings: {number_text(100 * s['change'], '+.1f')} % of the calibrated ones (standard deviation "
                     f"{number_text(100 * s['change_sigma'], '.1f')} %)" + (": metal has moved, calibrate the surroundings again" if s["moved"] else ": unchanged"))
    if s := r.get("stated"):
        within, expected = (", ".join(number_text(100 * share, ".1f") for share in s[key]) for key in ("within_1_2_3_sigma", "expected_within"))
        lines.append(f"  stated deviation {number_text(1e3 * s['position_rms_m'], '.3f')} mm (RMS, without noise); {within} % of the errors within 1, 2, 3 of it "
                     f"(expected {expected} %); NEES per degree of freedom {number_text(s['nees_per_degree'], '.2f')} (1: as stated, more: too small)")
    s = r["residual"]
    lines.append(f"  error by cause: position in the workspace {number_text(1e3 * s['smooth_in_position_m'], '.3f')} mm, attitude "
                 f"{number_text(1e3 * s['repeats_with_attitude_m'], '.3f')} mm, other {number_text(1e3 * s['rough_m'], '.3f')} mm (RMS)")
    return "\n".join(lines) + "\n"
