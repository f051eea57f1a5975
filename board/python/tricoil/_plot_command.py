"""tricoil plot: a picture of the poses of a recording or a table."""

import os
import tempfile

import numpy as np

from . import _plot_table, _tricoil
from ._drawing import draw
from ._output_file import OutputFile, refuse_input_as_output

PICTURES = (".svg", ".png")
WITHOUT_ANGLES = ("boresight", "euler")


def run(poses, words, out=None, stages=()) -> dict:
    """The result of `tricoil plot --json`. stages: names of the given options of stages; words: these options for `tricoil convert`. Raises
    ValueError, OSError."""
    if out is None:
        out = os.path.splitext(os.path.basename(os.path.normpath(poses)))[0] + ".svg"
    extension = ".svg" if out == "-" else os.path.splitext(out)[1]
    if extension not in PICTURES:
        raise ValueError(f"--out {out}: must end with .svg or .png")
    refuse_input_as_output({"--out": out}, [poses])
    is_recording = os.path.isdir(poses)
    if not is_recording and not os.access(poses, os.R_OK):
        raise ValueError(f"{poses}: cannot be opened; check the path and its permissions")
    for name in stages:
        if not is_recording:
            raise ValueError(f"--{name.replace('_', '-')}: no output for its poses; a table is drawn as it is: give the folder of a recording")
        if name in WITHOUT_ANGLES:
            raise ValueError(f"--{name}: a picture has no angles; use --{name} of tricoil convert")
    with tempfile.TemporaryDirectory(prefix="tricoil-plot-") as folder:
        table = poses
        if is_recording:
            table = os.path.join(folder, "poses.csv")
            _tricoil.command(["convert", *words, "--to", "csv", "--out", table, "--json", "--", poses])
        picture = f"poses{extension}"
        unit, rows = _plot_table.read(table, len(_tricoil.FLAG_NAMES))
        np.save(os.path.join(folder, "poses.npy"), rows)
        draw(folder, [picture, unit, ",".join(_tricoil.FLAG_NAMES)])
        with open(os.path.join(folder, picture), "rb") as file:
            content = file.read()
    with OutputFile(out) as file:
        file.write(content)
        file.commit()
    return {"poses": len(rows), "out": out}


def text(result: dict) -> str:
    return f"{result['out']}: {result['poses']} poses\n"
