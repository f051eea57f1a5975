#!/usr/bin/env python3
"""The order of steps in toolchain/run, toolchain/test and toolchain/build, with faults and interruptions. Nothing is installed or built;
see fake_machine.py."""

import os
import shutil
import sys
import time
import unittest

from fake_machine import ROOT, FakeMachine

# A build that makes the program, which prints its arguments.
BUILD = """
echo "build $*" >>"$CALLS"
mkdir -p build/run/bin build/run/board/host
program=build/run/board/host/tricoil
printf '#!/usr/bin/env bash\\necho "tricoil $*" | tee -a "%s"\\nexit ${POSE_STATUS:-0}\\n' "$CALLS" >$program
chmod +x $program
ln -sf ../board/host/tricoil build/run/bin/tricoil
[ $# -gt 1 ] || touch build/run/complete
"""


class Run(FakeMachine):
    def setUp(self):
        super().setUp()
        self.replace("toolchain/install-deps", 'echo "install $*" >>"$CALLS"; echo "install-deps: words"')
        self.replace("toolchain/build", BUILD)
        self.replace("id", "echo 0")
        self.program = self.root / "build/run/bin/tricoil"

    def test_first_pose_comes_before_the_rest(self):
        done = self.run_script("run", "--seed", "7")
        self.assertEqual(done.returncode, 0, done.stderr)
        calls = self.log_of_calls()
        self.assertEqual(calls[:3], ["install first-pose", "build run tricoil_first_pose", "tricoil run --seed 7"])
        self.assertEqual([call for call in calls[3:] if call.startswith("build")], ["build run tricoil_before_packages", "build run"])
        self.assertEqual([call for call in calls[3:] if call.startswith("install")], ["install build", "install run"])
        self.assertLess(calls.index("install build"), calls.index("build run"))
        self.assertEqual(done.stdout, "tricoil run --seed 7\n")
        lines = done.stderr.splitlines()
        self.assertRegex(lines[0], r"^run: 1\. installs and builds what the first pose needs: about \d+ min")
        self.assertRegex(lines[-1], r"^run: all is built: tricoil in build/run/bin")

    def test_second_call_says_that_little_is_to_do(self):
        self.run_script("run")
        done = self.run_script("run")
        self.assertRegex(done.stderr, "^run: builds what has changed")
        self.assertEqual(self.log_of_calls()[7:], ["install first-pose", "build run tricoil_first_pose", "tricoil run", "install run", "build run"])

    def test_status_of_the_pose_is_kept(self):
        done = self.run_script("run", POSE_STATUS="1")
        self.assertEqual(done.returncode, 1)
        self.assertEqual(self.log_of_calls().count("tricoil run"), 1)
        self.assertIn("run: all is built", done.stderr)

    def test_interrupted_pose_ends_the_script(self):
        self.assertEqual(self.run_script("run", POSE_STATUS="130").returncode, 130)
        self.assertEqual(self.log_of_calls()[-1], "tricoil run")

    def test_pose_that_is_interrupted_with_a_result(self):
        started = self.folder / "started"
        program = f"trap 'exit 1' INT; touch {started}; for n in {{1..300}}; do sleep 0.1; done"
        self.replace("toolchain/build", f'{BUILD}\nprintf "#!/usr/bin/env bash\\n%s\\n" "{program}" >$program')
        status, _, errors = self.interrupt("run", after=started)
        self.assertEqual((status, errors.splitlines()[-1]), (1, "run: interrupted before the rest; the next call goes on"))
        self.assertNotIn("build run", self.log_of_calls())

    def test_a_part_that_the_first_program_lacks(self):
        self.assertEqual(self.run_script("run", POSE_STATUS="3").returncode, 3)
        self.assertEqual(self.log_of_calls()[-2:], ["build run", "tricoil run"])
        self.run_script("run", POSE_STATUS="3")  # all is built: no second attempt
        self.assertEqual(self.log_of_calls().count("tricoil run"), 3)

    def test_first_packages_cannot_be_installed(self):
        self.replace("toolchain/install-deps", 'echo "install-deps: no network" >&2; exit 3')
        done = self.run_script("run")
        self.assertEqual((done.returncode, self.log_of_calls()), (3, []))
        self.assertEqual(done.stderr.splitlines()[-1], "install-deps: no network")

    def test_rest_fails_and_the_next_call_goes_on(self):
        self.replace("toolchain/build", f'{BUILD}\n[ $# -gt 1 ] || {{ rm build/run/complete; echo "build: no npm" >&2; exit 1; }}')
        done = self.run_script("run")
        self.assertEqual(done.returncode, 1)
        self.assertRegex(done.stderr.splitlines()[-1], r"^run: the rest is not complete.*build/run/bin/tricoil run works$")
        self.replace("toolchain/build", BUILD)
        self.assertIn("run: all is built", self.run_script("run").stderr)

    def test_rest_lacks_packages(self):
        self.replace("toolchain/install-deps", '[ $1 = first-pose ] || { echo "install-deps: no network" >&2; exit 3; }')
        for user in (0, 1000):  # without root, and without sudo: one after the other
            self.replace("id", f"echo {user}")
            done = self.run_script("run")
            self.assertEqual(done.returncode, 3)
            self.assertEqual(done.stderr.splitlines()[-2], "install-deps: no network")
            self.assertNotIn("build run", self.log_of_calls())
        self.assertEqual(self.log_of_calls().count("build run tricoil_product"), 2, "what can be built is built")

    def test_packages_are_installed_while_the_rest_is_built(self):
        installing, built = self.folder / "installing", self.folder / "built"
        self.replace("toolchain/install-deps", f"[ $1 = first-pose ] || {{ touch {installing}; while [ ! -e {built} ]; do sleep 0.1; done; }}")
        self.replace("toolchain/build", f'{BUILD}\n[ "$2" != tricoil_before_packages ] || {{ while [ ! -e {installing} ]; do sleep 0.1; done; touch {built}; }}')
        self.assertEqual(self.run_script("run").returncode, 0)

    def test_rest_is_compiled_while_packages_for_running_are_installed(self):
        compiling = self.folder / "compiling"
        self.replace("toolchain/install-deps", f"[ $1 != run ] || {{ while [ ! -e {compiling} ]; do sleep 0.1; done; }}")
        self.replace("toolchain/build", f"{BUILD}\n[ $# -gt 1 ] || touch {compiling}")
        self.assertEqual(self.run_script("run").returncode, 0)

    def test_packages_for_running_cannot_be_installed(self):
        self.replace("toolchain/install-deps", '[ $1 != run ] || { echo "install-deps: no space" >&2; exit 3; }')
        done = self.run_script("run")
        self.assertEqual((done.returncode, done.stderr.splitlines()[-2]), (3, "install-deps: no space"))
        self.assertIn("the rest is not complete", done.stderr)

    def test_interrupted_installation(self):
        installing = self.folder / "installing"
        self.replace("toolchain/install-deps", f"[ $1 = first-pose ] || {{ : >{installing}; sleep 30; }}")
        status, output, _ = self.interrupt("run", after=installing)
        self.assertEqual((status, output), (130, "tricoil run\n"))

    def test_interrupted_link_leaves_the_program(self):
        linking = self.folder / "linking"
        self.replace("toolchain/build", f'{BUILD}\n[ $# -gt 1 ] || {{ rm $program build/run/complete; : >{linking}; sleep 30; }}')
        status, output, _ = self.interrupt("run", after=linking)
        self.assertEqual((status, output), (130, "tricoil run\n"))
        self.assertTrue(self.program.exists())
        self.assertFalse((self.root / "build/run/previous_tricoil").exists())
        self.replace("toolchain/build", BUILD)
        self.assertIn("run: all is built", self.run_script("run").stderr)


