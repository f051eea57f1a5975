"""`tricoil calibrate free-motion`: coils from any motion, without ground truth."""

import json

from . import _tricoil
from ._calibration_files import end_text, files_of, half_space, number, parameters_text, percent
from ._number_text import number_text

NOT_OBSERVABLE = ("not observable from free motion: the coupling constant C (scale of all lengths), a rotation of each triad as a whole, coils reversed or "
                  "swapped in pairs, the hemisphere")


def run(data, out, blob=None, model=None, coupling_constant=None, column_skew=0.0, hemisphere=None, wiring=None,
        converters_from=None) -> tuple[dict, str]:
    """What `tricoil calibrate free-motion --json` prints, and its text. Raises ValueError; OSError if a disk fails.

    model: default: concentric, or general if that does not explain the couplings. column_skew: time between columns, in frame periods.
    """
    constant, skew = number("coupling-constant", coupling_constant), number("column-skew", column_skew)
    if constant is not None and not 1e-12 <= constant <= 1e12:
        raise ValueError(f"--coupling-constant must lie between 1e-12 and 1e12; got {coupling_constant}")
    if constant is None and blob:
        raise ValueError("--blob needs --coupling-constant: all positions of a tracker follow from it, and free motion does not determine it")
    if not abs(skew) < 1:
        raise ValueError(f"--column-skew must lie between -1 and 1 frames; got {column_skew}")
    files = files_of(data, out, blob, converters_from=converters_from, wiring=wiring)
    result = json.loads(_tricoil.calibrate_free_motion(files, None if model is None else str(model), skew, constant, half_space(hemisphere)))
    result["not_observable"] = NOT_OBSERVABLE
    return result, _text(result) + end_text(result)


def _text(r: dict) -> str:
    first, second = ([number_text(r[f"ratio_spread_{time}"][n], ".4f") for time in ("before", "after")] for n in (0, 1))
    before, after = (" : ".join(number_text(one, ".4f") for one in r[f"ratios_{time}"][:2]) for time in ("before", "after"))
    lines = [f"{r['frames']} frames; share of the couplings that no dipole explains: {percent(r['misfit_before'])} before, "
             f"{percent(r['misfit_after'])} after\n",
             f"  singular ratios {before} : 1 before, {after} : 1 after (ideal 2 : 1 : 1)\n",
             f"  spread over the frames: s1/(s2+s3) {first[0]} before, {first[1]} after; s2/s3 {second[0]} before, {second[1]} after\n"]
    for name in ("sensor", "source"):
        for row, (values, deviations) in enumerate(zip(r[name], r[name + "_deviation"])):
            lines.append(f"  {name if row == 0 else '':<7} " + " ".join(number_text(x, ">9.5f") for x in values) + "   +- "
                         + " ".join(number_text(x, ".5f") for x in deviations) + "\n")
    if "parameters" in r:
        lines += [f"  with positions and sizes of the coils: couplings unexplained {percent(r['residual_rms'])}, {r['outliers']} outliers; estimated "
                  f"error of positions from these coils {percent(r['position_error_share'])} of the range\n", parameters_text(r["parameters"])]
    return "".join(lines) + f"  {r['not_observable']}\n"
