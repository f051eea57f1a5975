"""A machine for tests of scripts: a copy of toolchain/ in a folder of its own, where other programs are replaced by small scripts in a
folder that alone is on PATH."""

import atexit
import functools
import os
import pathlib
import shutil
import signal
import subprocess
import tempfile
import time
import unittest

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
NEEDED = ("apt-cache awk bash cat chmod cmp cp cut date df dirname env find flock gcc grep head id kill ln ls mkdir mktemp mv nproc paste printf python3 realpath rm "
          "sed sh sha256sum sleep sort tail tee touch tr uname").split()


@functools.cache
def copy_of_toolchain():
    folder = tempfile.TemporaryDirectory()
    atexit.register(folder.cleanup)
    shutil.copytree(ROOT / "toolchain", folder.name, ignore=shutil.ignore_patterns("__pycache__", "pages"), dirs_exist_ok=True)
    return folder.name


class FakeMachine(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        self.cache = self.folder / "cache"
        self.programs = self.folder / "programs"
        self.programs.mkdir()
        self.provide(*NEEDED)
        self.root = self.folder / "tree"
        shutil.copytree(copy_of_toolchain(), self.root / "toolchain", copy_function=os.link)  # a test replaces files, it changes none
        self.calls = self.folder / "calls"
        self.calls.touch()

    def provide(self, *names):
        """Programs of this machine."""
        for name in names:
            (self.programs / name).symlink_to(shutil.which(name))

    def write(self, name, text):
        """Writes a new file of the tree in place of an old one."""
        path = self.root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.unlink(missing_ok=True)
        path.write_text(text)
        return path

    def replace(self, name, script):
        """Replaces a program or, if the name has a slash, a script of the tree. $CALLS: the file for log_of()."""
        path = (self.root if "/" in name else self.programs) / name
        self.write(path, f'#!/bin/bash\nCALLS="{self.calls}"\n{script}\n').chmod(0o755)

    def log_of_calls(self):
        return self.calls.read_text().splitlines()

    def environment(self, **more):
        return {"PATH": str(self.programs), "HOME": str(self.folder), "XDG_CACHE_HOME": str(self.cache), "LC_ALL": "C", **more}

    def run_script(self, *command, **environment):
        return subprocess.run([str(self.root / "toolchain" / command[0]), *map(str, command[1:])], capture_output=True, text=True,
                              env=self.environment(**environment), cwd=self.folder)

    def interrupt(self, *command, after, number=signal.SIGINT):
        """Runs a script; interrupts it with all its children, as ctrl-C does, once the file `after` exists. Returns status and output."""
        process = subprocess.Popen([str(self.root / "toolchain" / command[0]), *command[1:]], stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                                   text=True, env=self.environment(), cwd=self.folder, start_new_session=True,
                                   preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler))
        end = time.monotonic() + 20
        while not after.exists() and process.poll() is None and time.monotonic() < end:
            time.sleep(0.05)
        os.killpg(process.pid, number)
        output, errors = process.communicate(timeout=20)
        with self.assertRaises(ProcessLookupError, msg="a process of the script is left"):
            for _ in range(100):
                os.killpg(process.pid, 0)
                time.sleep(0.05)
        return process.returncode, output, errors

    def fails(self, *command, status, naming, **environment):
        done = self.run_script(*command, **environment)
        self.assertEqual(done.returncode, status, done.stdout + done.stderr)
        self.assertIn(naming, done.stderr)
        self.assertEqual(len(done.stderr.splitlines()), 1, done.stderr)
