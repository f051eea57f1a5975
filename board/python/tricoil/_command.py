"""Commands of the `tricoil` program."""

import importlib
import json
import os
import re
from collections.abc import Sequence
from typing import Any

from . import _tricoil
from ._program import NUMERICAL, is_numerical


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


# Commands in this package: the module whose run() gives the result, or a tuple of it and more, and the
# files that it takes: none, one, some (one or more) or all (any number).
MODULES = {"bench": ("_bench", "one"), "calibrate wiring": ("_wiring_command", "all"), "convert": ("_convert", "one"),
           "couplings": ("_couplings_command", "none"), "demodulate": ("_demodulate", "one"),
           "design": ("_design", "none"), "evaluate": ("_evaluate", "some"), "figures": ("_figures", "none"), "motion": ("_motion_example", "none"), "truth": ("_truth_command", "all"),
           "generator simulate": ("_generator_simulate", "none"), "generator solve": ("_generator_solve", "all"),
           "generator track": ("_generator_track", "all"), "generator calibrate": ("_generator_calibrate", "all"), "calibrate pivot": ("_pivot", "one"), "calibrate surroundings": ("_surroundings", "some"), "calibrate stage": ("_calibrate_stage", "some"),
           "calibrate converters": ("_calibrate_converters", "some"), "calibrate grid": ("_calibrate_grid", "some"),
           "calibrate free-motion": ("_calibrate_free_motion", "some"), "calibrate low-band": ("_low_band", "some"),
           "calibrate pick-up": ("_pick_up", "some"), "plot": ("_plot_command", "one"), "protocol": ("_protocol", "none")}
WITH_CALIBRATION = ("evaluate", *(f"calibrate {kind}" for kind in ("stage", "converters", "grid", "free-motion", "low-band", "pick-up", "surroundings")))  # a wheel's extension module is built without it
NEEDED = {"demodulate": "carrier_hz", "figures": "out"}


def in_python(name, arguments, options) -> bool:
    """True for a command, or a kind of it, that the program hands over to this package."""
    if name == "convert":
        return len(arguments) == 1 and (os.path.isfile(arguments[0]) or options.get("to") in ("mat", "mcap", "rests"))
    return name in MODULES and (name not in WITH_CALIBRATION or hasattr(_tricoil, "Bands"))  # without it the program says so


def of_python(name, arguments, options) -> Any:
    """The result of such a command. Raises ValueError with the program's names of the options, and TypeError."""
    module_name, files = MODULES[name]
    needed = NEEDED.get(name)
    if files == "some" and not arguments:
        raise ValueError(f"{name} needs files")
    if (files in ("one", "none") and len(arguments) != (files == "one")) or (needed and needed not in options):
        raise ValueError(f"{name} takes {'one file' if files == 'one' else 'no files'}" + (f", and {needed}" if needed else ""))
    if name == "convert" and options.get("out", "-") == "-":
        raise ValueError("convert: the poses need a file; add out")
    module = importlib.import_module(f".{module_name}", __package__)
    if name == "calibrate pivot":
        return module.of_file(os.fspath(arguments[0]), options.pop("sensor", None), os.fspath(options.pop("out", "")), **options)
    if name == "plot":
        out = options.pop("out", None)
        stages = {key: value for key, value in options.items() if value is not False}
        return module.run(os.fspath(arguments[0]), _words(stages), None if out is None else os.fspath(out), stages)
    if name == "evaluate":
        result = module.run(arguments, **options)[0]
        module.draw(**options)
        return result
    result = module.run(*((arguments,) if files in ("all", "some") else map(os.fspath, arguments)), **options)
    return result[0] if isinstance(result, tuple) else result


OLD_KINDS = ("surroundings", "grid", "free_motion", "low_band", "pivot", "wiring", "converters")


def _kind_of(arguments, options) -> str:
    """The kind of `calibrate` in the last version's spelling, an option, which the program replaces with a notice; its option is removed."""
    given = ["calibrate", *_words(options), "--", *map(os.fspath, arguments)]
    renewed = _tricoil.renew_calibrate(given)
    if renewed == given:
        return "calibrate"
    for old in OLD_KINDS:
        value = options.pop(old, None)
        if old == "wiring" and value is not None:
            options["at"] = value
    return f"calibrate {renewed[1]}"


def _of_type(message):
    """What a TypeError says of the options."""
    option = re.search(r"(unexpected keyword argument|missing) .*?'?(\w+)'?$", message)
    if option:
        return f"needs {option[2]}" if option[1] == "missing" else f"unknown option {option[2]}"
    return f"an argument has the wrong type ({message})"


def command(name: str, *arguments: str | os.PathLike, **options: Any) -> Any:
    """Result of a command of the program, as `tricoil NAME ... --json` prints it.

    name: also with a subcommand, for example "calibrate grid". arguments: files and other words. options: as in `tricoil NAME --help`, with _ for -; True for an option without value.
    Example: command("evaluate", "poses.csv", calibration="coils.toml", refit_fixtures=True). A failed check raises no error; the
    result says so. Files are written as the program writes them. Ctrl-C raises KeyboardInterrupt.
    """
    words = name.split()
    if not words or any(word.startswith("-") for word in words):
        raise ValueError(f"{name!r}: is no command; options are arguments of their own, for example json=True")
    own = 2 if words[0] in ("calibrate", "device", "generator") else 1
    name, arguments = " ".join(words[:own]), (*words[own:], *arguments)
    if "help" in options:
        raise ValueError(f"help: see `tricoil {name} --help`")
    if name == "evaluate" and options.get("dynamic"):
        return evaluate(arguments, **options)
    if name == "calibrate" and hasattr(_tricoil, "renew_calibrate"):
        name = _kind_of(arguments, options)
    if in_python(name, arguments, options):
        try:
            return of_python(name, arguments, {key: value for key, value in options.items() if value is not None and value is not False and key != "json"})
        except TypeError as error:
            raise ValueError(f"{name}: {_of_type(str(error))}") from None
        except ValueError as error:
            raise ValueError(own_names(str(error))) from None
        except Exception as error:
            if not is_numerical(error):
                raise
            raise ValueError(NUMERICAL.format(error)) from None
    words = [*name.split(), *_words(options), "--json", "--", *map(os.fspath, arguments)]
    try:
        _, text = _tricoil.command(words if arguments else words[:-1])
    except ValueError as error:
        raise ValueError(own_names(str(error))) from None
    return json.loads(text)


def calibrate(files: Sequence[str | os.PathLike], out: str | os.PathLike, kind: str = "stage", **options: Any) -> dict:
    """Calibrates coils and fixtures from measured couplings, and writes the calibration to the TOML file `out`.

    kind: "stage", "converters", "grid", "free-motion", "surroundings", "low-band" or "pick-up". files: couplings as that kind reads them. options: those
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
    except ValueError as error:
        raise ValueError(own_names(str(error))) from None
