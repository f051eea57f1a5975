"""Progress of long calls, on a terminal."""

import contextlib
import multiprocessing
import os
import sys
import threading
import time
from collections.abc import Callable, Iterator

_QUIET_S = 0.5  # shorter calls draw nothing
_INTERVAL_S = 0.1
_CELLS = 16


def is_wanted(progress: bool | None) -> bool:
    """The caller's choice. None: only the main thread of the first process draws, and only on a terminal."""
    if progress is not None:
        return progress
    is_first = multiprocessing.parent_process() is None and threading.current_thread() is threading.main_thread()
    return is_first and "TRICOIL_QUIET" not in os.environ and sys.stderr is not None and sys.stderr.isatty()


@contextlib.contextmanager
def bar(label: str, progress: bool | None) -> Iterator[Callable[[float], None] | None]:
    """Returns a function that takes the finished share and draws a bar on standard error; None if no bar is wanted."""
    if not is_wanted(progress):
        yield None
        return
    began = time.monotonic()
    drawn = None

    def show(share: float) -> None:
        nonlocal drawn
        now = time.monotonic()
        if now - began < _QUIET_S or (drawn is not None and now - drawn < _INTERVAL_S):
            return
        drawn = now
        cells = "#" * int(share * _CELLS)
        left = f", {(now - began) * (1 - share) / share:.0f} s left" if share > 0 else ""
        _write(f"\r\x1b[K[{cells:.<{_CELLS}}] {label} {share:.0%}{left}")

    try:
        yield show
    finally:
        if drawn is not None:
            _write("\r\x1b[K")


def _write(text):
    with contextlib.suppress(OSError, ValueError):  # a closed terminal does not end the call
        print(text, end="", file=sys.stderr, flush=True)
