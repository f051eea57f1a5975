"""Commands of the `tricoil` program."""

import json
import os
import re
from collections.abc import Sequence
from typing import Any

from . import _tricoil


def own_names(message: str, names: dict[str, str] | None = None) -> str:
    """Replaces option names in messages of the program by argument names: --rate-hz becomes rate_hz. names: arguments whose names differ."""
    names = {"--help": "--help", **(names or {})}
    return re.sub(r"--[a-z-]*[a-z]", lambda m: names.get(m[0], m[0][2:].replace("-", "_")), message)


def _words(options: dict[str, Any]) -> list[str]:
    """{"model": "finite", "json": True, "hemisphere": (1, 0, 0)} as --model finite --json --hemisphere 1,0,0."""
    words = []
    for name, value in options.items():
        option = "--" + name.replace("_", "-")
        if value is True:
            words.append(option)
        elif value is not None and value is not False:
            values = value.tolist() if hasattr(value, "tolist") else value
            if isinstance(values, (list, tuple)) and values and all(isinstance(v, str) for v in values):
                words += [word for v in values for word in (option, v)]  # a repeatable option
            else:
                words += [option, ",".join(map(str, values)) if isinstance(values, (list, tuple)) else str(values)]
    return words


def command(name: str, *arguments: str | os.PathLike, **options: Any) -> Any:
    """Result of a command of the program, as `tricoil NAME ... --json` prints it.

    name: also with a subcommand, for example "calibrate grid". arguments: files and other words. options: as in `tricoil NAME --help`, with _ for -; True for an option without value.
    Example: command("evaluate", "poses.csv", calibration="coils.toml", refit_fixtures=True). A failed check raises no error; the
    result says so. Files are written as the program writes them. Ctrl-C raises KeyboardInterrupt.
    """
    if "help" in options:
        raise ValueError(f"help: see `tricoil {name} --help`")
    if name == "evaluate" and options.get("dynamic"):
        return evaluate(arguments, **options)
    if name == "motion" and {"poses", "trajectory"} & options.keys():
        from . import _motion_command

        try:
            return _motion_command.run(**options)[0]
        except _motion_command.PoseError as error:
            raise ValueError(own_names(str(error))) from None
    if name == "truth":
        from . import _truth_command

        try:
            return _truth_command.run(arguments, **{key: value for key, value in options.items() if value is not None})[0]
        except _truth_command.PoseError as error:
            raise ValueError(own_names(str(error))) from None
    if name == "demodulate":
        from . import _demodulate

        if len(arguments) != 1 or "carrier_hz" not in options:
            raise ValueError("demodulate takes one capture, and carrier_hz")
        try:
            return _demodulate.run(*arguments, **{key: value for key, value in options.items() if value is not None})[0]
        except ValueError as error:
            raise ValueError(own_names(str(error))) from None
    words = [*name.split(), *_words(options), "--json", "--", *(os.fspath(argument) for argument in arguments)]
    try:
        _, text = _tricoil.command(words if arguments else words[:-1])
    except ValueError as error:
        raise ValueError(own_names(str(error))) from None
    return json.loads(text)


def calibrate(files: Sequence[str | os.PathLike], out: str | os.PathLike, kind: str = "stage", **options: Any) -> dict:
    """Calibrates coils and fixtures from measured couplings, and writes the calibration to the TOML file `out`.

    kind: "stage", "converters", "grid", "free-motion", "surroundings" or "low-band". files: couplings as that kind reads them. options: those
    of `tricoil calibrate KIND`, for example model="finite", or spacing_mm=50 with a grid. Returns parameters with their standard deviations,
    residuals and warnings.
    """
    if kind == "stage" and options.keys() & {"grid", "free_motion", "surroundings", "low_band", "converters"}:
        kind = ""  # the last version's spelling, which the program replaces with a notice
    return command(f"calibrate {kind}", *files, out=os.fspath(out), **options)


def evaluate(files: Sequence[str | os.PathLike], calibration: str | os.PathLike | None = None, *, dynamic: bool = False, **options: Any) -> dict:
    """Pose errors of a tracker against ground truth: the result of `tricoil evaluate`.

    files: couplings at stage poses, for the tracker of `calibration`, with the options of `tricoil evaluate`, for example refit_fixtures=True;
    with dynamic=True recorded poses: (reference, tracker), with the options of `tricoil evaluate --dynamic`, see verify().
    """
    if not dynamic:
        return command("evaluate", *files, calibration=os.fspath(calibration) if calibration is not None else None, **options)
    if calibration is not None:
        raise ValueError("dynamic takes two files, the reference and the poses, and no calibration")
    from . import _dynamic

    try:
        return _dynamic.evaluate(files, **options)
    except _dynamic.PoseError as error:
        raise ValueError(own_names(str(error))) from None
