"""`tricoil calibrate surroundings`: metal at rest relative to the source, as virtual dipoles in the calibration of the coils."""

import dataclasses
import json

import numpy as np
from numpy.typing import NDArray

from . import _tricoil
from ._calibration_files import end_text, files_of, half_space, node_counts, number
from ._induced import Coils
from ._surroundings_fit import Placed, fit_surroundings, upper_median

OUTLIER_MEDIANS, OUTLIER_RANGE = 20, 0.01  # an error far above that of the others, and above this share of the range


@dataclasses.dataclass
class ModelErrors:
    """Errors of the poses that a model gives for the couplings. error_m: infinite without convergence; not in the other figures."""

    error_m: NDArray
    misfit_share: NDArray  # of the couplings, that no pose explains

    @property
    def not_converged(self) -> int:
        return int(np.sum(np.isinf(self.error_m)))

    @property
    def found_m(self) -> NDArray:
        found = self.error_m[np.isfinite(self.error_m)]
        return found if len(found) else np.zeros(1)

    @property
    def rms_m(self) -> float:
        return float(np.sqrt(np.mean(self.found_m**2)))

    def result(self) -> dict:
        return {"position_rms_m": self.rms_m, "position_max_m": float(np.max(self.found_m)), "not_converged": self.not_converged}


def _errors(room, dipoles, truth_m) -> ModelErrors:
    rows = room.solve(dipoles, truth_m)
    error_m = np.where(rows[:, 0] > 0, np.linalg.norm(rows[:, 1:4] - truth_m, axis=1), np.inf)
    return ModelErrors(error_m, rows[:, 4])


def _refuse_bad_fit(without: ModelErrors, found: ModelErrors, truth_m) -> None:
    """Raises ValueError for a pose that does not fit the others, and for dipoles that increase the error."""
    worst = int(np.argmax(found.error_m))
    error_m = found.error_m[worst]
    if error_m > OUTLIER_MEDIANS * upper_median(found.error_m) and error_m > OUTLIER_RANGE * np.linalg.norm(truth_m[worst]):
        reason = "its couplings give no pose" if np.isinf(error_m) else f"{1e3 * error_m:.1f} mm of error, RMS of all {1e3 * found.rms_m:.1f} mm"
        raise ValueError(f"pose {worst + 1} of {len(truth_m)} does not fit the others: {reason}; its data are wrong, or metal is too near: correct or remove it")
    more = found.not_converged - without.not_converged
    if more > 0 or (more == 0 and not found.rms_m < without.rms_m):
        raise ValueError(f"the virtual dipoles make the poses worse: {1e3 * without.rms_m:.3f} mm RMS without them, {1e3 * found.rms_m:.3f} mm with them, "
                         f"{found.not_converged} of {len(truth_m)} poses without a solution; use the calibration without surroundings")


def _open(files, calibration, out, blob, wiring, refit_fixtures, spacing_mm, nodes, hemisphere):
    if spacing_mm is not None and refit_fixtures:
        raise ValueError("--refit-fixtures and --spacing-mm: the place of a grid is always estimated; remove --refit-fixtures")
    for name, value in (("nodes", nodes), ("hemisphere", hemisphere)):
        if value is not None and spacing_mm is None:
            raise ValueError(f"--{name} requires --spacing-mm")
    return _tricoil.Surroundings(files_of(files, out, blob, calibration, wiring=wiring), bool(refit_fixtures), number("spacing-mm", spacing_mm),
                                 node_counts(nodes), half_space(hemisphere) or [1, 0, 0])


def run(files, calibration, out, blob=None, wiring=None, refit_fixtures=False, spacing_mm=None, nodes=None, hemisphere=None) -> tuple[dict, str]:
    """What `tricoil calibrate surroundings --json` prints, and its text. Raises ValueError; OSError if a disk fails."""
    room = _open(files, calibration, out, blob, wiring, refit_fixtures, spacing_mm, nodes, hemisphere)
    unknown_levels, poses, starts, numbers = room.data()
    matrices = poses[:, 3:].reshape(-1, 3, 3, 3)
    frame, mount = ((rigid[:9].reshape(3, 3), rigid[9:]) for rigid in starts)
    is_fitted = bool(refit_fixtures) or spacing_mm is not None
    data = Placed(poses[:, :3], *np.swapaxes(matrices, 0, 1), frame, mount, fixtures_known=not is_fitted, attitudes_known=spacing_mm is None)

    def model(position_m, attitude, dipoles):
        rows = room.model(position_m, attitude, dipoles)
        return rows[:, :9], rows[:, 9:].reshape(-1, 9, 6)

    fit = fit_surroundings(model, Coils(numbers), data)
    without, found = (_errors(room, dipoles, fit.position_m) for dipoles in (np.zeros((0, 12)), fit.dipoles))
    _refuse_bad_fit(without, found, fit.position_m)
    result = {"unknown_levels": unknown_levels, "poses": len(poses),
              "dipoles": [{"position_m": row[:3].tolist(), "polarisability_m3": row[3:].reshape(3, 3).tolist()} for row in fit.dipoles],
              "residual_before_m": fit.residual_before_m, "residual_m": fit.residual_m, "without_surroundings": without.result(),
              "with_surroundings": found.result(), "misfit_floor": None}
    if len(fit.quadrature):
        result["quadrature_deviation"] = fit.quadrature_deviation
    if is_fitted:
        result["frame_source"] = {"translation_m": fit.frame[1].tolist(), "rotation": fit.frame[0].tolist()}
        result["sensor_m"] = fit.mount[1].tolist()
    rigid = [np.append(rotation, translation) for rotation, translation in (fit.frame, fit.mount)] if refit_fixtures else []
    result = json.loads(room.write(fit.dipoles, fit.quadrature, fit.quadrature_deviation, float(np.max(found.misfit_share)), rigid, json.dumps(result)))
    return result, _text(result) + end_text(result)


def _text(r: dict) -> str:
    without, found = r["without_surroundings"], r["with_surroundings"]
    count = len(r["dipoles"])
    lines = [f"{r['poses']} poses; {count} virtual dipole{'' if count == 1 else 's'}; residuals as pose errors {1e3 * r['residual_before_m']:.3f} mm without "
             f"them, {1e3 * r['residual_m']:.3f} mm with them (RMS)",
             *("  dipole at " + " ".join(f"{1e3 * x:8.1f}" for x in dipole["position_m"]) + " mm" for dipole in r["dipoles"]),
             f"  on these poses: {1e3 * without['position_rms_m']:.3f} mm RMS without surroundings, {1e3 * found['position_rms_m']:.3f} mm with them (maximum "
             f"{1e3 * found['position_max_m']:.3f} mm)"]
    if "quadrature_deviation" in r:
        lines.append(f"  their quadratures fit within {100 * r['quadrature_deviation']:.1f} % (standard deviation)")
    return "\n".join(lines) + "\n"
