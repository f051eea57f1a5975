"""Runs a command of the program `tricoil` in Python. The program starts it from libexec/tricoil, with /usr/bin/python3 -I:

_program.py COMMAND --OPTION=VALUE... -- FILE...

The program has checked the names of the options. The package is that of the same installation or build folder, or the system's.
"""

import errno
import importlib
import importlib.util
import json
import os
import signal
import sys


def visible(text):
    """The text with control characters escaped."""
    return "".join(c if c in "\n\t" or c.isprintable() else f"\\x{ord(c):02x}" for c in text)


def refuse(message, code=2):
    """Ends the program with one line. What standard output still holds could not be written, and is not tried again."""
    try:
        if sys.stderr is not None:
            print(visible(f"tricoil: {' '.join(str(message).splitlines())}"), file=sys.stderr, flush=True)
    except OSError:  # nobody can be told; the exit status stays
        pass
    os._exit(code)


def words_of(arguments):
    """Options by name, with _ for -, and files. An option that is given several times has a list."""
    end = arguments.index("--")
    options = {}
    for word in arguments[:end]:
        name, has_value, value = word[2:].partition("=")
        key = name.replace("-", "_")
        value = value if has_value else True
        options[key] = value if key not in options else [*(options[key] if isinstance(options[key], list) else [options[key]]), value]
    return options, arguments[end + 1:]


def find_package():
    """Puts the package of this file, installation or build folder first; -I has left the user's folders out."""
    own = os.path.dirname(os.path.abspath(__file__))
    if os.path.isfile(os.path.join(own, "_dynamic.py")):
        sys.path.insert(0, os.path.dirname(own))
        return
    prefix = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
    for folder in ("lib/python3/dist-packages", "board/python"):
        if os.path.isfile(os.path.join(prefix, folder, "tricoil", "_dynamic.py")):
            sys.path.insert(0, os.path.join(prefix, folder))
            return


def put(text, file=sys.stdout):
    """Prints, with control characters escaped; a failed write ends the program once, with one line."""
    try:
        if file is None:  # the program was started without it
            raise OSError(errno.EBADF, "it is closed")
        file.write(visible(text))
        file.flush()
    except BrokenPipeError:
        raise
    except OSError as error:
        refuse(f"standard output could not be written completely ({error.strerror}); is the disk full?", 3)


def put_result(result, as_json, text, out=None):
    """out: file of the command's own output; "-" is the standard output."""
    put(json.dumps(result, indent=2, allow_nan=False, ensure_ascii=False) + "\n" if as_json else text, sys.stderr if out == "-" else sys.stdout)


def put_written(as_json, *outputs):
    """Names the files that were written, after the text of a result."""
    named = [os.fspath(one) for one in outputs if one not in (None, "-")]
    if named and not as_json:
        put(f"wrote {', '.join(named)}\n")


def evaluate(options, files):
    as_json = options.pop("json", False)
    if options.pop("dynamic", False):
        evaluate_dynamic(options, files, as_json)
        return
    from tricoil import _evaluate

    result, text, places = _evaluate.run(files, **options)
    put_result(result, as_json, text)
    if places:
        put(f"tricoil: {result['poses_not_converged']} poses did not converge and are not in the table: {places}\n", sys.stderr)
    _evaluate.draw(**options)
    sys.exit(1 if places else 0)


def evaluate_dynamic(options, files, as_json):
    from tricoil import _dynamic

    if len(files) != 2 or {"calibration", "refit_fixtures", "stage_from", "fixture", "wiring"} & options.keys():
        raise ValueError("--dynamic takes two files, TRUTH and POSES, no calibration and no wiring")
    options.pop("solver", None)
    result = _dynamic.evaluate(files, **options)
    put_result(result, as_json, _dynamic.text(result))
    put_written(as_json, options.get("out"))


def motion(options, files):
    from tricoil import _motion_example

    as_json = options.pop("json", False)
    result, text = _motion_example.run(**options)
    if not _motion_example.FILES & options.keys():
        put_result(result, as_json, text, options.get("out"))
    elif "-" not in (options.get("out"), options.get("plan")):
        put_result(result, as_json, text)
        put_written(as_json, options.get("out"), options.get("plot"), options.get("plan"))


def couplings(options, _):
    from tricoil import _couplings_command

    as_json = options.pop("json", False)
    result = _couplings_command.run(**options)
    put_result(result, as_json, _couplings_command.text(result), options["out"])
    if not result["rows_valid"]:
        sys.exit(1)


def demodulate(options, files):
    from tricoil import _demodulate

    as_json = options.pop("json", False)
    result, _ = _demodulate.run(files[0], **options)
    put_result(result, as_json, _demodulate.text(result), options.get("out"))
    if not result["sensor_present"]:
        put(f"tricoil: {files[0]}: {result['verdict']}\n", sys.stderr)
        sys.exit(1)


def bench(options, files):
    from tricoil import _bench

    as_json = options.pop("json", False)
    result, text = _bench.run(files[0], **options)
    put_result(result, as_json, text, options.get("out"))


def truth(options, files):
    from tricoil import _truth_command

    as_json = options.pop("json", False)
    result, _ = _truth_command.run(files, **options)
    put_result(result, as_json, _truth_command.text(result), options.get("out"))


def convert(options, files):
    from tricoil import _convert

    as_json = options.pop("json", False)
    is_printed = options.get("out", "-") == "-"
    if as_json and is_printed:
        refuse("--json: the poses need a file; add --out FILE")
    result = _convert.run(files[0], **options)
    if not is_printed:
        put_result(result, as_json, _convert.text(result))


