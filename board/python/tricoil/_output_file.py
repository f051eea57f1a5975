"""Output file that is written completely or not at all: the rules of board/support/output_file.hpp."""

import contextlib
import os
import stat
from collections.abc import Iterable

ANY_WRITE = stat.S_IWUSR | stat.S_IWGRP | stat.S_IWOTH
RECORDED = (".csv", ".json", ".traj")  # what is read of a folder


def _read_from(name):
    """The file, or those of the folder. The standard input: its descriptor."""
    if not os.path.isdir(name):
        return [0 if name == "-" else name]
    return [os.path.join(name, file) for file in os.listdir(name) if file.endswith(RECORDED)]


def refuse_input_as_output(outputs: dict, inputs: Iterable) -> None:
    """outputs: name or None by option. inputs: names of files and folders, "-" (standard input), None, or arrays. Raises ValueError if an output is an
    input, under whatever name, or two outputs are one file."""
    seen: dict[str, str] = {}
    for option, output in outputs.items():
        if output not in (None, "-") and (os.path.isfile(output) or not os.path.exists(output)):  # two texts may go to one device
            other = seen.setdefault(os.path.realpath(output), option)
            if other != option:
                raise ValueError(f"{other} and {option} name the same file; choose two files")
    named = [file for one in inputs if isinstance(one, (str, os.PathLike)) for file in _read_from(os.fspath(one))]
    for option, output in outputs.items():
        if output in (None, "-") or not os.path.isfile(output):
            continue
        if any(os.path.exists(one) and os.path.samefile(one, output) for one in named):
            raise ValueError(f"{option} {os.fspath(output)}: is also an input file; choose another file")


class OutputFile:
    """Writes a temporary file beside `path`; commit() renames it to the target of `path`. Without commit() the temporary file is removed
    and an older file stays unchanged. A pipe, device, or the file that is the standard output is written directly; "-" is the standard output.

    Raises ValueError that names the path if it is a folder or write-protected, or the file cannot be created; OSError if text cannot be
    written."""

    def __init__(self, path: str):
        self.path, self._aside = path, None
        try:
            self._file = os.fdopen(self._open(path), "wb")
        except OSError as error:
            raise self._refused(error.strerror) from None

    def _refused(self, reason):
        return ValueError(f"cannot write {self.path}: {reason}; choose another file or folder")

    def _open(self, path):
        if path == "-":
            self.path = "standard output"
            return os.dup(1)
        if os.path.isdir(path):
            raise self._refused("it is a folder")
        old = os.stat(path) if os.path.exists(path) else None
        if old and os.path.samestat(old, os.fstat(1)):
            return os.dup(1)
        if old and not stat.S_ISREG(old.st_mode):
            return os.open(path, os.O_WRONLY | os.O_CLOEXEC)
        if old and (not old.st_mode & ANY_WRITE or not os.access(path, os.W_OK)):
            raise self._refused("it is write-protected")
        self._place = os.path.realpath(path)
        self._aside = f"{self._place}.part-{os.getpid()}"
        if os.path.lexists(self._aside):  # left by a killed program with the same process number
            os.unlink(self._aside)
        number = os.open(self._aside, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o666)
        if old:
            os.fchmod(number, stat.S_IMODE(old.st_mode))
        return number

    def write(self, content: str | bytes, flush: bool = False) -> None:
        try:
            self._file.write(content.encode() if isinstance(content, str) else content)
            if flush:
                self._file.flush()
        except BrokenPipeError:
            raise
        except OSError as error:
            self._fail(error)

    def _fail(self, error):
        raise OSError(f"{self.path}: could not be written completely ({error.strerror}); is the disk full?") from None

    def commit(self) -> None:
        """Flushes to the disk and renames."""
        self.write("", flush=True)
        if self._aside is None:
            return
        try:
            os.fsync(self._file.fileno())
            os.replace(self._aside, self._place)
        except OSError as error:
            self._fail(error)
        self._aside = None

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self._aside is not None:
            os.unlink(self._aside)
        try:
            self._file.close()
        except OSError:  # told by write() or commit()
            pass


def write_whole(path: str, content: str | bytes) -> None:
    """Writes a file completely or not at all. Raises ValueError, OSError as OutputFile."""
    with OutputFile(path) as file:
        file.write(content)
        file.commit()


def write_all(contents: dict[str, str | bytes]) -> None:
    """Contents by path: all files, or none if one cannot be written. Raises ValueError, OSError as OutputFile."""
    with contextlib.ExitStack() as stack:
        files = [stack.enter_context(OutputFile(path)) for path in contents]
        for file, content in zip(files, contents.values()):
            file.write(content, flush=True)
        for file in files:
            file.commit()
