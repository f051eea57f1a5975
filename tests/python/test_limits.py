"""Values beyond the limits are refused by every surface: C, Python, wire and command line."""

import ctypes
import json
import os
import socket
import subprocess
import unittest
import urllib.error
import urllib.request

import tricoil

PROGRAM = os.environ["TRICOIL_PROGRAM"]
GOOD = "0.1,0,0.2"
TIPS = ("1e308,0,0", "0,-1e308,1e308", "0,0,101", "-101,0,0", "nan,0,0", "0,inf,0", "0,0,-inf")  # m
HEMISPHERES = ("1e308,0,0", "-1e308,1e308,0", "1e-300,0,0", "nan,0,0", "0,inf,0", "0,0,-inf")


INCH_M = 0.0254


def numbers(text):
    return [float(part) for part in text.split(",")]


def in_inches(text):
    return ",".join(part if abs(float(part)) > 1e300 else str(float(part) / INCH_M) for part in text.split(","))


class C(unittest.TestCase):
    def setUp(self):
        self.library = ctypes.CDLL(os.environ["TRICOIL_LIBRARY"])
        self.library.tricoil_open.restype = ctypes.c_void_p
        self.tracker = ctypes.c_void_p(self.library.tricoil_open(b"sim:still", None, None, ctypes.c_size_t(0)))
        self.addCleanup(self.library.tricoil_close, self.tracker)

    def set(self, what, text):
        return getattr(self.library, f"tricoil_set_{what}")(self.tracker, 0, (ctypes.c_double * 3)(*numbers(text)))

    def test_values(self):
        for what, values in (("tip", TIPS), ("hemisphere", HEMISPHERES)):
            self.assertEqual([self.set(what, text) for text in values], [-1] * len(values))
            self.assertEqual(self.set(what, GOOD), 0)

    def test_a_status_is_one_line(self):
        self.library.tricoil_status.restype = ctypes.c_char_p
        error = ctypes.create_string_buffer(500)
        self.library.tricoil_open(b"sim:no\nsuch", None, error, ctypes.c_size_t(len(error)))
        self.assertIn(b"no such", error.value)
        name = b"serial:/dev/no\nsuch\x1b[31m"
        tracker = ctypes.c_void_p(self.library.tricoil_open(name, None, error, ctypes.c_size_t(len(error))))
        self.addCleanup(self.library.tricoil_close, tracker)
        pose = ctypes.create_string_buffer(1000)
        self.library.tricoil_poll(tracker, pose, 20)
        status = self.library.tricoil_status(tracker)
        self.assertIn(b"/dev/no such\\x1b[31m", status)


class Python(unittest.TestCase):
    def test_values(self):
        with tricoil.open("sim:still") as source:
            for setter, values in ((source.set_tip, TIPS), (source.set_hemisphere, HEMISPHERES)):
                for text in values:
                    with self.subTest(setter.__name__, value=text), self.assertRaises(ValueError):
                        setter(numbers(text))
                setter(numbers(GOOD))
            for widest in (1e308, 1.1, -1, float("nan")):
                with self.subTest(covariance=widest), self.assertRaises(ValueError):
                    source.set_tip(numbers(GOOD), covariance_m2=[[widest, 0, 0], [0, 1, 0], [0, 0, 1]])


class CommandLine(unittest.TestCase):
    def run_with(self, *options):
        return subprocess.run([PROGRAM, "run", "--scenario", "still", "--duration", "0.6", "--no-noise", *options],
                              capture_output=True, text=True, timeout=60, check=False)

    def test_values(self):
        for option, values in (("--tip", TIPS), ("--hemisphere", HEMISPHERES)):
            for text in values:
                with self.subTest(option, value=text):
                    done = self.run_with(f"{option}={text}", *(["--out", "-"] if option == "--tip" else []))
                    self.assertEqual(done.returncode, 2, done.stderr)
                    self.assertIn(option, done.stderr)
                    self.assertEqual(done.stderr.count("\n"), 1, done.stderr)
            self.assertEqual(self.run_with(f"{option}={GOOD}", "--out", "-").returncode, 0)

    def test_a_huge_number_is_told_briefly(self):
        self.assertIn("--rate-hz 1e+308 with", self.run_with("--rate-hz", "1e308").stderr)


class Wire(unittest.TestCase):
    def setUp(self):
        self.program = subprocess.Popen(
            [PROGRAM, "serve", "--json", "--fastrak", "tcp:0", "--web", "0", "--open-controls", "--scenario", "still"],
            stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        self.addCleanup(self.program.stdout.close)
        self.addCleanup(self.program.wait)
        self.addCleanup(self.program.terminate)
        self.addresses = json.loads(self.program.stdout.readline())

    def answer(self, command):
        host, port = self.addresses["fastrak"][0].split(":")
        with socket.create_connection((host, int(port)), timeout=30) as client, client.makefile("rb") as lines:
            client.sendall(command.encode() + b"\rX\r")  # X: its answer ends that of the command
            answers = []
            while not answers or b"X" not in answers[-1][:4]:
                answers.append(lines.readline())
            return b"".join(answers[:-1])

    def test_fastrak(self):
        for letter, values in (("N", [in_inches(text) for text in TIPS]), ("H", HEMISPHERES)):
            for text in values:
                with self.subTest(letter, value=text):
                    self.assertIn(b"*ERROR*", self.answer(f"{letter}1,{text}"))
            self.assertEqual(self.answer(f"{letter}1,{GOOD}"), b"")

    def control(self, vector):
        content = '{"hemisphere":[' + vector + "]}"
        request = urllib.request.Request(self.addresses["web"] + "control", content.encode(), {"Content-Type": "application/json"})
        try:
            with urllib.request.urlopen(request, timeout=30) as answer:
                return answer.status
        except urllib.error.HTTPError as error:
            with error:
                return error.code

    def test_page(self):
        for text in HEMISPHERES:
            with self.subTest(value=text):
                self.assertEqual(self.control(text), 400)
        self.assertEqual(self.control(GOOD), 200)


if __name__ == "__main__":
    unittest.main()
