"""What the kinds of `tricoil calibrate` share: their files, numbers in options, and the end of their texts."""

import os

import numpy as np

from . import _tricoil
from ._number_text import number_text


def files_of(data, out, blob=None, calibration=None, converters_from=None, wiring=None):
    """Files of one calibration, whose names may be any bytes.

    calibration: of the coils, for the kinds that add to it. converters_from: calibration whose errors of the converters are kept.
    """
    return _tricoil.CalibrationFiles([os.fsencode(file) for file in data],
                                     *("" if path is None else os.fsencode(path) for path in (calibration, converters_from, out, blob, wiring)))


def number(option: str, value) -> float | None:
    """A number of the program or of Python; None: not given. Raises ValueError."""
    try:
        return None if value is None else float(value)
    except (TypeError, ValueError):
        raise ValueError(f"--{option} needs a number; got {value}") from None


def numbers(option: str, value, count: int, kind: type) -> list | None:
    """A list of the program, or a sequence; None: not given. Raises ValueError."""
    if value is None:
        return None
    try:
        found = [kind(one) for one in (value.split(",") if isinstance(value, str) else value)]
    except (TypeError, ValueError):
        found = []
    if len(found) != count or not np.all(np.isfinite(found)):
        raise ValueError(f"--{option} needs {count} {'whole ' if kind is int else ''}numbers; got {value}")
    return found


def node_counts(value) -> list | None:
    """Columns, rows and levels of a grid; None: not given. Raises ValueError."""
    counts = numbers("nodes", value, 3, int)
    if counts is not None and not 1 <= min(counts) <= max(counts) <= 1000:
        raise ValueError(f"--nodes must be 1 to 1000; got {','.join(map(str, counts))}")
    return counts


def half_space(value) -> list | None:
    """Direction to the half space of most positions, source frame; None: not given. Raises ValueError."""
    try:
        towards = numbers("hemisphere", value, 3, float)
        if towards is None or 0 < sum(one * one for one in towards) < float("inf"):
            return towards
    except ValueError:
        pass
    raise ValueError("--hemisphere must be a direction: three finite numbers, not all zero")


def percent(share: float, form: str = ".3f") -> str:
    return number_text(100 * share, form) + " %"


def mm(length_m: float, form: str) -> str:
    return number_text(1e3 * length_m, form) + " mm"


def parameters_text(parameters: list[dict]) -> str:
    return "".join(f"  {p['name']:<24} {number_text(p['value'], '>12.6f')} +- {number_text(p['deviation'], '.6f')}\n" for p in parameters)


def end_text(r: dict) -> str:
    """Last lines of the text of a calibration that was written."""
    text = ""
    if "pick_up" in r:
        text += f"  pick-up {percent(r['pick_up']['share_rms'])} +- {percent(r['pick_up']['sigma'])} RMS of k at 0.75 m, removed by trackers\n"
    if "quadrature_floor" in r:
        text += f"  quadrature of the couplings, expected by trackers: {percent(r['quadrature_floor'])} per coupling\n"
    return text + "".join(f"warning: {warning}\n" for warning in r["warnings"]) + f"wrote {r['out']}\n"
