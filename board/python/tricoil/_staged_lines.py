"""Poses of a recording as JSON lines, after the stages of `tricoil convert`."""

import contextlib
import os
import tempfile
from collections.abc import Iterator

from . import _tricoil
from ._output_file import refuse_input_as_output
from ._poses import refuse_others

INTEGERS = ("sensor", "sequence", "time_us", "valid", "flags", "state")  # keys of the lines; other numbers are real
STAGES = ("tip", "relative_to", "align", "boresight")


@contextlib.contextmanager
def staged_lines(folder: str, out: str, options: dict, form: str) -> Iterator[tuple[str, str]]:
    """Paths of the lines without units and angles, m, and of those with all options; they are removed in the end.

    form: jsonl or full. out: the output file, which must not be one of the recording. Raises ValueError as the program does."""
    from ._command import _words

    refuse_others(options, (*STAGES, "units", "euler"), "only of a file of poses")
    refuse_input_as_output({"--out": out}, [folder])
    if out != "-" and os.path.realpath(out).startswith(os.path.join(os.path.realpath(folder), "")):
        raise ValueError(f"{out}: lies in the folder of the recording; choose another --out")
    stages = {name: options[name] for name in STAGES if name in options}
    with tempfile.TemporaryDirectory() as place:
        paths = [os.path.join(place, name) for name in ("poses", "shown")[:1 + (stages != options)]]
        for path, given in zip(paths, (stages, options)):
            _tricoil.command(["convert", *_words(given), "--to", form, "--out", path, "--json", "--", folder])
        yield paths[0], paths[-1]