CTEST = """
echo "ctest $*" >>"$CALLS"
echo "1/2 Test #1: a ... Passed"
if [[ "$*" == *"${FAILING:-none}"* ]]; then
    printf '50%% tests passed, 1 tests failed out of 2\\n\\nTotal Test time (real) = 1 sec\\n\\nThe following tests FAILED:\\n\\t  2 - b (Failed)\\n'
    exit 8
fi
printf '100%% tests passed, 0 tests failed out of 5\\n\\nTotal Test time (real) = 1 sec\\n'
"""


class Test(FakeMachine):
    QUICK = ["install first-pose", "install test-build", "build host-release", "format", "ctest host-release", "build nucleo-g474re", "ctest nucleo-g474re", "budgets nucleo-g474re",
             "ctest host-release"]

    def setUp(self):
        super().setUp()
        self.replace("ctest", CTEST)
        self.fake("toolchain/install-deps", "install", "LACKING", 3)
        self.fake("toolchain/build", "build", "BROKEN", 1)
        self.fake("toolchain/budgets", "budgets", "OVER", 1)
        self.fake("toolchain/test-kernel", "kernel", "NO_KERNEL", 3)
        self.fake("tests/fuzz/run", "fuzz", "FINDING", 1)
        self.replace("toolchain/check-style", 'echo "format" >>"$CALLS"')

    def fake(self, script, name, variable, status):
        """Records its call; fails if the environment variable is a word of its arguments."""
        self.replace(script, f'echo "{name} $*" >>"$CALLS"\n[[ " $* " != *" ${{{variable}:-nothing}} "* ]] || exit {status}')

    def parts(self):
        """The calls, of ctest only the preset; without those beside the host's build and the installation of its packages."""
        return [" ".join(line.split()[:3:2]) if line.startswith("ctest") else line for line in self.log_of_calls() if line not in ("install test", "build run tricoil_before_packages")]

    def test_default_set(self):
        done = self.run_script("test")
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        self.assertEqual(self.parts(), self.QUICK)
        self.assertEqual(done.stdout.splitlines()[-1], "100% tests passed, 0 tests failed out of 15")

    def test_programs_of_tests_are_installed_while_the_host_is_built(self):
        installing, built = self.folder / "installing", self.folder / "built"
        self.replace("toolchain/install-deps", f'[ $1 != test ] || {{ touch {installing}; while [ ! -e {built} ]; do sleep 0.1; done; echo "install test" >>"$CALLS"; }}')
        self.replace("toolchain/build", f"while [ ! -e {installing} ]; do sleep 0.1; done; touch {built}")
        self.replace("id", "echo 0")
        self.assertEqual(self.run_script("test").returncode, 0)
        self.assertEqual(self.log_of_calls()[:2], ["install test", "format"])

    def test_programs_of_tests_with_a_password(self):
        self.replace("id", "echo 1000")
        self.replace("sudo", "exit 1")
        self.assertEqual(self.run_script("test").returncode, 0)
        self.assertEqual(self.log_of_calls()[:4], ["install first-pose", "install test-build", "build host-release", "install test"])

    def test_failed_part_hides_no_other(self):
        for environment, named in (({"FAILING": "^quick$"}, "host: quick tests"), ({"OVER": "nucleo-g474re"}, "nucleo-g474re: budgets"),
                                   ({"FAILING": "^quick-nucleo"}, "nucleo-g474re: host tests")):
            self.calls.write_text("")
            done = self.run_script("test", **environment)
            self.assertEqual(done.returncode, 1)
            self.assertEqual(self.parts(), self.QUICK)
            self.assertEqual(done.stderr.splitlines()[-1], f"test: failed: {named}")

    def test_failed_tests_are_named_and_counted(self):
        done = self.run_script("test", FAILING="^quick$")
        self.assertIn("The following tests FAILED:\n\t  2 - b (Failed)\n", done.stdout)
        self.assertEqual(done.stdout.splitlines()[-1], "91% tests passed, 1 tests failed out of 12")

    def test_parts_that_need_a_failed_part_are_named(self):
        done = self.run_script("test", BROKEN="host-release")
        self.assertEqual(done.returncode, 1)
        self.assertEqual(self.parts(), [name for name in self.QUICK if name != "ctest host-release"])
        self.assertEqual(done.stderr.splitlines()[-2:], ["test: failed: host: build", "test: not run: host: quick tests (needs host: build); "
                                                         "nucleo-g474re: host tests (needs builds of host and image)"])

    def test_machine_that_lacks_something(self):
        done = self.run_script("test", LACKING="test")
        self.assertEqual((done.returncode, self.parts()), (3, self.QUICK))
        self.assertEqual(done.stderr.splitlines()[-1], "test: this machine lacks something for: packages: programs of tests")
        self.assertEqual(self.run_script("test", LACKING="test", OVER="nucleo-g474re").returncode, 1)

    def test_other_parts(self):
        self.assertEqual(self.run_script("test", "--fuzz").returncode, 0)
        self.assertEqual(self.parts(), ["install fuzz", "fuzz 20"])
        self.calls.write_text("")
        self.assertEqual(self.run_script("test", "--kernel").returncode, 0)
        self.assertEqual(self.parts(), ["install kernel", "build host-release", "build nucleo-g474re", "ctest nucleo-g474re", "kernel ", "ctest host-release"])
        self.assertNotIn("--repeat", self.calls.read_text())
        self.calls.write_text("")
        self.assertEqual(self.run_script("test", "--boards").returncode, 0)
        for preset in ("qemu-an386", "qemu-an385", "qemu-an500"):
            first = self.parts().index(f"build {preset}")
            self.assertEqual(self.parts()[first:first + 3], [f"build {preset}", f"ctest {preset}", f"budgets {preset}"])
        self.assertIn("build nucleo-g431kb", self.parts())
        self.assertIn("ctest --preset host-release --output-on-failure --no-tests=error -j", self.calls.read_text())

    def test_kernel_that_does_not_run(self):
        self.replace("toolchain/test-kernel", "exit 3")
        done = self.run_script("test", "--kernel", "--fuzz")
        self.assertEqual(done.returncode, 3)
        self.assertEqual(self.parts()[-1], "fuzz 20")
        self.assertIn("not run: test kernel: tests (needs test kernel: build)", done.stderr)

    def test_all_quick_parts_for_ci(self):
        shutil.copytree(ROOT / ".ci", self.root / ".ci")
        done = self.run_script("../.ci/run")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(self.parts()[:len(self.QUICK)], self.QUICK)
        for part in ("budgets qemu-an386", "budgets qemu-an385", "kernel ", "fuzz 20"):
            self.assertIn(part, self.parts())
        self.assertEqual(done.stdout.splitlines()[-1], "100% tests passed, 0 tests failed out of 45")
        done = self.run_script("../.ci/run", FINDING="20", FAILING="^quick$")
        self.assertEqual(done.returncode, 1)
        self.assertIn("test: failed: host: quick tests; fuzzing", done.stderr)
        self.assertEqual(done.stdout.splitlines()[-1], "97% tests passed, 1 tests failed out of 42")

    def test_unknown_option(self):
        self.fails("test", "--all", status=2, naming="unknown option '--all'; use --boards")

    def test_interrupt(self):
        started = self.folder / "started"
        self.replace("toolchain/build", f'exec toolchain/with-progress "build: $1" bash -c ": >{started}; sleep 30"')
        status, output, errors = self.interrupt("test", after=started)
        self.assertEqual((status, errors), (130, ""))
        self.assertTrue(output.endswith("test: host: build beside the packages\n"), output)


