"""tricoil motion: the error model against a simulation, for the paper's examples or own rates; with files: _motion_command.py."""

import numpy as np

from ._motion import PARTS, has_prediction, simulated
from ._number_text import number_text
from ._output_file import write_whole
from ._progress import bar

FILES = {"poses", "trajectory", "plan"}
RECORDED_OPTIONS = ("timing", "reference", "plot", "place", "unit", "time_unit", "rotation", "sensor", "columns")
PLAN_OPTIONS = ("center", "size", "grid", "limits", "turn_limits", "turn", "rate_hz", "chain", "link", "start_joints")
RATES = ("azimuth", "elevation", "range", "attitude")
TURN = 2 * np.pi


def error_csv(rows) -> str:
    """One line for each update; angles without whole turns, as the paper shows them; predictions that do not exist are empty."""
    names = ["time_s", "stamp_us", *PARTS, *(f"predicted_{name}" for name in PARTS), "e_alpha_rate_rad_s", "predicted_e_alpha_rate_rad_s", "e_psi_rad",
             "e_theta_rad", "e_phi_rad", "position_error_m", "rotation_error_rad"]
    columns = [rows["time_s"], rows["stamp_us"]]
    for kind in (0, 1):
        columns += [rows["e_rho_m"][:, kind], np.fmod(rows["e_alpha_rad"][:, kind], TURN), np.fmod(rows["e_beta_rad"][:, kind], TURN)]
    columns += [*rows["e_alpha_rate_rad_s"].T, *(np.fmod(rows[name], TURN) for name in ("e_psi_rad", "e_theta_rad", "e_phi_rad")),
                rows["position_error_m"], rows["rotation_error_rad"]]
    line = "%.9g,%d" + 6 * ",%.12g" + ",%.9g" + 4 * ",%.12g" + 2 * ",%.9g" + "\n"
    text = "".join(line % row for row in zip(*(column.tolist() for column in columns)))
    return ",".join(names) + "\n" + text.replace("nan", "")


def number(option, value):
    try:
        return float(value)
    except (TypeError, ValueError):
        raise ValueError(f"{option} {value}: expected a number") from None


def checked(option, value, least, largest):
    """The number, if it is within these limits."""
    value = number(option, value)
    if not least <= value <= largest:
        limits = [repr(float(one)).removesuffix(".0") for one in (least, largest, value)]
        raise ValueError("{} must be {} to {}; got {}".format(option, *limits))
    return value


def numbers(option, value):
    """The numbers of an option: text with commas, or a sequence."""
    words = value.split(",") if isinstance(value, str) else value if isinstance(value, (list, tuple, np.ndarray)) else [value]
    return [number(option, word) for word in words]


def _maxima(rows, kind):
    """Largest errors of one kind (column of the parts), without whole turns."""
    alpha, beta = (np.fmod(rows[name][:, kind], TURN) for name in PARTS[1:])
    return {"max_abs_e_rho_m": float(np.max(abs(rows["e_rho_m"][:, kind]))), "max_abs_e_alpha_rad": float(np.max(abs(alpha))),
            "max_abs_e_beta_rad": float(np.max(abs(beta))), "final_e_beta_rad": float(beta[-1])}


def _worst(rows, kind):
    """Largest differences from the measured errors, whole turns included."""
    return {name: float(np.max(abs(rows[name][:, kind] - rows[name][:, 0]))) for name in PARTS}


def summary(rows, singularities, example, loop, kappa, form, passes, update_s) -> dict:
    """The result of `tricoil motion --json`."""
    is_predicted = has_prediction(form, passes)
    result = {"example": example or "own rates", "loop": loop, "kappa": kappa, "form": form, "passes": passes, "update_s": update_s,
              "updates": len(rows) - 1, "measured": _maxima(rows, 0)}
    if is_predicted:
        result |= {"predicted": _maxima(rows, 1), "max_abs_predicted_minus_measured": _worst(rows, 1)}
    if form == "angles" and passes == 1:  # of the exact one-step expressions
        result |= {"exact_step": _maxima(rows, 2), "max_abs_exact_step_minus_measured": _worst(rows, 2)}
    result["max_position_error_m"] = float(rows["position_error_m"].max())
    if is_predicted:
        result["predicted_max_position_error_m"] = float(rows["predicted_position_error_m"].max())
    result["max_orientation_error_rad"] = float(rows["rotation_error_rad"].max())
    return result if singularities is None else result | {"singularities": singularities}


