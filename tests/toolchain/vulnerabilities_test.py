#!/usr/bin/env python3
"""The table of known vulnerabilities has a row for every dependency; toolchain/known-vulnerabilities against a stand-in of Debian's tracker."""

import http.server
import json
import os
import pathlib
import re
import subprocess
import tempfile
import threading
import tomllib
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
TABLE = ROOT / "toolchain/vulnerabilities.toml"
SMALL = """
date = 2026-01-02
release = "bookworm"
[[dependency]]
name = "libone"
kind = "debian"
packages = ["libone-dev"]
version = "1.0-1+deb12u1"
use = "reads files"
checked = "changelog"
[[dependency.vulnerability]]
ids = ["CVE-2024-10001", "CVE-2024-10002"]
fixed = "1.0-1+deb12u1"
debian12 = "fixed"
reaches = "no: not called"
[[dependency.vulnerability]]
ids = ["CVE-2024-10003"]
fixed = ""
debian12 = "affected"
reaches = "not checked"
"""


def entry(status, version=None, release="bookworm"):
    about = {"status": status, "urgency": "not yet assigned"}
    return {"scope": "local", "releases": {release: about if version is None else {**about, "fixed_version": version}}}


def agreeing():
    return {"libone": {"CVE-2024-10001": entry("resolved", "1.0-1+deb12u1"), "CVE-2024-10002": entry("resolved", "1.0-1+deb12u1"),
                       "CVE-2024-10003": entry("open"), "CVE-2010-0001": entry("resolved", "0.5-1"), "CVE-2024-10009": entry("open", release="sid")},
            "libother": {"CVE-2024-20001": entry("open")}}


class Tracker:
    """Answers every request with `content`, on a port of this machine."""

    def __init__(self, content):
        class Handler(http.server.BaseHTTPRequestHandler):
            def do_GET(self):
                self.send_response(200)
                self.end_headers()
                self.wfile.write(content)

            def log_message(self, *_):
                pass

        self.server = http.server.HTTPServer(("127.0.0.1", 0), Handler)
        self.url = f"http://127.0.0.1:{self.server.server_port}/json"

    def __enter__(self):
        threading.Thread(target=self.server.serve_forever, daemon=True).start()
        return self.url

    def __exit__(self, *_):
        self.server.shutdown()
        self.server.server_close()