class Build(FakeMachine):
    CMAKE = """
        echo "cmake $* ($CMAKE_BUILD_PARALLEL_LEVEL)" >>"$CALLS"
        [ "$1" != --list-presets ] || printf '  "run"\\n  "host-release"\\n  "nucleo-g474re"\\n'
        if [ "$1" = --preset ] && [ -n "${ABSENT:-}" ]; then
            printf 'CMake Error at toolchain/cmake/Components.cmake:8 (message):\\n   tricoil needs %s\\nCall Stack\\n' "$ABSENT"
            exit 1
        fi
        if [ "$1" = --build ] && [ -n "${BROKEN:-}" ]; then echo "$BROKEN"; exit 1; fi
        if [ "$1" = --build ] && [ -n "${KILLED:-}" ]; then echo "g++: fatal error: Killed signal terminated program cc1plus"; exit 1; fi
    """

    def setUp(self):
        super().setUp()
        self.replace("cmake", self.CMAKE)
        self.replace("ninja", "true")
        self.replace("nproc", "echo 2")
        self.replace("toolchain/parallel-jobs", "echo 1")
        self.complete = self.root / "build/run/complete"

    def test_two_presets_in_one_folder(self):
        for preset in ("run", "host-release"):
            self.complete.unlink(missing_ok=True)
            self.assertEqual(self.run_script("build", preset).returncode, 0)
            self.assertTrue(self.complete.exists())
        self.assertEqual([path.name for path in (self.root / "build").iterdir()], ["run"])

    def test_only_a_whole_build_is_complete(self):
        self.assertEqual(self.run_script("build", "run", "tricoil").returncode, 0)
        self.assertFalse(self.complete.exists())
        self.run_script("build", "run")
        self.assertEqual(self.run_script("build", "run", KILLED="1").returncode, 1)
        self.assertFalse(self.complete.exists())

    def test_jobs(self):
        self.run_script("build", "run")
        self.assertIn("cmake --build --preset run (1)", self.log_of_calls())
        self.run_script("build", "run", "tricoil", CMAKE_BUILD_PARALLEL_LEVEL="5")
        self.assertIn("cmake --build --preset run --target tricoil (5)", self.log_of_calls())

    def test_killed_compiler(self):
        done = self.run_script("build", "run", KILLED="1")
        self.assertEqual(done.returncode, 1)
        self.assertEqual(done.stderr.splitlines()[-1],
                         "build: a compiler was killed, probably for lack of memory: cmake -D TRICOIL_SMALL_MEMORY=ON build/run, "
                         "then CMAKE_BUILD_PARALLEL_LEVEL=1 toolchain/build run")
        done = self.run_script("build", "run", BROKEN="collect2: fatal error: ld terminated with signal 9 [Killed]")
        self.assertIn("build: a compiler was killed", done.stderr)

    def test_disk_is_full(self):
        done = self.run_script("build", "run", BROKEN="as: build/run/x.o: No space left on device")
        self.assertEqual((done.returncode, done.stderr.splitlines()[-1]), (3, "build: no space left for build/run: make space"))

    def test_page_cannot_be_downloaded(self):
        self.fails("build", "run", status=3, naming="build: page-libraries: cannot download x: cmake -D TRICOIL_WITH_WEB=OFF build/run",
                   BROKEN="page-libraries: cannot download x")
        self.assertEqual(self.log_of_calls()[-1], "cmake --build --preset run -- -k 0 (1)", "everything else is built")

    def test_failed_configuration_of_tests_leaves_the_program(self):
        self.fails("build", "host-release", status=3, naming="build: tricoil needs gtest", ABSENT="gtest")
        self.assertIn("cmake --preset run -D TRICOIL_TESTS=OFF ()", self.log_of_calls())

    def test_cmake_that_cannot_read_the_presets(self):
        self.replace("cmake", "echo 'CMake Error: Unrecognized \"version\" field'; exit 1")
        self.fails("build", "run", status=3, naming="this CMake cannot read the presets: CMake Error: Unrecognized")

    def test_machine_lacks_something(self):
        self.fails("build", "run", status=3, naming="build: tricoil needs fmt: install libfmt-dev", ABSENT="fmt: install libfmt-dev")
        self.replace("df", "echo Avail; echo 30")
        self.fails("build", "run", status=3, naming="build/run has 30 MB of free space and needs 500: make space")
        (self.programs / "ninja").unlink()
        self.fails("build", "run", status=3, naming="no ninja: run toolchain/install-deps run")
        (self.programs / "cmake").unlink()
        self.fails("build", "run", status=3, naming="no cmake: run toolchain/install-deps run")