def text(r: dict) -> str:
    lines = [f"{r['example']}, {r['loop']} loop, {r['form']} form, {r['updates']} updates of {r['update_s']:.6f} s" +
             (f", {r['passes']} passes" if r["passes"] > 1 else "") +
             (f"; prediction with kappa {r['kappa']}" if "predicted" in r else "; no prediction for more than one pass of the angle form"),
             "                 max|e_rho| m   max|e_alpha| max|e_beta| rad   final e_beta"]
    for name, key in (("measured", "measured"), ("predicted", "predicted"), ("exact steps", "exact_step")):
        if key in r:
            lines.append(f"  {name:<12}" + "".join(f" {number_text(value, '>14.9f')}" for value in r[key].values()))
    if "predicted" in r:
        e_rho, e_alpha, e_beta = r["max_abs_predicted_minus_measured"].values()
        lines.append(f"predicted minus measured, at most: e_rho {e_rho:.2e} m, e_alpha {e_alpha:.2e} rad, e_beta {e_beta:.2e} rad")
    predicted = f" (predicted {1e3 * r['predicted_max_position_error_m']:.6g})" if "predicted" in r else ""
    lines.append(f"position error at most {1e3 * r['max_position_error_m']:.6g} mm{predicted}, "
                 f"orientation error at most {np.degrees(r['max_orientation_error_rad']):.6g} deg")
    if s := r.get("singularities"):
        lines.append(f"singular instants: {s['predicted']} predicted; {s['measured_jumps']} jumps of the azimuth error: {s['hits']} predicted, "
                     f"{s['missed']} missed, {s['false_alarms']} false alarms")
    return "\n".join(lines) + "\n"


def run(**options) -> tuple[dict, str]:
    """Result and text. Raises ValueError, OSError; also for options of a file that is not given."""
    for name in options:
        if name in RECORDED_OPTIONS and not {"poses", "trajectory"} & options.keys():
            raise ValueError(f"--{name.replace('_', '-')} requires --poses or --trajectory")
        if name in PLAN_OPTIONS and name != "rate_hz" and "plan" not in options:
            raise ValueError(f"--{name.replace('_', '-')} requires --plan")
    if FILES & options.keys():
        from . import _motion_command

        return _motion_command.run(**options)
    return run_example(**options)


def run_example(example="", loop="open", kappa="exact", form="angles", passes=1, start_range=0.5, start_time=0, rate_hz=240, gap=0, duration=10, out=None,
        smooth=False, **others) -> tuple[dict, str]:
    """Without a file. smooth has no effect here. others: A,B of RATES."""
    rates = {name: numbers(f"--{name}", others.pop(name)) for name in RATES if name in others}
    if others:
        raise ValueError(f"unknown option --{min(others).replace('_', '-')}")
    if any(len(rate) != 2 for rate in rates.values()):
        raise ValueError("a rate is two numbers, A,B")
    if not example and not rates:
        raise ValueError("motion needs --example I|II|III|orientation|IIIo or own rates: --azimuth, --elevation, --range, --attitude")
    start_range_m = checked("--start-range", start_range, 1e-3, 1e3)
    rate_hz = numbers("--rate-hz", rate_hz)
    if len(rate_hz) > 1:
        raise ValueError("--rate-hz A,B requires --poses or --trajectory; give one number")
    update_s = 1 / checked("--rate-hz", rate_hz[0], 1, 1e5) + checked("--gap", gap, 0, 1)
    passes = checked("--passes", passes, -2**31, 2**31 - 1)
    if passes != int(passes):
        raise ValueError(f"--passes must be a whole number; got {passes:g}")
    passes = int(passes)
    with bar("motion", None) as show:
        rows, singularities = simulated(example, rates, start_range_m, loop, form, kappa, "", passes, update_s, number("--duration", duration),
                                        checked("--start-time", start_time, 0, 1e9), progress=show)
    if out is not None:
        write_whole(out, error_csv(rows))
    result = summary(rows, singularities, example, loop, kappa, form, passes, update_s)
    return result, text(result)
