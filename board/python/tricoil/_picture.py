"""Pictures that commands write for --plot and the like."""

import importlib.util
import io
import os

from ._poses import PoseError

PICTURES = (".svg", ".png", ".pdf")


def check_picture(name, option: str = "--plot", endings=PICTURES) -> None:
    """Before the work. name: of the file, or None. Raises PoseError."""
    if name is None:
        return
    if os.path.splitext(name)[1] not in endings:
        raise PoseError(f"{option} must end in {', '.join(endings)}; is '{name}'")
    if importlib.util.find_spec("matplotlib") is None:
        raise PoseError(f"{option} needs matplotlib: install the package python3-matplotlib")


def picture(name, figure) -> bytes:
    """A figure of matplotlib in the format of the file's name."""
    content = io.BytesIO()
    figure.savefig(content, format=os.path.splitext(name)[1][1:])
    return content.getvalue()
