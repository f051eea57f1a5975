#!/usr/bin/env python3
"""The scripts of toolchain/ on machines where something is missing: one line that names it, the documented exit status, and no use of
incomplete results. See also fake_machine.py."""

import json
import re
import signal
import unittest

from fake_machine import ROOT, FakeMachine


class Cache(FakeMachine):
    SCRIPTS = (("npm-packages",), ("page-libraries",), ("uml/build-kernel",), ("vm/prepare",), ("test-kernel",))

    def test_cannot_be_written(self):
        for command in self.SCRIPTS:
            self.fails(*command, status=3, naming="cannot write to /proc/none/tricoil", XDG_CACHE_HOME="/proc/none")

    def test_no_home(self):
        self.fails("npm-packages", status=3, naming="cannot write to", XDG_CACHE_HOME="", HOME="/proc/none")

    def test_disk_is_full(self):
        self.replace("df", "echo Avail; echo 3")
        self.replace("npm", "exit 1")
        self.fails("npm-packages", status=3, naming="has 3 MB of free space and needs")
        self.fails("page-libraries", status=3, naming="has 3 MB of free space and needs")
        self.fails("uml/build-kernel", status=3, naming="has 3 MB of free space and needs")


class Workflows(unittest.TestCase):
    def test_every_action_is_a_commit(self):
        """A tag of another repository can be moved."""
        for path in sorted((ROOT / ".github/workflows").iterdir()):
            actions = re.findall(r"\buses: *(.*)", path.read_text(encoding="utf-8"))
            self.assertTrue(actions, path)
            for action in actions:
                self.assertRegex(action, r"^[\w-]+/[\w-]+@[0-9a-f]{40}  # v\d+\.\d+\.\d+$", path)


class NpmPackages(FakeMachine):
    def installed(self):
        return [path for path in (self.cache / "tricoil/npm").glob("*") if path.is_dir()]

    def test_every_package_has_a_hash(self):
        for folder in (ROOT / "toolchain/npm").iterdir():
            packages = json.loads((folder / "package-lock.json").read_text(encoding="utf-8"))["packages"]
            named = json.loads((folder / "package.json").read_text(encoding="utf-8"))["dependencies"]
            self.assertEqual(named, packages.pop("")["dependencies"])
            for name, package in packages.items():
                self.assertRegex(package["integrity"], r"^sha512-", name)

    def test_npm_compares_with_the_hashes(self):
        self.replace("npm", 'echo "$1" "$(cmp "$3/package-lock.json" tree/toolchain/npm/test/package-lock.json && echo same)" >"$CALLS"')
        self.assertEqual(self.run_script("npm-packages").returncode, 0)
        self.assertEqual(self.log_of_calls(), ["ci same"])  # npm install would change the file

    def test_no_npm(self):
        self.fails("npm-packages", status=3, naming="no npm; run toolchain/install-deps")

    def test_half_installed_is_not_taken_for_installed(self):
        self.replace("npm", 'mkdir -p "$3/node_modules/three"; touch "$3/node_modules/three/package.json"; echo "npm ERR! code network down"; exit 1')
        self.fails("npm-packages", status=3, naming="network down")
        self.assertEqual(self.installed(), [])
        self.replace("npm", 'mkdir -p "$3/node_modules/three"')
        done = self.run_script("npm-packages")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual([str(path) for path in self.installed()], [done.stdout.strip()])
        self.replace("npm", "exit 1")  # must not be called again
        self.assertEqual(self.run_script("npm-packages").stdout, done.stdout)


class PageLibraries(FakeMachine):
    """A registry in a folder; other contents than those that the script expects."""

    def setUp(self):
        super().setUp()
        self.registry = self.folder / "registry"

    def answer(self, content):
        path = self.registry / "three/-/three-0.187.0.tgz"
        path.parent.mkdir(parents=True)
        path.write_bytes(content)

    def fails_with(self, reason):
        self.fails("page-libraries", status=3, naming=reason, NPM_CONFIG_REGISTRY=f"file://{self.registry}")
        self.assertEqual([path for path in (self.cache / "tricoil/page").glob("*") if path.name not in ("lock", "part")], [])

    def test_no_network(self):
        self.fails_with("cannot download file://")

    def test_another_content_is_refused(self):
        self.answer(b"not the library")
        self.fails_with("three-0.187.0.tgz has another SHA-512 than expected")

    def test_unknown_processor(self):
        script = (self.root / "toolchain/page-libraries").read_text()
        self.write("toolchain/page-libraries", script.replace("platform.machine()", "'vax'")).chmod(0o755)
        self.fails_with("no bundler for the processor vax; build without the live page")


class BuildKernel(FakeMachine):
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


class InstallDeps(FakeMachine):
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

    def test_first_pose_needs_less_than_the_rest(self):
        self.replace("apt-get", "true")
        first, build, all_packages = (set(self.run_script("install-deps", name).stdout.split()) for name in ("first-pose", "build", "run"))
        self.assertLess(first, build)
        self.assertLess(build, all_packages)
        self.assertNotIn("libceres-dev", first)
        self.assertIn("python3-scipy", all_packages)

    def test_several_sets_name_each_package_once(self):
        self.replace("apt-get", "true")
        packages = self.run_script("install-deps", "boards", "kernel").stdout.split()
        self.assertIn("qemu-system-arm", packages)
        self.assertIn("libelf-dev", packages)
        self.assertEqual(len(packages), len(set(packages)))

    def test_only_tests_need_npm(self):
        self.replace("apt-get", "true")
        self.assertNotIn(" npm", self.run_script("install-deps", "run").stdout)
        self.assertIn(" npm", self.run_script("install-deps", "test").stdout)


class CheckStyle(FakeMachine):
    def format(self, version):
        self.replace("git", "echo a.cpp")
        self.replace("clang-format", f'[ "$1" = --version ] && echo "clang-format version {version}" || exit 1')
        return self.run_script("check-style", "--format")

    def test_only_clang_format_14_decides(self):
        done = self.format("19.1.7 (3)")
        self.assertEqual((done.returncode, done.stdout), (0, "check-style: formatting is not checked: clang-format 14 decides, this system has 19\n"))
        self.assertEqual(self.format("14.0.6").returncode, 1)


class WithProgress(FakeMachine):
    def test_output_of_failure_only(self):
        self.assertEqual(self.run_script("with-progress", "x", "echo", "fine").stdout, "")
        done = self.run_script("with-progress", "x", "bash", "-c", "echo one; echo two; exit 7")
        self.assertEqual((done.returncode, done.stderr), (7, "one\ntwo\n"))

    def test_counter(self):
        done = self.run_script("with-progress", "x", "bash", "-c", "echo '[3/4] unit'; sleep 11")
        self.assertRegex(done.stdout, r"^x: 3/4, 1\d s\n$")

    def test_interrupt_is_silent(self):
        started = self.folder / "started"
        for number, status, message in ((signal.SIGINT, 130, ""), (signal.SIGTERM, 143, "Terminated\n")):  # bash's message
            started.unlink(missing_ok=True)
            with self.subTest(number):
                done = self.interrupt("with-progress", "x", "bash", "-c", f"echo unit; : >{started}; sleep 30; echo end", after=started, number=number)
                self.assertEqual(done, (status, "", message))


if __name__ == "__main__":
    unittest.main()
