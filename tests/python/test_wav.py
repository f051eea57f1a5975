"""From the WAV file of a simulation to live poses: `run --record-wav`, `demodulate`, `run --device couplings:`."""

import csv
import json
import os
import struct
import subprocess
import unittest

import numpy as np
from folder_case import FolderCase
from tricoil import demodulate
from tricoil._wav_samples import WavSamples

FRAMES_PER_S = 240
COUPLING_CONSTANT_M3 = 6.75e-3  # of the simulation
REFERENCE_HZ = 10_000  # a coil's voltage is proportional to the frequency; at this one, the simulation's couplings are shares of the current
SETTLED_US = 500_000
CALIBRATION = """version = 1
model = "concentric"
[source]
moment = [[{0}, 0, 0], [0, {1}, 0], [0, 0, {2}]]
[sensor]
sensitivity = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
"""


class Stream:
    def __init__(self, path):
        self.path, self.file = path, open(path, "rb")

    def read(self):
        return self.file.read(1 << 16)


def samples_of(path):
    stream = Stream(path)
    wav = WavSamples(stream, stream.read())
    parts = []
    while (part := wav.next()) is not None:
        parts.append(part)
    stream.file.close()
    return wav.rate_hz, np.concatenate(parts)


class Wav(FolderCase):
    def program(self, *words, code=0):
        done = subprocess.run([os.environ["TRICOIL_PROGRAM"], *map(str, words)], capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, code, done.stderr)
        return done

    def run_and_record(self, rate_hz, *words):
        """Summary of a simulated run, and its samples in hand.wav."""
        return json.loads(self.program("run", "--sample-rate-hz", rate_hz, "--record-wav", self.path("hand.wav"), "--json", *words).stdout)

    def poses(self, name):
        with open(self.path(name), encoding="utf-8") as file:
            return {int(row["time_us"]): row for row in csv.DictReader(file)}

    def position_rms(self, poses, truth):
        errors = []
        for time_us, true in truth.items():
            near = [poses[time_us + shift] for shift in (0, -1, 1) if time_us + shift in poses]
            if time_us > SETTLED_US and near and near[0]["valid"] == "1" and true["valid"] == "1":
                errors.append([float(near[0][axis]) - float(true["true_" + axis]) for axis in ("x_m", "y_m", "z_m")])
        self.assertGreater(len(errors), 700)
        return np.sqrt(np.mean(np.sum(np.square(errors), axis=1)))

    def test_poses_are_as_good_as_those_of_the_run(self):
        for rate_hz in (48_000, 192_000):
            summary = self.run_and_record(rate_hz, "--duration", 4, "--out", self.path("run.csv"))
            carriers = summary["acquisition"]["carrier_hz"]
            self.program("demodulate", self.path("hand.wav"), "--carriers", ",".join(map(str, carriers)), "--block", rate_hz // FRAMES_PER_S,
                         "--reference", 4, "--out", self.path("couplings.csv"))
            with open(self.path("coils.toml"), "w", encoding="utf-8") as file:
                file.write(CALIBRATION.format(*(COUPLING_CONSTANT_M3 * hz / REFERENCE_HZ for hz in carriers)))
            self.program("run", "--device", f"couplings:{self.path('couplings.csv')},mux=fdm", "--calibration", self.path("coils.toml"),
                         "--out", self.path("poses.csv"))
            truth = self.poses("run.csv")
            ratio = self.position_rms(self.poses("poses.csv"), truth) / self.position_rms(truth, truth)
            print(f"{rate_hz} Hz: position error {ratio:.3f} of that of the run", flush=True)
            self.assertLess(ratio, 1.2)
            self.assertGreater(ratio, 0.8)

    def test_the_file_is_that_of_the_converters(self):
        summary = self.run_and_record(48_000, "--duration", 1.001, "--scenario", "still")
        rate_hz, samples = samples_of(self.path("hand.wav"))
        self.assertEqual((rate_hz, samples.shape), (48_000, (48_000, 4)))
        with open(self.path("hand.wav"), "rb") as file:
            head = file.read(44)
        self.assertEqual(struct.unpack("<4sI4s", head[:12]), (b"RIFF", 36 + 48_000 * 16, b"WAVE"))
        self.assertEqual(struct.unpack("<HHIIHH", head[20:36]), (1, 4, 48_000, 768_000, 16, 32))
        current = 0.5 * REFERENCE_HZ / np.array(summary["acquisition"]["carrier_hz"]) / 2.5  # amplitude, of the full scale of 2.5 V
        spectrum = abs(np.fft.rfft(samples[24_000:, 3])) / 12_000
        np.testing.assert_allclose([spectrum[round(hz / 2)] for hz in summary["acquisition"]["carrier_hz"]], current, rtol=1e-3)
        piped = self.path("piped.wav")
        with open(piped, "wb") as file:
            subprocess.run([os.environ["TRICOIL_PROGRAM"], "run", "--sample-rate-hz", "48000", "--duration", "1.001", "--scenario", "still", "--record-wav", "-"],
                           stdout=file, stderr=subprocess.DEVNULL, check=True)
        np.testing.assert_array_equal(samples_of(piped)[1], samples)

    def test_lost_blocks_are_silent(self):
        self.run_and_record(48_000, "--duration", 1, "--scenario", "still", "--fault", "dropped_blocks:1@0.25-0.5")
        _, samples = samples_of(self.path("hand.wav"))
        self.assertEqual(samples.shape, (48_000, 4))
        self.assertTrue((samples[12_200:23_800] == 0).all())
        self.assertTrue((abs(samples[24_400:, 3]).reshape(-1, 200).max(axis=1) > 0.1).all())
        with self.assertRaisesRegex(ValueError, "the reference drops out in repeat"):
            demodulate(self.path("hand.wav"), (7680, 10080, 13440), block=200, reference=4)

    def test_live(self):
        """A growing pipe: poses arrive before the samples end."""
        words = f"""'{os.environ["TRICOIL_PROGRAM"]}' -q run --scenario still --realtime --duration 6 --sample-rate-hz 48000 --record-wav - 2>/dev/null |
            '{os.environ["TRICOIL_PROGRAM"]}' -q demodulate --follow - --carriers 7680,10080,13440 --block 200 --reference 4 --out - 2>/dev/null |
            '{os.environ["TRICOIL_PROGRAM"]}' -q run --device columns:-,mux=fdm --json-lines - 2>/dev/null | ( head -1; date +%s.%N; cat > /dev/null ); date +%s.%N"""
        done = subprocess.run(["sh", "-c", words], capture_output=True, text=True, check=True)
        first, at_pose, at_end = done.stdout.splitlines()
        self.assertIn("position", json.dumps(json.loads(first)))
        self.assertGreater(float(at_end) - float(at_pose), 1)

    def test_what_cannot_be_recorded(self):
        for words, message in ((("--mux", "tdm"), "--record-wav: only with --mux fdm"), (("--stations", 2), "one sensor"), (("--fidelity", "columns"), "samples"),
                               (("--device", "can:vcan0"), "--record-wav: not with a device"), (("--sample-rate-hz", 44_100), "--sample-rate-hz 44100: a block"),
                               (("--sample-rate-hz", 24_000), "Nyquist"), (("--sample-rate-hz", "nan"), "--sample-rate-hz"), (("--sample-rate-hz", 0), "positive"),
                               (("--record-wav", "-", "--out", "-"), "exclude each other"), (("--record-wav", "-", "--json-lines", "-"), "exclude each other")):
            given = () if words[0] == "--record-wav" else ("--record-wav", self.path("no.wav"))
            done = self.program("run", "--duration", 0.1, *given, *words, code=2)
            self.assertRegex(done.stderr, f"^tricoil: [^\n]*{message}[^\n]*\n$")
            self.assertFalse(os.path.exists(self.path("no.wav")))


if __name__ == "__main__":
    unittest.main()
