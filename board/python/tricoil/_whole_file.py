"""Whole files, of limited size: a name may be a link to a device without an end."""

import os

MOST_BYTES = 1 << 28  # the limits of board/support/line_reader.cpp
MOST_LINES = 4_000_000
MOST_TOML_BYTES = 1 << 22


def read_whole(path, most_bytes: int = MOST_BYTES) -> bytes:
    """Raises ValueError that names the path if it is a folder or the file is longer, OSError."""
    if os.path.isdir(path):
        raise ValueError(f"{path}: is a folder; name a file")
    with open(path, "rb") as file:
        data = file.read(most_bytes + 1)
    if len(data) > most_bytes:
        raise ValueError(f"{path}: is longer than {most_bytes >> 20} MiB; is it the right file?")
    return data
