"""Pictures that _draw.py draws, in another process, from the CSV files of a folder."""

import os
import subprocess
import sys

from ._staged_folder import StagedFolder


def draw(folder, words):
    """Draws in a folder. words: the pictures, and what else _draw.py takes. Raises ValueError if Python cannot draw."""
    program = os.path.join(os.path.dirname(os.path.abspath(__file__)), "_draw.py")
    drawn = subprocess.run([sys.executable, "-I", program, *words], cwd=folder, capture_output=True, text=True, check=False)
    if drawn.returncode != 0:
        message = (drawn.stderr.strip().splitlines() or [f"python3 ended with {drawn.returncode}"])[-1]
        raise ValueError(message if drawn.returncode in (2, 3) else f"python3 cannot draw: {message}")


def draw_and_publish(staged, target, pictures):
    """If Python cannot draw, the CSV files are published, and the ValueError names their folder."""
    try:
        draw(staged.path, pictures)
    except ValueError as error:
        for picture in pictures:
            if os.path.exists(os.path.join(staged.path, picture)):
                os.unlink(os.path.join(staged.path, picture))
        staged.publish()
        raise ValueError(f"{error}; the CSV files are in {target}") from None
    staged.publish()


def draw_beside(folder, table, picture):
    """Draws a picture of a CSV file beside it."""
    with StagedFolder(folder) as staged:
        link = os.path.join(staged.path, table)
        os.symlink(os.path.join("..", table), link)
        try:
            draw(staged.path, [picture])
        except ValueError as error:
            raise ValueError(f"{error}; the CSV files are in {folder}") from None
        os.unlink(link)
        staged.publish()
