"""Runs a command of the program `tricoil` in Python. The program starts it from libexec/tricoil, with /usr/bin/python3 -I:

_program.py COMMAND --OPTION=VALUE... -- FILE...

The program has checked the names of the options. The package is that of the same installation or build folder, or the system's.
"""

import errno
import importlib
import importlib.util
import json
import os
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
    """Options by name, with _ for -, and files."""
    end = arguments.index("--")
    options = {}
    for word in arguments[:end]:
        name, has_value, value = word[2:].partition("=")
        options[name.replace("-", "_")] = value if has_value else True
    return options, arguments[end + 1:]


def find_package():
    """Puts the package of this installation or build folder first; -I has left the user's folders out."""
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


def put_result(result, as_json, text, file=sys.stdout):
    put(json.dumps(result, indent=2, allow_nan=False, ensure_ascii=False) + "\n" if as_json else text, file)


def evaluate(options, files):
    from tricoil import _dynamic

    as_json = options.pop("json", False)
    options.pop("dynamic", None)
    options.pop("solver", None)
    result = _dynamic.evaluate(files, **options)
    put_result(result, as_json, _dynamic.text(result))


def motion(options, files):
    from tricoil import _motion_command

    as_json = options.pop("json", False)
    result, text = _motion_command.run(**options)
    if options.get("out") != "-":
        put_result(result, as_json, text)


def demodulate(options, files):
    from tricoil import _demodulate

    as_json = options.pop("json", False)
    result, _ = _demodulate.run(files[0], **options)
    put_result(result, as_json, _demodulate.text(result), sys.stderr if options.get("out") == "-" else sys.stdout)
    if not result["sensor_present"]:
        put(f"tricoil: {files[0]}: {result['verdict']}\n", sys.stderr)
        sys.exit(1)


def truth(options, files):
    from tricoil import _truth_command

    as_json = options.pop("json", False)
    result, _ = _truth_command.run(files, **options)
    put_result(result, as_json, _truth_command.text(result), sys.stderr if options.get("out") == "-" else sys.stdout)


COMMANDS = {"demodulate": demodulate, "evaluate": evaluate, "motion": motion, "truth": truth}


def main():
    name = sys.argv[1]
    # Of matplotlib: its list of fonts is kept where it is for every program; no folder of settings is read or made.
    os.environ["MPLCONFIGDIR"] = os.path.join(os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache"), "matplotlib")
    for module in ("numpy", "scipy"):
        if importlib.util.find_spec(module) is None:
            refuse(f"{name}: needs NumPy and SciPy: install the packages python3-numpy and python3-scipy", 3)
    find_package()
    try:
        importlib.import_module("tricoil")
    except ImportError as error:
        refuse(f"{name}: needs the Python package of tricoil ({error}): install the package python3-tricoil", 3)
    try:
        COMMANDS[name](*words_of(sys.argv[2:]))
    except ValueError as error:
        refuse(error)
    except BrokenPipeError:
        os._exit(128 + 13)
    except OSError as error:
        refuse(f"{error.filename}: {error.strerror}" if error.filename else error, 2 if isinstance(error, (FileNotFoundError, PermissionError)) else 3)
    except MemoryError:
        refuse("out of memory; the input is too large for this machine", 3)
    except KeyboardInterrupt:
        refuse("interrupted; nothing was written", 130)


if __name__ == "__main__":
    main()
