"""`tricoil evaluate --calibration`: pose errors of a calibrated tracker at known poses, as result, text, CSV and picture."""

import contextlib
import itertools
import math
import os

import numpy as np

from . import _tricoil
from ._drawing import draw_beside
from ._output_file import refuse_input_as_output, write_whole
from ._staged_folder import StagedFolder

BAND_M = 0.05
WITHIN = (0.1987, 0.7385, 0.9707)  # of a normal distribution in three dimensions: within 1, 2, 3 standard deviations
MOVED = 3  # standard deviations of the change of the surroundings
TABLE, PICTURE = "pose_errors.csv", "error_vectors.svg"
NAMES = "file,line,x_mm,y_mm,z_mm,ex_mm,ey_mm,ez_mm,rx_deg,ry_deg,rz_deg,misfit_share,iterations,converged"


def _rms(rows):
    """Of the lengths of the rows (N, 3), or of values (N)."""
    return math.sqrt(np.sum(rows**2) / len(rows))


def _summary(name, unit, values):
    """RMS, and percentiles by the nearest rank."""
    values, count = np.sort(values), len(values)
    ranks = [values[max(math.ceil(share * count), 1) - 1] if count else 0 for share in (0.5, 0.95, 1)]
    return {f"{name}_{of}_{unit}": float(value) for of, value in zip(("rms", "median", "p95", "max"), (_rms(values) if count else 0, *ranks))}


def _band(rows):
    rows = rows[rows["converged"]]
    return {"poses": len(rows), **_summary("position", "m", np.linalg.norm(rows["error_m"], axis=1)),
            **_summary("orientation", "deg", np.degrees(np.linalg.norm(rows["rotation_error_rad"], axis=1)))}


def _bands(rows):
    """In steps of 50 mm of range."""
    numbers = np.floor(np.linalg.norm(rows["truth_m"], axis=1) / BAND_M)
    return [{**_band(rows[numbers == n]), "from_m": float(BAND_M * n), "to_m": float(BAND_M * (n + 1))} for n in np.unique(numbers)]


def _explained(features, wanted):
    """Part of `wanted` that lies in the span of `features`. Rotations of a stage are read with five decimals: rounding adds no rank."""
    return features @ np.linalg.lstsq(features, wanted, rcond=1e-10)[0]


def _split(rows):
    """Position error by least squares: a cubic polynomial of the position (surroundings, field shape, stage), the remaining part that depends on the
    attitude within each file (sensor shape, fixture), and the rest (repeatability of the stage, noise)."""
    used = rows["converged"][:, None]
    x, y, z = 10 * (rows["truth_m"] - rows["truth_m"].mean(axis=0)).T
    cubic = [x**a * y**b * z**c for a, b, c in itertools.product(range(4), repeat=3) if a + b + c <= 3]
    turned = np.zeros((len(rows), rows["file"].max() + 1, 9))
    turned[np.arange(len(rows)), rows["file"]] = rows["stage_rotation"]
    error = np.where(used, rows["error_m"], 0)
    smooth = _explained(used * np.column_stack(cubic), error)
    attitude = _explained(used * turned.reshape(len(rows), -1), error - smooth)
    return {"source_axes_rms_m": np.sqrt(np.mean(error**2, axis=0)).tolist(), "smooth_in_position_m": _rms(smooth),
            "rough_m": _rms(error - smooth - attitude), "repeats_with_attitude_m": _rms(attitude)}


def _stated(rows):
    """Errors of the positions in standard deviations that a tracker states without noise."""
    rows = rows[rows["converged"] & (rows["deviation_m"] > 0)]
    if not len(rows):
        return {}
    within = [float(np.mean(rows["sigmas"] <= n)) for n in (1, 2, 3)]
    return {"stated": {"position_rms_m": _rms(rows["deviation_m"]), "within_1_2_3_sigma": within, "expected_within": list(WITHIN),
                       "nees_per_degree": float(np.mean(rows["sigmas"] ** 2) / 3)}}


def _surroundings(rows, deviation):
    """Mean change of the quadratures of the surroundings, whose calibration leaves `deviation` at each pose. Errors of neighbouring poses are alike, so
    that of the mean is not assumed to be smaller."""
    changes = rows["surroundings_change"][np.isfinite(rows["surroundings_change"])]
    if not len(changes):
        return {}
    change = float(np.mean(changes))
    return {"surroundings": {"change": change, "change_sigma": deviation, "moved": abs(change) > MOVED * deviation}}


def _result(rows, facts, solver, refit_fixtures):
    refitted, kept = "refitted on this data", "from the calibration"
    result = {**_band(rows), "poses_not_converged": int(np.sum(~rows["converged"])), "iterations_max": int(rows["iterations"].max()),
              "misfit_share_max": float(np.fmax.reduce(rows["misfit_share"])), "solver": solver, "fixtures": refitted if refit_fixtures else kept,
              "scale": refitted if facts["fits_scale"] else kept, "stage_errors": facts["stage_errors"], "bands": _bands(rows), "residual": _split(rows)}
    if facts["misfit_floor"] > 0:
        result["misfit_floor"] = facts["misfit_floor"]
        result["poses_distorted"] = int(np.sum(rows["misfit_floor"] > facts["misfit_floor"]))
    if "poses_beyond_quadrature_floor" in facts:
        result |= {name: facts[name] for name in ("quadrature_floor", "poses_beyond_quadrature_floor")}
    return {**result, **_surroundings(rows, facts["quadrature_deviation"]), **_stated(rows)}