class ParallelJobs(FakeMachine):
    def jobs(self, available_mb, group=None, total_mb=9000):
        meminfo = self.folder / "meminfo"
        meminfo.write_text(f"MemTotal: {total_mb * 1024} kB\nMemAvailable: {available_mb * 1024} kB\n")
        folder = self.folder / "group"
        folder.mkdir(exist_ok=True)
        for name, text in (group or {"memory.max": "max"}).items():
            (folder / name).write_text(f"{text}\n")
        return self.run_script("parallel-jobs", meminfo, folder)

    def test_one_per_processor_and_what_a_compiler_needs(self):
        self.replace("nproc", "echo 4")
        for available_mb, jobs in ((1300, 1), (2399, 1), (2400, 2), (4800, 4), (64000, 4)):
            done = self.jobs(available_mb)
            self.assertEqual((done.returncode, done.stdout, done.stderr), (0, f"{jobs}\n", ""), available_mb)

    def test_a_compiler_needs_less_on_a_small_machine(self):
        self.replace("nproc", "echo 4")
        for available_mb, jobs in ((800, 1), (1399, 1), (1400, 2), (2800, 4)):
            self.assertEqual(self.jobs(available_mb, total_mb=3900).stdout, f"{jobs}\n", available_mb)

    def test_too_little_memory(self):
        done = self.jobs(300)
        self.assertEqual(done.stdout, "1\n")
        self.assertIn("300 MB of memory are free and one compiler needs up to 1200", done.stderr)
        self.assertEqual(len(done.stderr.splitlines()), 1)

    def test_container(self):
        self.replace("nproc", "echo 4")
        mb = 1 << 20
        group = {"memory.max": 2000 * mb, "memory.current": 900 * mb, "memory.stat": f"anon 5\ninactive_file {400 * mb}"}
        self.assertEqual(self.jobs(64000, group).stdout, "2\n")  # 1,500 MB, and 700 MB for each compiler
        self.assertEqual(self.jobs(3000, group, total_mb=3900).stdout, "2\n")
        self.assertEqual(self.jobs(800, group).stdout, "1\n")


