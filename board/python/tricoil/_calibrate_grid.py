"""`tricoil calibrate grid`: coils from a sensor on the nodes of a printed grid, in many attitudes."""

import json

from . import _tricoil
from ._calibration_files import end_text, files_of, half_space, mm, node_counts, number, parameters_text, percent
from ._number_text import number_text


def run(data, out, spacing_mm, blob=None, model="concentric", nodes=None, hemisphere=None, wiring=None, converters_from=None) -> tuple[dict, str]:
    """What `tricoil calibrate grid --json` prints, and its text. Raises ValueError; OSError if a disk fails."""
    files = files_of(data, out, blob, converters_from=converters_from, wiring=wiring)
    result = json.loads(_tricoil.calibrate_grid(files, str(model), number("spacing-mm", spacing_mm), node_counts(nodes), half_space(hemisphere) or [1, 0, 0]))
    return result, _text(result) + end_text(result)


def _text(r: dict) -> str:
    lines = [f"{r['frames']} frames on the grid: positions fit to {mm(r['position_rms_m'], '.3f')} RMS; couplings unexplained "
             f"{percent(r['misfit_before'])} before, {percent(r['misfit_after'])} after\n",
             f"  coupling constant {r['coupling_constant']:.6g} +- {percent(r['coupling_constant_deviation'], '.2f')}\n",
             *("  pivot " + " ".join(number_text(1e3 * x, ".2f") for x in pivot) + " mm from the node\n" for pivot in r["pivots_m"])]
    if "position_error_share" in r:
        lines.append(f"  {r['outliers']} outliers; estimated error of positions from these coils {percent(r['position_error_share'])} of the range\n")
    return "".join(lines) + parameters_text(r["parameters"])