def _csv(rows, paths):
    lines = [NAMES]
    for row in rows:
        lengths = (*1e3 * row["error_m"], *np.degrees(row["rotation_error_rad"]))
        lines.append(",".join((os.path.basename(paths[row["file"]]), str(row["line"]), *(f"{value:.3f}" for value in 1e3 * row["truth_m"]),
                               *(f"{value:.5f}" for value in lengths), f"{row['misfit_share']:.6f}", str(row["iterations"]), str(int(row["converged"])))))
    return "\n".join(lines) + "\n"


def _write(out, rows, paths):
    with StagedFolder(out) as staged:
        write_whole(os.path.join(staged.path, TABLE), _csv(rows, paths))
        staged.publish()
    with contextlib.suppress(FileNotFoundError):  # of older errors
        os.unlink(os.path.join(out, PICTURE))


def run(files, calibration=None, solver="refined", stage_from="", wiring="", fixture=(), refit_fixtures=False, out=None):
    """The result of `tricoil evaluate --json`, and a notice for poses that did not converge. out: folder for the table. Raises ValueError; OSError
    if a disk fails."""
    if calibration is None:
        raise ValueError("--calibration is required: the TOML file of tricoil calibrate (or use --dynamic)")
    named = [calibration, wiring, stage_from]
    if out is not None:
        refuse_input_as_output({"--out": os.path.join(out, TABLE)}, (*files, *(one for one in named if one)))
    fixtures = [fixture] if isinstance(fixture, str) else list(fixture)
    rows, facts = _tricoil.evaluated_poses([os.fspath(file) for file in files], *map(os.fspath, named), fixtures, solver, refit_fixtures)
    if out is not None:
        _write(os.fspath(out), rows, facts["paths"])
    result = _result(rows, facts, solver, refit_fixtures)
    return result, f"{result['poses_not_converged']} poses did not converge and are not in the table: {facts['not_converged']}"


def draw(out):
    """The picture, after run(). Raises ValueError."""
    draw_beside(os.fspath(out), TABLE, PICTURE)


def _row(name, band):
    lengths = [1e3 * band[f"position_{of}_m"] for of in ("rms", "median", "p95", "max")]
    angles = [band[f"orientation_{of}_deg"] for of in ("rms", "median", "p95", "max")]
    return (f"  {name:<14} {band['poses']:>6} {lengths[0]:>9.4f} " + " ".join(f"{value:>8.4f}" for value in lengths[1:]) + "   " +
            " ".join(f"{value:>8.4f}" for value in angles))


def text(r: dict) -> str:
    """The result as the program prints it."""
    kept = "from the calibration"
    fixtures = f"fixtures {kept}" if r["fixtures"] == kept else f"fixtures{'' if r['scale'] == kept else ' and scale'} REFITTED on this data"
    lines = [f"{r['poses']} poses, {r['solver']} solver, {fixtures}, errors of the stage {r['stage_errors']}; {r['poses_not_converged']} did not converge",
             "  range           poses    RMS mm   median     95 %      max    RMS deg   median     95 %      max"]
    lines += [_row(f"{band['from_m']:.2f}-{band['to_m']:.2f} m", band) for band in r["bands"]]
    lines.append(_row("all", r))
    if "misfit_floor" in r:
        lines.append(f"  {r['poses_distorted']} poses have a misfit beyond the calibrated floor ({100 * r['misfit_floor']:.3f} % per coupling)")
    if "quadrature_floor" in r:
        lines.append(f"  {r['poses_beyond_quadrature_floor']} poses have a quadrature beyond the calibrated floor "
                     f"({100 * r['quadrature_floor']:.3f} % per coupling)")
    if "surroundings" in r:
        s = r["surroundings"]
        lines.append(f"  quadratures of the surroundings: {100 * s['change']:+.1f} % of the calibrated ones (standard deviation "
                     f"{100 * s['change_sigma']:.1f} %)" + (": metal has moved, calibrate the surroundings again" if s["moved"] else ": unchanged"))
    if "stated" in r:
        s = r["stated"]
        within, expected = (", ".join(f"{100 * share:.1f}" for share in s[key]) for key in ("within_1_2_3_sigma", "expected_within"))
        lines.append(f"  stated deviation {1e3 * s['position_rms_m']:.3f} mm (RMS, without noise); {within} % of the errors within 1, 2, 3 of it "
                     f"(expected {expected} %); NEES per degree of freedom {s['nees_per_degree']:.2f} (1: as stated, more: too small)")
    left = r["residual"]
    lines.append(f"  error by cause: position in the workspace {1e3 * left['smooth_in_position_m']:.3f} mm, attitude "
                 f"{1e3 * left['repeats_with_attitude_m']:.3f} mm, other {1e3 * left['rough_m']:.3f} mm (RMS)")
    return "\n".join(lines) + "\n"
