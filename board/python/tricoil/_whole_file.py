"""Whole files, of limited size: a name may be a link to a device without an end."""

MOST_BYTES = 1 << 28  # the limit of board/support/line_reader.cpp
MOST_TOML_BYTES = 1 << 22


def read_whole(path, most_bytes: int = MOST_BYTES) -> bytes:
    """Raises ValueError that names the path if the file is longer, OSError."""
    with open(path, "rb") as file:
        data = file.read(most_bytes + 1)
    if len(data) > most_bytes:
        raise ValueError(f"{path}: is longer than {most_bytes >> 20} MiB; is it the right file?")
    return data
