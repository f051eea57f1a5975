#!/usr/bin/env python3
"""Every output of every command, on a full disk, on a slow one, and as the name of an input file. The table of commands and outputs comes from the help: a command or an
option without a row fails.

  output_table_test.py TRICOIL FAULT_INJECTION    environment: TRICOIL_FRONT_END, TRICOIL_WITH_PYTHON=0: without the package
"""
import os
import pathlib
import re
import resource
import shutil
import subprocess
import sys
import tempfile
import unittest

ENOSPC = 28
MOST_MEMORY = 8 << 30  # of the address space; files of up to 256 MiB are read, as text of several bytes a character
DELAY_MS = 5
HERE = pathlib.Path(__file__).resolve().parent
STAGE = "stage/soYoutZup_seYoutZup_1.dat"
SIMULATED = "--scenario still --duration 0.3"
COILS = "--model concentric"
DESIGN = "--turns 40 --radius 0.03 --current 1 --noise 3e-9"
# Options with a name of a file or folder that is read.
INPUTS = {"--board", "--calibration", "--chain", "--config", "--converters-from", "--dynamic", "--generator", "--hand-motion", "--high", "--imu", "--joints", "--low", "--path", "--poses", "--reference", "--stage-from", "--tip", "--trajectory", "--wiring"}
STDOUT = "standard output"
PYTHON = {"bench", "calibrate converters", "calibrate free-motion", "calibrate grid", "calibrate stage", "calibrate low-band", "calibrate pick-up", "calibrate pivot", "calibrate surroundings", "calibrate wiring", "couplings", "demodulate", "design", "evaluate", "figures", "generator calibrate", "generator simulate", "generator solve", "generator track", "motion", "plot", "protocol", "truth"}  # commands that need the Python package


class Elsewhere(str):
    """Why this output has no row: the test that checks it, or what it needs."""


TRACKER_BOARD = Elsewhere("only a tracker board obeys; its line is printed like that of device write-calibration")

