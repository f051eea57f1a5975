"""`tricoil calibrate stage`: coils and fixtures, from couplings at known poses of a stage."""

import json

from . import _tricoil
from ._calibration_files import end_text, files_of, mm, parameters_text, percent
from ._number_text import number_text


def run(data, out, blob=None, model="general", fixtures="free", stage=None, fixture=(), wiring=None, converters_from=None,
        converters=False) -> tuple[dict, str]:
    """What `tricoil calibrate stage --json` prints, and its text. Raises ValueError; OSError if a disk fails.

    converters: also the errors of the board's converters, for `tricoil calibrate converters`.
    """
    files = files_of(data, out, blob, converters_from=converters_from, wiring=wiring)
    names = [fixture] if isinstance(fixture, str) else list(map(str, fixture))
    result = json.loads(_tricoil.calibrate_stage(files, str(model), str(fixtures), None if stage is None else str(stage), names, bool(converters)))
    return result, _text(result) + end_text(result)


def _text(r: dict) -> str:
    lines = [f"{r['poses']} poses, model {r['model']}, fixtures {r['fixtures']}; closed-form start {mm(r['start_position_rms_m'], '.2f')}, couplings "
             f"unexplained {percent(r['residual_rms'])}, condition number {number_text(r['condition'], '.0f')}\n",
             f"  moments in units of C = {r['coupling_constant']:.6g}\n", parameters_text(r["parameters"]),
             *(f"  {path}: couplings unexplained {100 * rms:.3f} %\n" for path, rms in r["residual_rms_by_file"].items()),
             f"  on these poses: {mm(r['position_rms_m'], '.4f')}, {number_text(r['orientation_rms_deg'], '.4f')} deg RMS "
             f"(95 % {mm(r['position_p95_m'], '.4f')}, {number_text(r['orientation_p95_deg'], '.4f')} deg)\n"]
    if "converters" in r:
        lines.append(f"  converters: non-linearity {number_text(r['converters']['non_linearity_lsb'], '.2f')} LSB, gain steps "
                     f"{percent(r['converters']['gain_error'])} RMS\n")
    return "".join(lines)