class Costs(FakeMachine):
    def test_processor_time_of_a_command(self):
        began_s = time.monotonic()
        done = self.run_script("cmake/launch", "bash", "-c", "sleep 1; echo compiled", "-o", "core/unit.o")
        self.assertEqual((done.returncode, done.stdout), (0, "compiled\n"))
        self.assertGreater(time.monotonic() - began_s, 1)
        self.assertRegex((self.folder / ".costs/core/unit.o").read_text().splitlines()[-1], r"^0m0\.[0-4]\d*s 0m0\.[0-4]\d*s$")

    @unittest.skipUnless(os.access("/usr/bin/time", os.X_OK), "GNU time is not installed")
    def test_memory_of_a_command(self):
        for mb in (60, 120):
            command = f"import subprocess, sys; subprocess.run([sys.executable, '-c', 'b\"x\" * {mb}000000'], check=True)"
            self.run_script("cmake/launch", sys.executable, "-c", command, "-o", "unit.o")
            kilobytes, *times = (self.folder / ".costs/unit.o").read_text().splitlines()
            self.assertTrue(1000 * mb < 1.024 * int(kilobytes) < 1000 * (mb + 50), kilobytes)
            self.assertEqual(len(times), 2, "and no line of an earlier run")

    def test_failed_command_has_no_cost(self):
        self.assertEqual(self.run_script("cmake/launch", "bash", "-c", "exit 4", "-o", "unit.o").returncode, 4)
        self.assertFalse((self.folder / ".costs/unit.o").exists())

    def test_table(self):
        build = self.root / "build/run"
        units = {"core/CMakeFiles/tricoil_core.dir/a.cpp.o": "0m2.50s 0m0.50s", "core/CMakeFiles/tricoil_core.dir/b.cpp.o": "1m1.00s 0m0.00s",
                 "board/host/tricoil": "0m0.25s 0m0.25s"}
        log = ["# ninja log v5"]
        for name, times in [*units.items(), ("core/libtricoil_core.a", None)]:
            (build / name).parent.mkdir(parents=True, exist_ok=True)
            (build / name).touch()
            if times:
                (build / ".costs" / name).parent.mkdir(parents=True, exist_ok=True)
                (build / ".costs" / name).write_text(f"0m0.00s 0m0.00s\n{times}\n")
            log.append(f"1000\t3000\t0\t{name}\t0")
        log.append("0\t99000\t0\tremoved.o\t0")
        (build / ".ninja_log").write_text("\n".join(log) + "\n")
        done = self.run_script("build", "--costs", "host-release")
        self.assertEqual(done.returncode, 0, done.stderr)
        for row in (r"core/tricoil_core +64\.0 +2", r"\(link\) +0\.5 +1", r"\(other commands, wall time\) +2\.0 +1", r"all +66\.5 +4",
                    r"core/tricoil_core: b\.cpp\.o +61\.0 +1"):
            self.assertRegex(done.stdout, row)
        self.assertIn("limit: 1100 MB", done.stdout)
        unit = build / ".costs/core/CMakeFiles/tricoil_core.dir/a.cpp.o"
        unit.write_text("900000\n" + unit.read_text())
        self.assertRegex(self.run_script("build", "--costs", "host-release").stdout, r"core/tricoil_core: a\.cpp\.o +900 MB")
        (build / "CMakeCache.txt").write_text("TRICOIL_SANITIZE:STRING=\nTRICOIL_SMALL_MEMORY:BOOL=ON\n")
        self.fails("build", "--costs", "host-release", status=1, naming="core/tricoil_core: a.cpp.o needs more than 700 MB")
        (build / "CMakeCache.txt").write_text("TRICOIL_SANITIZE:STRING=address\nTRICOIL_SMALL_MEMORY:BOOL=ON\n")
        self.assertEqual(self.run_script("build", "--costs", "host-release").returncode, 0)

    def test_nothing_built(self):
        self.fails("build", "--costs", "host-debug", status=2, naming="run toolchain/build host-debug")


if __name__ == "__main__":
    unittest.main()
