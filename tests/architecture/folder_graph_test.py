#!/usr/bin/env python3
"""toolchain/folder-graph on small test trees: each has one violation, which must be reported."""

import pathlib
import shutil
import subprocess
import tempfile
import unittest

TOOLCHAIN = pathlib.Path(__file__).resolve().parents[2] / "toolchain"
TOOL = TOOLCHAIN / "folder-graph"
MODULE = TOOLCHAIN / "cmake/TargetSources.cmake"

RULES = """
subtree_targets = ["high"]
freestanding = ["low"]
hosted_headers = ["vector"]
hosted_files = ["low/for_hosts.hpp"]
decompositions = ["middle/dense.cpp"]
[supplied_headers]
"part.hpp" = ["high/sub"]
[may_include]
"low/**" = []
"middle" = ["low/**"]
"high/**" = ["low/**", "middle"]
"""

TREE = {
    "rules.toml": RULES,
    "low/a.hpp": "#include <array>\n",
    "low/pair/b.hpp": '#include "low/pair/inner/c.hpp"\n',
    "low/pair/inner/c.hpp": '#include "low/a.hpp"\n',
    "middle/m.cpp": '#include "low/a.hpp"\n#include <vector>\nint m() { return 1; }\n',
    "high/h.cpp": '#include "middle/m.hpp"\nint h() { return 1; }\n',
    "high/sub/s.cpp": "int s() { return 1; }\n",
    "README.md": "`low/`, `middle/`, `high/`\n",
    "low/README.md": "`pair/`\n",
    "high/README.md": "`sub/`\n",
}

PROJECT = """
cmake_minimum_required(VERSION 3.25)
project(made_up LANGUAGES CXX)
include(@MODULE@)
"""