# Command: {output: words}. {out}: the path of the output; {device}: a simulated tracker.
ROWS = {
    "run": {STDOUT: SIMULATED, "--record": SIMULATED + " --record {out}", "--out": SIMULATED + " --out {out}",
            "--json-lines": SIMULATED + " --json-lines -", "--couplings": SIMULATED + " --couplings {out}",
            "--record-wav": SIMULATED + " --record-wav {out}", "--samples": SIMULATED + " --tracker fixed-direct --samples {out}"},
    "serve": {STDOUT: SIMULATED + " --web 0", "--json-lines": SIMULATED + " --json-lines -", "--record": SIMULATED + " --web 0 --record {out}",
              "--token-file": SIMULATED + " --web 0 --token-file {out}",
              "--record-folder": Elsewhere("RecordingSwitchTest.ReportsAFailedRecordingWithItsReason, SlowDisk.ARecordingFromThePageDelaysNoPose")},
    "demo": {STDOUT: "--web 0 --json --step 0.2"},
    "replay": {STDOUT: "take", "--out": "take --out {out}"},
    "smooth": {STDOUT: "take --out smooth.csv", "--out": "take --out {out}"},
    "convert": {STDOUT: "take", "--out": "take --out {out}"},
    "plot": {STDOUT: "take --out take.svg", "--out": "take --out {out}.svg"},
    "calibrate stage": {STDOUT: f"{COILS} --out cal.toml {STAGE}", "--out": f"{COILS} --out {{out}} {STAGE}",
                        "--blob": f"{COILS} --out cal.toml --blob {{out}} {STAGE}"},
    "calibrate converters": {STDOUT: f"{COILS} --out cal.toml rests.csv", "--out": f"{COILS} --out {{out}} rests.csv",
                             "--blob": f"{COILS} --out cal.toml --blob {{out}} rests.csv"},
    "calibrate grid": {STDOUT: f"{COILS} --spacing-mm 50 --out cal.toml grid.csv", "--out": f"{COILS} --spacing-mm 50 --out {{out}} grid.csv",
                       "--blob": f"{COILS} --spacing-mm 50 --out cal.toml --blob {{out}} grid.csv"},
    "calibrate free-motion": {STDOUT: "--out cal.toml motion.csv", "--out": "--out {out} motion.csv",
                              "--blob": f"{COILS} --coupling-constant 6.75e-3 --out cal.toml --blob {{out}} motion.csv"},
    "calibrate surroundings": {STDOUT: "--calibration coils.toml --out room.toml soYoutZup_seYoutZup_table.csv",
                               "--out": "--calibration coils.toml --out {out} soYoutZup_seYoutZup_table.csv",
                               "--blob": "--calibration coils.toml --out room.toml --blob {out} soYoutZup_seYoutZup_table.csv"},
    "calibrate low-band": {STDOUT: "--calibration coils.toml --out both.toml turned", "--out": "--calibration coils.toml --out {out} turned"},
    "calibrate pick-up": {STDOUT: "--calibration coils.toml --out quiet.toml dummy", "--out": "--calibration coils.toml --out {out} dummy",
                          "--blob": "--calibration coils.toml --out quiet.toml --blob {out} dummy"},
    "calibrate pivot": {STDOUT: "pivot1", "--out": "pivot1 --out {out}"},
    "calibrate wiring": {STDOUT: "--at 0.4,0.2,0.1 frames.csv", "--out": "--at 0.4,0.2,0.1 --out {out} frames.csv"},
    "evaluate": {STDOUT: f"--calibration coils.toml {STAGE}", "--out": f"--calibration coils.toml --out {{out}} {STAGE}"},
    "couplings": {STDOUT: "--high high.csv --low low.csv --ratio 8 --rate-hz 300 --calibration bands.json --out bands.csv",
                  "--out": "--high high.csv --low low.csv --ratio 8 --rate-hz 300 --calibration bands.json --out {out}"},
    "bench": {STDOUT: "divots.csv --board board.csv", "--out": "divots.csv --board board.csv --out {out}"},
    "demodulate": {STDOUT: "capture.csv --carrier-hz 10000 --rate-hz 200000", "--out": "capture.csv --carrier-hz 10000 --rate-hz 200000 --out {out}"},
    "design": {STDOUT: DESIGN, "--plot": DESIGN + " --plot {out}.svg", "--scenario": DESIGN + " --scenario {out}.toml", "--grid-pdf": "--grid-pdf {out}.pdf"},
    "truth": {STDOUT: "optics.csv", "--out": "optics.csv --out {out}", "--plot": "optics.csv --plot {out}.svg"},
    "generator simulate": {STDOUT: "--out coil.csv", "--out": "--out {out}", "--save": "--out /dev/null --save {out}"},
    "generator solve": {STDOUT: "coil.csv --generator planar.toml", "--out": "coil.csv --generator planar.toml --out {out}"},
    "generator track": {STDOUT: "needle.csv --generator planar.toml --slot-s 0.003", "--out": "needle.csv --generator planar.toml --slot-s 0.003 --out {out}"},
    "generator calibrate": {STDOUT: "coil.csv --out generator.toml", "--out": "coil.csv --out {out}"},
    "device list": {STDOUT: ""},
    "device info": {STDOUT: "{device}"},
    "device watch": {STDOUT: "{device} --duration 0.5"},
    "device read-calibration": {STDOUT: "{device} --out read.bin", "--out": "{device} --out {out}"},
    "device write-calibration": {STDOUT: "{device} coils.bin"},
    "device mode": {STDOUT: TRACKER_BOARD},
    "device config": {STDOUT: TRACKER_BOARD},
    "device hemisphere": {STDOUT: TRACKER_BOARD},
    "device boresight": {STDOUT: TRACKER_BOARD},
    "device loader": {STDOUT: "{device}"},
    "device update": {STDOUT: TRACKER_BOARD},
    "device capture": {STDOUT: "{device} --out samples.csv", "--out": "{device} --out {out}"},
    "doctor": {STDOUT: ""},
    "selfcheck": {STDOUT: ""},
    "protocol": {STDOUT: "", "--dbc": "--dbc {out}", "--page": "--page {out}"},
    "motion": {STDOUT: "--example I", "--out": "--example I --out {out}", "--plot": "--poses take/poses.csv --timing tdm:3/720 --plot {out}.svg", "--plan": "--plan {out}"},
    "figures": {STDOUT: "--out pictures --csv-only", "--out": "--out {out}"},
    "help": {STDOUT: "run"},
    "completion": {STDOUT: "bash"},
}

# Rows with inputs that ROWS has not. {folder}, {errors}: a folder in which dynamic_errors.csv or pose_errors.csv is written.
READING = {"convert": ["{input} --to csv --out {out}"], "evaluate": ["--dynamic ground.csv {input} --out {folder}", "--calibration coils.toml {input} --out {errors}",
                                                                     f"--calibration {{input}} {STAGE} --out {{errors}}"],
           "motion": ["--poses {input} --timing fdm --out {out}", "--poses poses.csv --reference {input} --timing fdm --out {out}",
                      "--poses poses.csv --reference {input} --timing fdm --plot {out}.svg", "--trajectory {input} --out {out}"],
           "calibrate pivot": ["{input} --out {out}"], "plot": ["{input} --out {out}.svg"]}
ONLY_READING = {"evaluate", "motion"}  # their options depend on each other: no other rows


