"""Bytes of a file or of standard input as they come; at the end of a file that grows it waits for more."""

import os
import signal
import stat
import time

SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT)
FOLLOW_INTERVAL_S = 0.02
CHUNK_BYTES = 1 << 19


class EndBySignal:
    """While it is open, a signal sets `seen`; the same signal again ends the program. SIGHUP stays ignored if it was (nohup)."""

    def __init__(self):
        self.seen = False
        self.before = {}

    def __enter__(self):
        for number in SIGNALS:
            if number != signal.SIGHUP or signal.getsignal(number) != signal.SIG_IGN:
                self.before[number] = signal.signal(number, self._note)
        return self

    def __exit__(self, *_):
        for number, handler in self.before.items():
            signal.signal(number, handler)

    def _note(self, number, _):
        signal.signal(number, signal.SIG_DFL)
        self.seen = True


class ByteStream:
    """path: "-" is standard input. follows: waits at the end of a file for more, until the user interrupts. Raises ValueError that
    names the path if it is a folder or cannot be opened."""

    def __init__(self, path: str, follows: bool = False):
        self.path = path
        self.is_over = False
        self._end = None
        if path != "-" and os.path.isdir(path):
            raise ValueError(f"{path}: is a folder; name a file")
        try:
            self._file = open(0 if path == "-" else path, "rb", buffering=0, closefd=path != "-")
        except (OSError, ValueError):
            raise ValueError(f"{path}: cannot be opened; check the path and its permissions") from None
        if follows and stat.S_ISREG(os.fstat(self._file.fileno()).st_mode):
            self._end = EndBySignal()
            self._end.__enter__()

    def close(self):
        self._file.close()
        if self._end:
            self._end.__exit__()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def read(self) -> bytes:
        """The next bytes; empty at the end. Raises OSError that names the path if the disk or device fails."""
        while not self.is_over:
            try:
                data = self._file.read(CHUNK_BYTES)
            except OSError as error:
                raise OSError(f"{self.path}: cannot be read to its end ({error.strerror}); check the disk") from None
            if data:
                return data
            if self._end is None or self._end.seen:
                self.is_over = True
            elif data is not None:
                time.sleep(FOLLOW_INTERVAL_S)
        return b""