class KnownVulnerabilities(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.table = pathlib.Path(folder.name) / "table.toml"
        self.table.write_text(SMALL)

    def run_script(self, url, table=None):
        return subprocess.run([ROOT / "toolchain/known-vulnerabilities", "--table", table or self.table, "--tracker", url], capture_output=True, text=True,
                              env={**os.environ, "no_proxy": "*"})

    def compare(self, data):
        with Tracker(data if isinstance(data, bytes) else json.dumps(data).encode()) as url:
            done = self.run_script(url)
        return done.returncode, done.stdout.splitlines(), done.stderr

    def differs(self, data, *lines):
        status, out, err = self.compare(data)
        self.assertEqual((status, out[:-1], err), (1, list(lines), ""))

    def test_agrees(self):
        status, out, err = self.compare(agreeing())
        self.assertEqual((status, err), (0, ""))
        self.assertEqual(out, ["known-vulnerabilities: 0 differences in 1 Debian packages; the table is of 2026-01-02"])

    def test_new_ones(self):
        data = agreeing()
        data["libone"] |= {"CVE-2025-10004": entry("open"), "CVE-2025-10005": entry("resolved", "1.0-1+deb12u2"), "CVE-2025-10006": entry("undetermined"),
                           "CVE-2025-10007": entry("resolved", "0")}
        self.differs(data, "libone: CVE-2025-10004 is not in the table: the tracker says affected",
                     "libone: CVE-2025-10005 is not in the table: the tracker says fixed in 1.0-1+deb12u2",
                     "libone: CVE-2025-10006 is not in the table: the tracker says not checked")

    def test_other_states(self):
        data = agreeing()
        data["libone"]["CVE-2024-10001"] = entry("open")
        data["libone"]["CVE-2024-10002"] = entry("resolved", "1.0-1+deb12u9")
        data["libone"]["CVE-2024-10003"] = entry("resolved", "1.0-1+deb12u2")
        self.differs(data, "libone: CVE-2024-10001: the table says fixed, the tracker says affected",
                     "libone: CVE-2024-10002: the table says fixed in 1.0-1+deb12u1, the tracker says fixed in 1.0-1+deb12u9",
                     "libone: CVE-2024-10003: the table says affected, the tracker says fixed in 1.0-1+deb12u2")

    def test_not_in_the_tracker(self):
        data = agreeing()
        del data["libone"]["CVE-2024-10003"]
        self.differs(data, "libone: CVE-2024-10003 is not in the tracker, or not for this package")

    def test_unreachable_gives_the_date(self):
        with Tracker(b"") as url:
            pass
        done = self.run_script(url)
        self.assertEqual((done.returncode, done.stdout, len(done.stderr.splitlines())), (3, "", 1))
        self.assertRegex(done.stderr, r"cannot compare \(http://.*: .*refused\); the table is of 2026-01-02")

    def test_answers_that_are_not_the_data(self):
        for content in (b"", b"<html>", b"[]", b'{"a": 1}', b"\xff", json.dumps({"libone": {"CVE-2024-10001": []}}).encode(),
                        json.dumps({"libone": {"CVE-2024-10001": {"releases": {"bookworm": {}}}}}).encode()):
            status, out, err = self.compare(content)
            self.assertEqual((status, out, len(err.splitlines())), (3, [], 1), content)
            self.assertIn("the table is of 2026-01-02", err)

    def test_tables_that_are_not_valid(self):
        for old, new, naming in (('"CVE-2024-10003"', '"CVE-24-3"', "'CVE-24-3' is no number"), ("date = 2026-01-02", 'date = "today"', "must have 'date'"),
                                 ("CVE-2024-10003", "CVE-2024-10001", "CVE-2024-10001 has two rows"), ('"affected"', '"maybe"', "'maybe' is not one of"),
                                 ('fixed = "1.0-1+deb12u1"', 'fixed = ""', "names no version"), ('reaches = "not checked"', "", "must have the keys"),
                                 ('"bookworm"', '"buzz"', "unknown release 'buzz'"), ('kind = "debian"', 'kind = "x"', "'kind' must be debian or npm")):
            self.assertIn(old, SMALL)
            self.table.write_text(SMALL.replace(old, new))
            done = self.run_script("http://127.0.0.1:9/")
            self.assertEqual((done.returncode, len(done.stderr.splitlines())), (2, 1), done.stderr)
            self.assertIn(naming, done.stderr)
        self.assertEqual(self.run_script("http://127.0.0.1:9/", "/nonexistent").returncode, 2)


class Table(unittest.TestCase):
    """Every dependency that CMake or npm names is in the table, with the version that is used."""

    def setUp(self):
        self.rows = tomllib.loads(TABLE.read_text())["dependency"]
        self.packages = {package: row for row in self.rows for package in row["packages"]}

    def test_is_valid(self):
        done = subprocess.run([ROOT / "toolchain/known-vulnerabilities", "--tracker", "http://127.0.0.1:9/"], capture_output=True, text=True,
                              env={**os.environ, "no_proxy": "*"})
        self.assertEqual(done.returncode, 3, done.stderr)

    def test_debian_packages_of_cmake(self):
        text = (ROOT / "toolchain/cmake/Components.cmake").read_text()
        calls = re.findall(r"^tricoil_(?:require|component)\((?:[^()]|\n)*\)", text, re.M)
        named = {word for call in calls for word in re.findall(r"\b[a-z0-9][a-z0-9.+-]*-dev\b|\bpython3\b", call)}
        self.assertGreater(len(named), 15)
        self.assertEqual(named - set(self.packages), set())

    def test_npm_packages(self):
        named = {name: version for folder in (ROOT / "toolchain/npm").iterdir()
                 for name, version in json.loads((folder / "package.json").read_text())["dependencies"].items()}
        page = (ROOT / "toolchain/page-libraries").read_text()
        named |= dict(re.findall(r'^    "(\w+)": \("([\d.]+)", "', page, re.M))
        named["esbuild"] = re.search(r'^BUNDLER = "([\d.]+)"', page, re.M)[1]
        self.assertGreater(len(named), 5)
        self.assertEqual({name: self.packages[name]["version"] for name in named if name in self.packages}, named)

    def test_states_of_used_npm_packages(self):
        for row in self.rows:
            for vulnerability in row.get("vulnerability", ()):
                if row["kind"] == "npm" and vulnerability["used"] == "not affected":
                    self.assertGreaterEqual([int(part) for part in row["version"].split(".")], [int(part) for part in vulnerability["fixed"].split(".")])


if __name__ == "__main__":
    unittest.main()
