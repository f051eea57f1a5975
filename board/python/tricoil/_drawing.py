"""Pictures that _draw.py draws, in another process, from the CSV files of a folder."""

import os
import subprocess
import sys


def draw(folder, pictures):
    """Draws from the CSV files of a folder. Raises ValueError if Python cannot draw."""
    program = os.path.join(os.path.dirname(os.path.abspath(__file__)), "_draw.py")
    drawn = subprocess.run([sys.executable, "-I", program, *pictures], cwd=folder, capture_output=True, text=True, check=False)
    if drawn.returncode != 0:
        for picture in pictures:
            if os.path.exists(os.path.join(folder, picture)):
                os.unlink(os.path.join(folder, picture))
        message = (drawn.stderr.strip().splitlines() or [f"python3 ended with {drawn.returncode}"])[-1]
        raise ValueError(message if drawn.returncode in (2, 3) else f"python3 cannot draw: {message}")


def draw_and_publish(staged, target, pictures):
    """If Python cannot draw, the CSV files are published, and the ValueError names their folder."""
    try:
        draw(staged.path, pictures)
    except ValueError as error:
        staged.publish()
        raise ValueError(f"{error}; the CSV files are in {target}") from None
    staged.publish()
