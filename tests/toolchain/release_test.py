#!/usr/bin/env python3
"""toolchain/release on a commit or a machine that permits no release, and releases that fail or are interrupted: one line that names the
fault, the documented exit status, and nothing under the name of the result. Nothing is installed or built; see fake_machine.py."""

import subprocess
import unittest

from fake_machine import FakeMachine

CHANGELOG = "tricoil ({}) {}; urgency=low\n\n  * Change.\n\n -- Someone <a@b.invalid>  Tue, 24 Nov 2026 00:00:00 +0000\n"
# Stands for the build of the wheel; $PLACE is the temporary folder.
WHEEL = "import os, time\nopen(os.environ['HOME'] + '/building', 'w')\n{}\n"


class Release(FakeMachine):
    def setUp(self):
        super().setUp()
        self.provide("git", "tar", "gzip")
        self.replace("toolchain/install-deps", 'echo "install $*" >>"$CALLS"')
        self.replace("toolchain/page-libraries", "true")
        self.replace("nproc", "echo 1")
        self.write("CMakeLists.txt", "project(tricoil VERSION 1.2.3 LANGUAGES CXX)\n")
        self.write("toolchain/package/changelog", CHANGELOG.format("1.2.3", "unstable"))
        self.write("board/python/setup.py", WHEEL.format("raise SystemExit('no compiler')"))
        self.git("init", "--quiet")
        self.commit()
        self.git("tag", "v1.2.3")
        self.result = self.folder / "result"

    def git(self, *words):
        subprocess.run(["git", "-C", self.root, "-c", "user.name=a", "-c", "user.email=a@b.invalid", *words], check=True, capture_output=True)

    def commit(self, tag=None):
        self.git("add", "--all")
        self.git("commit", "--quiet", "--allow-empty", "--message", "Change")
        if tag:
            self.git("tag", tag)

    def refuses(self, naming, status=2, **environment):
        self.fails("release", self.result, status=status, naming=naming, **environment)
        self.nothing_is_left()

    def nothing_is_left(self):
        self.assertEqual([path.name for path in self.folder.glob("result*")], [])

    def test_no_tag(self):
        self.commit()
        self.refuses("has no tag: git tag v1.2.3")

    def test_tag_of_another_version(self):
        self.commit("v1.3.0")
        self.refuses("are v1.3.0, but CMakeLists.txt has version 1.2.3: make them agree")

    def make_key(self, name):
        """The file of a new key, which signs tags."""
        key = self.folder / name
        subprocess.run(["ssh-keygen", "-q", "-t", "ed25519", "-N", "", "-f", key], check=True)
        return key

    def sign(self, key):
        self.git("-c", "gpg.format=ssh", "-c", f"user.signingkey={key}", "tag", "--force", "--sign", "--message", "1.2.3", "v1.2.3")

    def list_signer(self, key):
        self.write("toolchain/package/signers", f"a@b.invalid {key.with_suffix('.pub').read_text()}")
        self.commit()

    def test_tag_of_a_listed_key(self):
        self.provide("ssh-keygen")
        key = self.make_key("key")
        self.list_signer(key)
        self.git("tag", "--force", "v1.2.3")
        self.refuses("the tag v1.2.3 has no valid signature of toolchain/package/signers (error: v1.2.3: cannot verify a non-tag object")
        self.sign(self.make_key("other"))
        self.refuses("the tag v1.2.3 has no valid signature of toolchain/package/signers")
        self.sign(key)
        done = self.run_script("release", self.result)
        self.assertEqual((done.returncode, done.stderr.splitlines()), (1, ["no compiler", "release: the wheel is not built"]))  # all checks passed
        (self.programs / "ssh-keygen").unlink()
        self.refuses("no ssh-keygen", status=3)

    def test_without_a_key_the_signature_is_not_checked(self):
        done = self.run_script("release", self.result)
        self.assertIn("the signature of v1.2.3 is not checked: the project has no key yet", done.stdout)

    def test_changelog_of_another_version(self):
        self.write("toolchain/package/changelog", CHANGELOG.format("1.2.2", "unstable"))
        self.commit()
        self.refuses("CMakeLists.txt has version 1.2.3, toolchain/package/changelog begins with '1.2.2'")
        self.write("toolchain/package/changelog", "")
        self.commit()
        self.refuses("begins with ''")

    def test_changelog_that_is_not_complete(self):
        self.write("toolchain/package/changelog", CHANGELOG.format("1.2.3", "UNRELEASED"))
        self.commit()
        self.refuses("is UNRELEASED")

    def test_changed_and_new_files(self):
        self.write("CMakeLists.txt", "project(tricoil VERSION 1.2.3 LANGUAGES CXX) \n")
        self.refuses("files differ from the last commit: CMakeLists.txt: commit or remove them")
        self.git("checkout", "CMakeLists.txt")
        self.write("new file", "")
        self.refuses('files differ from the last commit: "new file"')

    def test_not_a_checkout(self):
        (self.root / ".git").rename(self.folder / "moved")
        self.refuses("is not a git checkout: clone the project")

    def test_no_commit(self):
        subprocess.run(["rm", "-rf", self.root / ".git"], check=True)
        self.git("init", "--quiet")
        self.refuses("git finds no commit: fatal: ")

    def test_no_git(self):
        (self.programs / "git").unlink()
        self.refuses("no git", status=3)

    def test_wrong_words(self):
        self.fails("release", "--help", status=2, naming="usage: toolchain/release [FOLDER]")
        self.fails("release", "one", "two", status=2, naming="usage: toolchain/release [FOLDER]")

    def test_result_exists(self):
        self.result.mkdir()
        self.fails("release", self.result, status=2, naming=f"{self.result} exists")

    def test_folder_cannot_be_written(self):
        self.fails("release", "/proc/none/result", status=3, naming="cannot write to /proc/none")

    def test_disk_is_full(self):
        self.replace("df", "echo Avail; echo 3")
        self.refuses("has 3 MB of free space and needs", status=3)

    def test_packages_cannot_be_installed(self):
        self.replace("toolchain/install-deps", 'echo "install-deps: needs root or sudo" >&2; exit 3')
        self.commit()
        self.git("tag", "--force", "v1.2.3")
        self.refuses("needs root or sudo", status=3)

    def test_build_fails(self):
        done = self.run_script("release", self.result)
        self.assertEqual((done.returncode, done.stderr.splitlines()), (1, ["no compiler", "release: the wheel is not built"]))
        self.assertEqual(self.log_of_calls(), ["install release"])
        self.nothing_is_left()

    def test_interrupted(self):
        self.write("board/python/setup.py", WHEEL.format("time.sleep(30)"))
        self.commit()
        self.git("tag", "--force", "v1.2.3")
        status, _, _ = self.interrupt("release", str(self.result), after=self.folder / "building")
        self.assertEqual(status, 130)
        self.nothing_is_left()


if __name__ == "__main__":
    unittest.main()
