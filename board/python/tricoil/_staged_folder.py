"""Output folder whose files are written all or not at all."""

import contextlib
import fcntl
import os
import shutil
import stat

from ._output_file import ANY_WRITE

PREFIX = ".unfinished-"


def _lock(folder):
    """The open folder, locked; None if a program uses it, or it cannot be opened."""
    try:
        number = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW | os.O_CLOEXEC)
    except OSError:
        return None
    try:
        fcntl.flock(number, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        os.close(number)
        return None
    return number


class StagedFolder:
    """Hidden folder in `target` for the files. publish() moves them to `target` and replaces older ones; otherwise they are removed with
    the folder. Folders left by killed programs are removed too.

    Raises ValueError that names the folder if it cannot be written, or, before the first move, the older file that is write-protected or
    not a regular file."""

    def __init__(self, target: str):
        self._target = os.path.abspath(target)
        self._made = False
        try:
            if os.path.exists(self._target) and not os.path.isdir(self._target):
                raise OSError(0, "it is a file")
            if not os.path.isdir(self._target):
                os.mkdir(self._target)
                self._made = True
        except OSError as error:
            raise ValueError(f"cannot use output folder {target}: {error.strerror}; create its parent or choose another") from None
        self._sweep()
        self.path = os.path.join(self._target, f"{PREFIX}{os.getpid()}")
        try:
            os.mkdir(self.path)
        except OSError as error:
            self._remove_made()
            raise ValueError(f"cannot write into output folder {target}: {error.strerror}; choose another") from None
        self._number = _lock(self.path)

    def _sweep(self):
        with contextlib.suppress(OSError):
            for name in os.listdir(self._target):
                folder = os.path.join(self._target, name)
                number = _lock(folder) if name.startswith(PREFIX) else None
                if number is not None:
                    shutil.rmtree(folder, ignore_errors=True)
                    os.close(number)

    def _remove_made(self):
        if self._made:
            with contextlib.suppress(OSError):  # only if it is empty
                os.rmdir(self._target)

    def publish(self) -> None:
        moves = [(os.path.join(self.path, name), os.path.join(self._target, name)) for name in sorted(os.listdir(self.path))]
        for _, to in moves:
            old = os.stat(to) if os.path.exists(to) else None
            if old and not stat.S_ISREG(old.st_mode):
                raise ValueError(f"cannot write {to}: not a regular file; remove it")
            if old and (not old.st_mode & ANY_WRITE or not os.access(to, os.W_OK)):
                raise ValueError(f"cannot write {to}: it is write-protected; choose another file or folder")
        for file, to in moves:
            try:
                os.replace(file, os.path.realpath(to))
            except OSError as error:
                raise ValueError(f"cannot write {to}: {error.strerror}; remove the existing file") from None
        self._made = False

    def __enter__(self):
        return self

    def __exit__(self, *_):
        shutil.rmtree(self.path, ignore_errors=True)
        if self._number is not None:
            os.close(self._number)
        self._remove_made()
