#!/usr/bin/env python3
"""The scripts of toolchain/ on machines where something is missing: one line that names it, the documented exit status, and no use of
incomplete results. Other programs are replaced by small scripts in a folder that is first on PATH."""

import os
import pathlib
import subprocess
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
TOOLCHAIN = ROOT / "toolchain"
NEEDED = ("apt-cache awk bash cat cut df dirname env find flock gcc grep head id kill mkdir mktemp mv rm sed sha256sum sleep sort tail touch "
          "tr uname").split()


class Scripts(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        self.cache = self.folder / "cache"
        self.programs = self.folder / "programs"
        self.programs.mkdir()
        for name in NEEDED:
            found = subprocess.run(["bash", "-c", f"type -P {name}"], capture_output=True, text=True).stdout.strip()
            (self.programs / name).symlink_to(found)

    def replace(self, name, script):
        path = self.programs / name
        path.unlink(missing_ok=True)
        path.write_text(f"#!/usr/bin/env bash\n{script}\n")
        path.chmod(0o755)

    def run_script(self, *command, **environment):
        environment = {"PATH": str(self.programs), "HOME": str(self.folder), "XDG_CACHE_HOME": str(self.cache), **environment}
        return subprocess.run([str(TOOLCHAIN / command[0]), *command[1:]], capture_output=True, text=True, env=environment)

    def fails(self, *command, status, naming, **environment):
        done = self.run_script(*command, **environment)
        self.assertEqual(done.returncode, status, done.stdout + done.stderr)
        self.assertIn(naming, done.stderr)
        self.assertEqual(len(done.stderr.splitlines()), 1, done.stderr)


class Cache(Scripts):
    SCRIPTS = (("npm-packages", "web"), ("uml/build-kernel",), ("vm/prepare",), ("test-kernel",))

    def test_cannot_be_written(self):
        for command in self.SCRIPTS:
            self.fails(*command, status=3, naming="cannot write to /proc/none/tricoil", XDG_CACHE_HOME="/proc/none")

    def test_no_home(self):
        self.fails("npm-packages", status=3, naming="cannot write to", XDG_CACHE_HOME="", HOME="/proc/none")

    def test_disk_is_full(self):
        self.replace("df", "echo Avail; echo 3")
        self.replace("npm", "exit 1")
        self.fails("npm-packages", status=3, naming="has 3 MB of free space and needs")
        self.fails("uml/build-kernel", status=3, naming="has 3 MB of free space and needs")


class NpmPackages(Scripts):
    def installed(self):
        return [path for path in (self.cache / "tricoil/npm").glob("*") if path.is_dir()]

    def test_no_npm(self):
        self.fails("npm-packages", "web", status=3, naming="no npm; run toolchain/install-deps")

    def test_half_installed_is_not_taken_for_installed(self):
        self.replace("npm", 'mkdir -p "$3/node_modules/three"; touch "$3/node_modules/three/package.json"; echo "npm ERR! code network down"; exit 1')
        self.fails("npm-packages", "web", status=3, naming="network down")
        self.assertEqual(self.installed(), [])
        self.replace("npm", 'mkdir -p "$3/node_modules/three"')
        done = self.run_script("npm-packages", "web")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual([str(path) for path in self.installed()], [done.stdout.strip()])
        self.replace("npm", "exit 1")  # must not be called again
        self.assertEqual(self.run_script("npm-packages", "web").stdout, done.stdout)


class BuildKernel(Scripts):
    def test_no_candidate(self):
        self.replace("apt-cache", "true")
        self.fails("uml/build-kernel", status=3, naming="no package linux-source-6.1: run apt-get update")

    def test_no_network(self):
        self.replace("apt-cache", 'echo "  Candidate: 6.1.0-1"')
        self.replace("apt-get", 'echo "E: Temporary failure resolving"; exit 100')
        done = self.run_script("uml/build-kernel")
        self.assertEqual(done.returncode, 3)
        self.assertIn("could not fetch linux-source-6.1: E: Temporary failure resolving", done.stderr)
        self.assertEqual(list((self.cache / "tricoil/uml").glob("linux-*")), [])


class InstallDeps(Scripts):
    def setUp(self):
        super().setUp()
        self.replace("dpkg-query", "exit 1")
        self.replace("id", "echo 0")

    def test_unknown_set(self):
        self.fails("install-deps", "nonsense", status=2, naming="unknown set 'nonsense'")

    def test_no_root_and_no_sudo(self):
        self.replace("id", "echo 1000")
        self.fails("install-deps", "run", status=3, naming="needs root or sudo to install: g++")

    def test_no_network(self):
        self.replace("apt-get", 'echo "W: Failed to fetch"; echo "E: Unable to locate package g++"; exit 100')
        self.fails("install-deps", "run", status=3, naming="cannot install: E: Unable to locate package g++")

    def test_waits_for_another_package_manager(self):
        self.replace("apt-get", f'[ -e {self.folder}/seen ] || {{ touch {self.folder}/seen; echo "E: Could not get lock x"; exit 100; }}')
        done = self.run_script("install-deps", "flash")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("install-deps: waiting for another package manager", done.stdout)

    def test_no_web_needs_no_npm(self):
        self.replace("apt-get", "true")
        self.assertIn(" npm", self.run_script("install-deps", "run").stdout)
        self.assertNotIn(" npm", self.run_script("install-deps", "run", "--no-web").stdout)


class WithProgress(Scripts):
    def test_output_of_failure_only(self):
        self.assertEqual(self.run_script("with-progress", "x", "echo", "fine").stdout, "")
        done = self.run_script("with-progress", "x", "bash", "-c", "echo one; echo two; exit 7")
        self.assertEqual((done.returncode, done.stderr), (7, "one\ntwo\n"))

    def test_counter(self):
        done = self.run_script("with-progress", "x", "bash", "-c", "echo '[3/4] unit'; sleep 11")
        self.assertRegex(done.stdout, r"^x: 3/4, 1\d s\n$")


if __name__ == "__main__":
    unittest.main()
