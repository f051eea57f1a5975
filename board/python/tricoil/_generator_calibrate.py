"""`tricoil generator calibrate`: coils of a generator from couplings at known poses."""

import os

from . import _generator_table as tables
from ._generator import MOST_COILS, to_toml
from ._generator_fit import RICH, fitted
from ._output_file import refuse_input_as_output, write_whole

MODELS = ("dipole", "full")
WORST = 0.02  # of a calibration; a larger residual comes from other coils, other poses or another order


def _equations(frames):
    return frames.couplings.size / max(1, frames.couplings.shape[1] * (frames.couplings.shape[1] + 6))


def run(files, out=None, model=None):
    """Result as `--json` prints it, and the generator. Raises ValueError, OSError."""
    if out is None:
        raise ValueError("--out FILE is needed, for the generator")
    if model not in (None, *MODELS):
        raise ValueError(f"--model must be {' or '.join(MODELS)}; is '{model}'")
    refuse_input_as_output({"--out": out}, files)
    frames = tables.read(files)
    where, count = os.fspath(files[0]), frames.couplings.shape[1]
    if count > MOST_COILS:
        raise ValueError(f"{where}: {count} coils; a generator has at most {MOST_COILS}")
    if frames.position_m is None or (frames.turn is None and frames.axis is None):
        raise ValueError(f"{where}: poses are needed: x_m, y_m, z_m, and nx, ny, nz of the coil or qw, qx, qy, qz of its body")
    tables.refuse_silent(frames.couplings, frames.names, frames.sigma, where)
    if not (abs(frames.couplings).max(axis=1) > 0).all():
        raise ValueError(f"{where}: all couplings of a row are zero: remove the row")
    if len(frames) < 12:
        raise ValueError(f"{where}: {len(frames)} rows; at least 12 poses are needed")
    chosen = model or ("full" if _equations(frames) >= RICH else "dipole")
    try:
        generator, residual = fitted(frames, chosen)
    except ValueError as error:
        raise ValueError(f"{where}: {error}") from None
    if residual > WORST:
        raise ValueError(f"{where}: {100 * residual:.1f} % of the couplings stay unexplained; are the poses those of the couplings, in the right units?")
    write_whole(out, to_toml(generator))
    return {"coils": count, "sensor_coils": len(generator.sensors), "rows": len(frames), "model": chosen, "residual": residual,
            "misfit": [{"coil": name, "share": share} for name, share in zip(generator.names, generator.misfit.tolist())], "left_handed_stage": generator.left_handed_stage,
            "gain": [{"sensor": number, "gain": sensor.gain} for number, sensor in generator.sensors.items()], "out": os.fspath(out)}, generator


def text(r: dict) -> str:
    """The result as lines."""
    lines = [f"{r['coils']} coils from {r['rows']} rows of {r['sensor_coils']} sensor coils; model {r['model']}; {100 * r['residual']:.3f} % of the couplings unexplained"]
    lines += [f"  {one['coil']:<14} {100 * one['share']:.3f} %" for one in r["misfit"]]
    if r["left_handed_stage"]:
        lines.append("  the stage counts angles in the left-handed sense")
    return "\n".join([*lines, f"written to {r['out']}"]) + "\n"