class MadeUpTree(unittest.TestCase):
    def setUp(self):
        self.root = pathlib.Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, self.root)
        for path, text in TREE.items():
            self.write(path, text)

    def write(self, path, text):
        (self.root / path).parent.mkdir(parents=True, exist_ok=True)
        (self.root / path).write_text(text)

    def run_tool(self, *arguments):
        command = [TOOL, "--root", self.root, "--rules", self.root / "rules.toml", *arguments]
        return subprocess.run(command, capture_output=True, text=True)

    def check(self, *arguments):
        return self.run_tool("--check", *arguments)

    def assert_breach(self, done, text):
        self.assertEqual(done.returncode, 1, done.stdout + done.stderr)
        self.assertIn(text, done.stdout)
        self.assertIn(" 1 breaches", done.stdout)

    def configure(self, targets):
        self.write("CMakeLists.txt", PROJECT.replace("@MODULE@", str(MODULE)) + targets)
        subprocess.run(["cmake", "-S", self.root, "-B", self.root / "build"], check=True, capture_output=True)
        return self.root / "build"

    def test_tree_that_keeps_the_rules_passes(self):
        done = self.check()
        self.assertEqual((done.returncode, done.stderr), (0, ""), done.stdout)
        self.assertIn(" 0 breaches", done.stdout)

    def test_cycle_is_reported(self):
        self.write("high/x.hpp", '#include "high/sub/y.hpp"\n')
        self.write("high/sub/y.hpp", '#include "high/x.hpp"\n')
        self.assert_breach(self.check(), "cycle: high/x.hpp includes high/sub/y.hpp, high/sub/y.hpp includes high/x.hpp")

    def test_cycle_of_three_is_reported(self):
        self.write("high/README.md", "`sub/`, `p/`, `q/`, `r/`\n")
        for a, b in (("p", "q"), ("q", "r"), ("r", "p")):
            self.write(f"high/{a}/x.hpp", f'#include "high/{b}/x.hpp"\n')
        self.assert_breach(self.check(), "cycle: high/p/x.hpp includes high/q/x.hpp, high/q/x.hpp includes high/r/x.hpp")

    def test_cycle_through_a_supplied_header_is_reported(self):
        self.write("high/x.hpp", '#include "part.hpp"\n')
        self.write("high/sub/part.hpp", '#include "high/h.hpp"\n')
        self.assert_breach(self.check(), "cycle: high/x.hpp includes part.hpp, high/sub/part.hpp includes high/h.hpp")

    def test_header_without_a_folder_is_reported(self):
        self.write("high/x.hpp", '#include "other.hpp"\n')
        self.assert_breach(self.check(), 'high/x.hpp includes "other.hpp": name its folder')

    def test_forbidden_edge_is_reported(self):
        self.write("middle/up.hpp", '#include <low/a.hpp>\n#  include "high/h.hpp"\n')
        text = "middle/up.hpp includes high/h.hpp: middle may not include high"
        done = self.check()
        self.assertEqual(done.returncode, 1)
        self.assertIn(text, done.stdout)

    def test_edge_without_a_cycle_is_reported(self):
        self.write("low/up.hpp", '#include "low/pair/b.hpp"\n')
        self.write("low/pair/inner/c.hpp", "")
        self.write("high/h.cpp", "")
        self.write("low/pair/b.hpp", '#include "middle/new.hpp"\n')
        self.write("middle/m.cpp", "")
        self.assert_breach(self.check(), "low/pair/b.hpp includes middle/new.hpp: low/** may not include middle")

    def test_folder_without_an_entry_is_reported(self):
        self.write("middle/new/n.hpp", "")
        self.write("middle/README.md", "`new/`\n")
        self.assert_breach(self.check(), "middle/new: has no entry in the rules")

    def test_hosted_header_is_reported(self):
        self.write("low/pair/b.hpp", "#include <vector>\n")
        self.assert_breach(self.check(), "low/pair/b.hpp includes <vector>")
        self.write("low/pair/b.hpp", "#include <unistd.h>\n")
        self.assert_breach(self.check(), "low/pair/b.hpp includes <unistd.h>")
        self.write("low/pair/b.hpp", "#include <Eigen/Core>\n")
        self.assert_breach(self.check(), "low/pair/b.hpp includes <Eigen/Core>")

    def test_hosted_file_includes_what_it_likes_and_is_for_hosted_code(self):
        self.write("low/for_hosts.hpp", "#include <Eigen/Core>\n")
        self.assertEqual(self.check().returncode, 0)
        self.write("low/pair/b.hpp", '#include "low/for_hosts.hpp"\n')
        self.assert_breach(self.check(), "low/pair/b.hpp includes <low/for_hosts.hpp>")

    def test_decomposition_is_reported(self):
        for use in (
            "#include <Eigen/Dense>",
            "#include <Eigen/QR>",
            "auto x = m.ldlt().solve(b);",
            "auto x = m.partialPivLu().solve(b);",
            "Eigen::LLT<Eigen::MatrixXd> factor(m);",
            "Eigen::JacobiSVD<Eigen::Matrix3d> svd(m);",
            "Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::MatrixXd> solver(a, b);",
            "auto x = m.householderQr().householderQ();",
            "auto x = Eigen::umeyama(from, to);",
            "auto x = m.jacobiSvd(Eigen::ComputeThinU);",
            "auto x = m.eigenvalues();",
            "using namespace Eigen; JacobiSVD<MatrixXd> svd(m);",
        ):
            with self.subTest(use):
                self.write("high/h.cpp", use + "\n")
                self.assert_breach(self.check(), "high/h.cpp has ")

    def test_decompositions_stand_in_their_file(self):
        self.write("middle/dense.cpp", "#include <Eigen/QR>\nauto x = m.ldlt().solve(b);\n")
        self.write("high/h.cpp", "#include <Eigen/Core>\n#include <Eigen/Geometry>\nCholesky<double, 3> factor(m);\nauto lu = ready();\n")
        done = self.check()
        self.assertEqual(done.returncode, 0, done.stdout)

    def test_folder_that_its_parent_does_not_name_is_reported(self):
        self.write("high/README.md", "x\n")
        self.assert_breach(self.check(), "high/sub: high/README.md does not name `sub/`")

    def test_missing_page_of_a_parent_is_reported(self):
        (self.root / "high/README.md").unlink()
        self.assert_breach(self.check(), "high/sub: high/README.md does not name `sub/`")

    def test_targets_of_one_folder_or_subtree_pass(self):
        build = self.configure("add_library(m middle/m.cpp)\nadd_library(h high/h.cpp high/sub/s.cpp)\n")
        done = self.check("--build", build)
        self.assertEqual(done.returncode, 0, done.stdout)
        self.assertIn(" 2 targets", done.stdout)

    def test_mixed_target_is_reported(self):
        build = self.configure("add_library(mixed STATIC middle/m.cpp high/h.cpp)\n")
        self.assert_breach(self.check("--build", build), "target mixed is made of several folders' files: high, middle")

    def test_unity_build_hides_nothing(self):
        build = self.configure("set(CMAKE_UNITY_BUILD ON)\nadd_library(mixed STATIC middle/m.cpp high/h.cpp)\n")
        self.assert_breach(self.check("--build", build), "target mixed")

    def test_build_that_was_not_configured_is_refused(self):
        done = self.check("--build", self.root / "nowhere")
        self.assertEqual(done.returncode, 1)
        self.assertIn("configure that build", done.stderr)

    def test_graph_is_printed(self):
        self.assertIn("high -> middle\n", self.run_tool().stdout)
        self.assertIn('"high" -> "middle";', self.run_tool("--dot").stdout)


if __name__ == "__main__":
    unittest.main()
