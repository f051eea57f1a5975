"""Runs the netlists of board/nucleo_g474re/circuits in ngspice, with single values overridden."""
import math
import os
import re
import shutil
import subprocess
import tempfile

CIRCUITS = os.path.realpath(os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "board", "nucleo_g474re", "circuits"))
SUFFIX = {"f": 1e-15, "p": 1e-12, "n": 1e-9, "u": 1e-6, "m": 1e-3, "k": 1e3, "meg": 1e6, "": 1.0}


def number(text):
    """Value of '4.7k', '10meg', '390p'."""
    match = re.fullmatch(r"([-+0-9.e]+?)(f|p|n|u|m|k|meg|)", text)
    if match is None:
        raise ValueError(f"not a number: {text}")
    return float(match.group(1)) * SUFFIX[match.group(2)]


def _parameter(name):
    return re.compile(rf"^(\.param\b.*?[ ]){name}=(\S+)", re.M)


def netlists():
    """Text of every netlist by file name."""
    texts = {}
    for file in sorted(os.listdir(CIRCUITS)):
        if file.endswith((".cir", ".lib")):
            with open(os.path.join(CIRCUITS, file)) as handle:
                texts[file] = handle.read()
    return texts


def text(file, name):
    """Text of a parameter of a netlist, like '4.7k'."""
    match = _parameter(name).search(netlists()[file])
    if match is None:
        raise KeyError(f"{file} has no parameter {name}")
    return match.group(2)


def value(file, name):
    """Value of a parameter of a netlist."""
    return number(text(file, name))


def readable(file, name, unit):
    """Value of a part for people: '8.06 kohm'."""
    digits, prefix = re.fullmatch(r"([0-9.]+)(meg|[pnumk]?)", text(file, name)).groups()
    return f"{digits} {'M' if prefix == 'meg' else prefix}{unit}".strip()


def has(file, name):
    return _parameter(name).search(netlists()[file]) is not None


def put(file, name, new):
    """Writes a value with three digits into a netlist."""
    netlist = netlists()[file]
    suffix, scale = next((s, f) for s, f in (("", 1.0), ("m", 1e-3), ("u", 1e-6), ("n", 1e-9)) if abs(new) >= 0.1 * f)
    changed = _parameter(name).sub(rf"\g<1>{name}={new / scale:.3g}{suffix}", netlist, count=1)
    if changed != netlist:
        with open(os.path.join(CIRCUITS, file), "w") as handle:
            handle.write(changed)


def run(bench, **overrides):
    """Runs a bench; returns its printed results, name to value. An override must name a parameter of the bench or of an included circuit."""
    with tempfile.TemporaryDirectory() as folder:
        return _run_in(folder, bench, overrides)


def run_vectors(bench, **overrides):
    """Rows (time, values...) of the output file of a bench."""
    with tempfile.TemporaryDirectory() as folder:
        _run_in(folder, bench, overrides)
        written = [name for name in os.listdir(folder) if name.endswith(".txt")]
        if len(written) != 1:
            raise RuntimeError(f"{bench} must write one .txt file, but wrote {written}")
        rows = []
        with open(os.path.join(folder, written[0])) as file:
            for line in file:
                fields = [float(field) for field in line.split()]
                rows.append([fields[0], *fields[1::2]])
        return rows


def _run_in(folder, bench, overrides):
    texts = netlists()
    used = [bench, *re.findall(r"^\.include (\S+)", texts[bench], re.M)]
    for name, new in overrides.items():
        holders = [file for file in used if _parameter(name).search(texts[file])]
        if len(holders) != 1:
            raise KeyError(f"{bench}: {len(holders)} files have the parameter {name}")
        texts[holders[0]] = _parameter(name).sub(rf"\g<1>{name}={new}", texts[holders[0]], count=1)
    for file, text in texts.items():
        with open(os.path.join(folder, file), "w") as handle:
            handle.write(text)
    if shutil.which("ngspice") is None:
        raise RuntimeError("ngspice is missing: toolchain/install-deps test")
    done = subprocess.run(["ngspice", "-b", bench], cwd=folder, capture_output=True, text=True, timeout=300)
    output = done.stdout + done.stderr
    if done.returncode != 0 or re.search(r"^Error(?!: measure .* out of interval)", output, re.M):
        raise RuntimeError(f"{bench} with {overrides}: ngspice fails:\n{output[-2000:]}")
    results = {name: float(result) for name, result in re.findall(r"^(\w+)\s*=\s*([-+0-9.eE]+)", output, re.M)}
    never = re.findall(r"meas \w+ (\w+) .*failed!", output)  # the event did not occur
    return {**results, **{name: math.nan for name in never}}