def figures(options, files):
    from tricoil import _figures

    as_json = options.pop("json", False)
    result = _figures.run(**options)
    put_result(result, as_json, _figures.text(result))


def wiring(options, files):
    from tricoil import _wiring_command

    as_json = options.pop("json", False)
    result = _wiring_command.run(files, **options)
    put_result(result, as_json, _wiring_command.text(result))
    reason = _wiring_command.reason(result, options.get("out"))
    if reason:
        put(f"tricoil: {reason} (exit code 1)\n", sys.stderr)
        sys.exit(1)


def of_generator(name):
    """simulate, solve, track or calibrate of `tricoil generator`."""
    def run(options, files):
        module = importlib.import_module(f"tricoil._generator_{name}")
        as_json = options.pop("json", False)
        result, _ = module.run(*([files] if name != "simulate" else []), **options)
        put_result(result, as_json, module.text(result), options.get("out"))
        good = {"solve": "solved", "track": "valid"}.get(name)
        if good and not result[good]:
            put(f"tricoil: no pose is {good} (exit code 1)\n", sys.stderr)
            sys.exit(1)
    return run


def design(options, files):
    from tricoil import _design

    as_json = options.pop("json", False)
    result, text = _design.run(**options)
    put_result(result, as_json, text)


def pivot(options, files):
    from tricoil import _pivot

    as_json = options.pop("json", False)
    result = _pivot.of_file(files[0], options.get("sensor"), options.get("out", ""))
    put_result(result, as_json, _pivot.text(result), options.get("out"))


def of_calibrate(module_name):
    """A kind of `tricoil calibrate`."""
    def run(options, files):
        module = importlib.import_module(f"tricoil.{module_name}")
        as_json = options.pop("json", False)
        result, text = module.run(files, **options)
        put_result(result, as_json, text, options["out"])
    return run


def plot(options, files):
    from tricoil import _plot_command
    from tricoil._command import _words

    as_json = options.pop("json", False)
    out = options.pop("out", None)
    result = _plot_command.run(files[0], _words(options), out, options)
    put_result(result, as_json, _plot_command.text(result), out)


def protocol(options, _):
    from tricoil import _protocol

    as_json = options.pop("json", False)
    result, text = _protocol.run(**options)
    put_result(result, as_json, text, "-" if "-" in options.values() else None)


def table(_, files):
    """The text of a file of arrays, which the program reads as a table."""
    from tricoil._array_file import table_of

    with open(files[0], "rb") as file:
        sys.stdout.buffer.write(table_of(file.read(), files[0]))
        sys.stdout.buffer.flush()


COMMANDS = {"bench": bench, "convert": convert, "couplings": couplings, "demodulate": demodulate, "design": design, "evaluate": evaluate,
            "figures": figures, "motion": motion, "pivot": pivot, "plot": plot, "protocol": protocol, "table": table, "truth": truth,
            "wiring": wiring, **{name.replace("_", "-"): of_calibrate(f"_{name}") for name in ("low_band", "pick_up", "surroundings")},
            **{name.replace("_", "-"): of_calibrate(f"_calibrate_{name}") for name in ("stage", "converters", "grid", "free_motion")},
            **{name: of_generator(name) for name in ("simulate", "solve", "track", "calibrate")}}
WITHOUT_SCIPY = ("converters", "evaluate", "figures", "free-motion", "grid", "low-band", "motion", "pick-up", "plot", "protocol", "stage", "table")


class Interrupted(KeyboardInterrupt):
    """A signal that ends the program after it has removed what it has not finished."""


def interrupt(number, _):
    raise Interrupted(number)


# Of NumPy's LinAlgError, which is no ValueError in every version, too.
NUMERICAL = "the calculation fails with these numbers ({}); correct the size or the unit of the values in the input"


def is_numerical(error):
    return isinstance(error, ArithmeticError) or type(error).__name__ == "LinAlgError"


def start(name, words):
    # Of matplotlib: its list of fonts is kept where it is for every program; no folder of settings is read or made.
    os.environ["MPLCONFIGDIR"] = os.path.join(os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache"), "matplotlib")
    options, files = words_of(words)
    is_light = name in WITHOUT_SCIPY and not {"dynamic", "poses", "trajectory", "plan"} & options.keys()
    needed = ("NumPy",) if is_light else ("NumPy", "SciPy")
    if any(importlib.util.find_spec(module.lower()) is None for module in needed):
        packages = " and ".join(f"python3-{module.lower()}" for module in needed)
        refuse(f"{name}: needs {' and '.join(needed)}: install the package{'s' * (len(needed) > 1)} {packages}", 3)
    find_package()
    try:
        importlib.import_module("tricoil")
    except ImportError as error:
        refuse(f"{name}: needs the Python package of tricoil ({error}): install the package python3-tricoil, or pybind11-dev before a build", 3)
    COMMANDS[name](options, files)


def main():
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        if signal.getsignal(number) != signal.SIG_IGN:
            signal.signal(number, interrupt)
    try:
        start(sys.argv[1], sys.argv[2:])
    except ValueError as error:
        refuse(error)
    except BrokenPipeError:
        os._exit(128 + 13)
    except OSError as error:
        refuse(f"{error.filename}: {error.strerror}" if error.filename else error, 2 if isinstance(error, (FileNotFoundError, PermissionError)) else 3)
    except MemoryError:
        refuse("out of memory; the input is too large for this machine", 3)
    except Exception as error:
        if not is_numerical(error):
            raise
        refuse(NUMERICAL.format(error))
    except KeyboardInterrupt as error:
        refuse("interrupted; nothing was written", 128 + (error.args or (signal.SIGINT,))[0])


if __name__ == "__main__":
    main()