def entries(text):
    """Words at the beginning of the indented lines of a help, with the help of each, in sections that are not examples."""
    text = text.split("\nExamples:")[0]
    return [(entry[0], " ".join(entry[1].split())) for entry in re.findall(r"\n  (\S.*?)(?:  +|\n {26})((?:.*)(?:\n {10,}.*)*)", text)]


def has_subcommands(text):
    return re.search(r"^Usage: tricoil \S+ COMMAND", text, re.M) is not None


class OutputTable(unittest.TestCase):
    program = ""
    injection = ""

    @classmethod
    def setUpClass(cls):
        cls.place = tempfile.TemporaryDirectory()
        cls.folder = pathlib.Path(cls.place.name)
        path = f"{pathlib.Path(cls.program).parent}:{os.environ['PATH']}"
        examples = cls.folder / "examples"
        subprocess.run([sys.executable, HERE.parent / "docs/prepare_examples", examples], env={**os.environ, "PATH": path}, check=True)
        cls.examples = examples
        optics = examples / "optics.csv"
        optics.write_text("".join(optics.read_text().splitlines(True)[:161]))  # 2 s: these tests are of files, not of paths
        for words in ("run --scenario still --duration 1 --record take", f"calibrate stage {COILS} --out coils.toml --blob coils.bin {STAGE}",
                      "run --scenario table --fidelity columns --couplings soYoutZup_seYoutZup_table.csv",
                      "run --mux dual-band --duration 10 --record turned", "run --scenario dummy --duration 10 --record dummy", "run --scenario pointer --record pivot1"):
            is_built = not words.startswith("calibrate") or os.environ.get("TRICOIL_WITH_PYTHON") != "0"
            subprocess.run([cls.program, *words.split()], cwd=examples, check=is_built, capture_output=True)

    @classmethod
    def tearDownClass(cls):
        cls.place.cleanup()

    def run_row(self, command, words, fault="", stdout=None):
        """The ended program. The folder of the examples is the current one."""
        environment = {**os.environ, "XDG_CONFIG_HOME": "/nonexistent", "ASAN_OPTIONS": "verify_asan_link_order=0"}
        if fault:
            environment |= {"LD_PRELOAD": self.injection, "TRICOIL_FAULT": fault}
        device = None
        if "{device}" in words:
            device = subprocess.Popen([os.environ["TRICOIL_FRONT_END"], "--pace", "real", *(["--calibration", "coils.bin"] if (self.examples / "coils.bin").exists() else [])], cwd=self.examples,
                                      stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
            words = words.replace("{device}", "serial:" + device.stdout.readline().split()[-1])
        try:
            with open(stdout or os.devnull, "w", encoding="utf-8") as file:
                return subprocess.run([self.program, *command.split(), *words.split()], cwd=self.examples, env=environment, stdout=file,
                                      stderr=subprocess.PIPE, stdin=subprocess.DEVNULL, text=True, timeout=600, check=False)
        finally:
            if device:
                device.kill()
                device.wait()
                device.stdout.close()

    def help_of(self, command):
        return subprocess.run([self.program, *command.split(), "--help"], capture_output=True, text=True, check=True).stdout

    def commands(self):
        for name, _ in entries(self.help_of("")):
            if not re.fullmatch(r"[a-z-]+", name) or name.startswith("-"):
                continue
            text = self.help_of(name)
            names = [sub for sub, _ in entries(text) if re.fullmatch(r"[a-z][a-z-]+", sub)] if has_subcommands(text) else []
            yield from [f"{name} {sub}" for sub in names] or [name]

    def test_every_output_of_the_help_has_a_row(self):
        commands = list(self.commands())
        self.assertEqual(sorted(commands), sorted(ROWS))
        for command in commands:
            outputs = {STDOUT}
            for entry, text in entries(self.help_of(command)):
                option = re.match(r"--[a-z-]+", entry)
                if option and option[0] not in INPUTS and (re.search(r" (FILE|FOLDER)$", entry) or STDOUT in text):
                    outputs.add(option[0])
            self.assertEqual(outputs, set(ROWS[command]), command)

    def rows(self):
        for command, outputs in ROWS.items():
            for output, words in outputs.items():
                in_python = command in PYTHON or "coils." in words or command == "device read-calibration"
                is_built = not in_python or os.environ.get("TRICOIL_WITH_PYTHON") != "0"
                if is_built and not isinstance(words, Elsewhere):
                    yield command, output, words

    def reading_rows(self):
        """Command and words with {input} for one of the files that it reads: in a row, or by another option of the help."""
        for command, _, words in self.rows():
            if command not in PYTHON - ONLY_READING or "{out}" not in words:
                continue
            parts = words.split()
            files = [n for n, word in enumerate(parts) if (self.examples / word).is_file() and parts[n - 1] != "--out"]
            yield from ((command, " ".join([*parts[:n], "{input}", *parts[n + 1:]])) for n in files)
            options = {entry.split()[0] for entry, _ in entries(self.help_of(command)) if entry.endswith(" FILE")}
            yield from ((command, f"{words} {option} {{input}}") for option in sorted(options & INPUTS - {"--tip", *parts}))  # --tip: no picture is a .toml
        if os.environ.get("TRICOIL_WITH_PYTHON") != "0":
            yield from ((command, row) for command, rows in READING.items() for row in rows)

    def test_no_output_replaces_an_input(self):
        """The output is a link to the input."""
        seen = set()
        for command, words in self.reading_rows():
            with self.subTest(command, words=words):
                out = self.fresh()
                out.mkdir()
                name = "dynamic_errors.csv" if "{folder}" in words else "pose_errors.csv" if "{errors}" in words else "link" + words.partition("{out}")[2].split(" ")[0]
                kept, link = out / "kept.csv", out / name
                kept.write_bytes((self.examples / "optics.csv").read_bytes())
                link.symlink_to(kept)
                done = self.run_row(command, words.format(out=out / "link", folder=out, errors=out, input=kept))
                self.assertEqual(done.returncode, 2, done.stderr)
                self.assertRegex(done.stderr, rf"^tricoil: --[a-z-]+ {re.escape(str(link))}: is also an input file; choose another file\n$")
                self.assertEqual(kept.read_bytes(), (self.examples / "optics.csv").read_bytes())
                seen.add(command)
        if os.environ.get("TRICOIL_WITH_PYTHON") != "0":
            self.assertEqual(seen, PYTHON - {"design", "figures", "protocol"} | READING.keys())

    def test_an_input_without_an_end_is_refused(self):
        """A link to a device that gives zeros for ever."""
        endless = self.folder / "endless.csv"
        endless.symlink_to("/dev/zero")
        limits = resource.getrlimit(resource.RLIMIT_AS)
        # One row of those that differ in their outputs alone: the word before the input tells which input it is.
        rows = {(command, " ".join(words.split()).partition("{input}")[0].split(" ")[-2:][0]): (command, words) for command, words in self.reading_rows()}
        for command, words in rows.values():
            with self.subTest(command, words=words):
                out = self.fresh()
                out.mkdir()
                resource.setrlimit(resource.RLIMIT_AS, (MOST_MEMORY, limits[1]))
                try:
                    done = self.run_row(command, words.format(out=out / "result", folder=out, errors=out, input=endless))
                finally:
                    resource.setrlimit(resource.RLIMIT_AS, limits)
                self.assertEqual(done.returncode, 2, done.stderr)
                self.assertRegex(done.stderr, r"^tricoil: .+\n$")

    def fresh(self):
        """Path of an output that is not there."""
        for path in self.folder.glob("output*"):
            shutil.rmtree(path) if path.is_dir() else path.unlink()
        return self.folder / "output"

    def test_a_full_disk_is_told(self):
        for command, output, words in self.rows():
            out = self.fresh()
            is_stdout = output in (STDOUT, "--json-lines")
            with self.subTest(command, output=output):
                done = self.run_row(command, words.format(out=out, device="{device}"), "" if is_stdout else f"write:1:{ENOSPC}:{out}",
                                    "/dev/full" if is_stdout else None)
                self.assertIn(done.returncode, (2, 3), done.stderr)
                self.assertRegex(done.stderr, r"(?m)^tricoil: .*(No space left on device|is the disk full\?)")
                self.assertLessEqual(len(done.stderr.splitlines()), 1 if output not in ("--record", STDOUT) else 2, done.stderr)
                if output != "--record":
                    self.assertFalse([path for path in self.folder.glob("output*") if path.is_file()])

    def test_a_slow_disk_changes_nothing(self):
        """Of all outputs of a row at once: the standard output has no row of its own if the command has another one."""
        for command, output, words in self.rows():
            if output == STDOUT and len(ROWS[command]) > 1:
                continue
            out = self.fresh()
            with self.subTest(command, output=output):
                is_stdout = output in (STDOUT, "--json-lines")
                done = self.run_row(command, words.format(out=out, device="{device}"), f"delay:{DELAY_MS}:0:{out}", out if is_stdout else f"{out}.stdout")
                self.assertIn(done.returncode, (0, 1) if command == "doctor" else (0,), done.stderr)  # doctor judges this machine
                (self.folder / "output.stdout").unlink(missing_ok=True)
                self.assertTrue([path for path in self.folder.glob("output*") if path.is_dir() or path.stat().st_size > 0])


if __name__ == "__main__":
    OutputTable.program, OutputTable.injection = (os.path.abspath(path) for path in sys.argv[1:3])
    unittest.main(argv=sys.argv[:1] + sys.argv[3:], verbosity=2)
