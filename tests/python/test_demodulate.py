"""Couplings from raw captures: arrays, tables, WAV files and streams. The program's own tests are in tests/cli/demodulate_test.cpp."""

import json
import os
import random
import struct
import subprocess
import tempfile
import unittest

import numpy as np
import tricoil
from tricoil import _block_flags as flags
from tricoil._capture import open_capture
from tricoil._output_file import OutputFile
from tricoil._tone_fit import ToneFit
from tricoil._wav_samples import WavSamples

X = 40 * tricoil.couplings([0.4, 0.2, 0.15], [0.9, 0.1, -0.3, 0.3])  # up to 0.8 of the reference
CARRIERS_HZ = (45, 65, 80)
RATE_HZ = 1000.0


def at_once(count=6000, ppm=-450.0, noise=0.001, seed=1):
    """Samples (count, 4) of three coils at the same time: three channels of the sensor, the current."""
    phase = 2 * np.pi * np.outer(np.arange(count), CARRIERS_HZ) * (1 + 1e-6 * ppm) / RATE_HZ + 0.5 * np.arange(3)
    values = np.column_stack((np.cos(phase + 0.2) @ X.T, np.cos(phase).sum(axis=1)))
    return 0.25 * values + 0.05 + noise * np.random.default_rng(seed).normal(size=(count, 4))


def at_once_of(x):
    """The three channels of the sensor, with these couplings."""
    phase = 2 * np.pi * np.outer(np.arange(6000), CARRIERS_HZ) * (1 - 450e-6) / RATE_HZ + 0.5 * np.arange(3)
    return 0.25 * np.cos(phase + 0.2) @ x.T + 0.05


def in_turn(repeats=8, samples=200, noise=0.0005, seed=2):
    """Samples (repeats, 3, samples, 4) at 10 kHz of 200 kHz."""
    phase = 2 * np.pi * 0.05 * np.arange(repeats * 3 * samples).reshape(repeats, 3, samples)
    values = np.empty((repeats, 3, samples, 4))
    values[..., :3] = np.cos(phase + 0.4)[..., None] * X.T[:, None]
    values[..., 3] = np.cos(phase)
    return values + noise * np.random.default_rng(seed).normal(size=values.shape)


def wav(values, bits, code=1, rate_hz=1000, length=None):
    """Bytes of a WAV file."""
    if code == 3:
        data = values.astype(f"<f{bits // 8}").tobytes()
    else:
        codes = np.rint(values * 2.0 ** (bits - 1)).astype("<i4")
        data = codes.view(np.uint8).reshape(*values.shape, 4)[..., :bits // 8].tobytes()
    frame = values.shape[1] * bits // 8
    head = b"WAVEfmt " + struct.pack("<IHHIIHH", 16, code, values.shape[1], rate_hz, frame * rate_hz, frame, bits)
    head += b"LIST" + struct.pack("<I", 3) + b"abc\0" + b"data" + struct.pack("<I", len(data) if length is None else length)
    return b"RIFF" + struct.pack("<I", len(head) + len(data)) + head + data


def table(values, separator=",", names=""):
    return names + "".join(separator.join(f"{value:.6f}" for value in row) + "\n" for row in values)


class Bytes:
    path = "capture"

    def __init__(self, data, count=1 << 20):
        self.parts = [data[n:n + count] for n in range(0, len(data), count)]

    def read(self):
        return self.parts.pop(0) if self.parts else b""


class ToneFits(unittest.TestCase):
    def test_exact_in_blocks_of_any_length(self):
        w = np.array([0.31, 0.52])
        z = np.array([[1 + 2j, 0.5], [0.25j, -1]])  # by channel and tone
        for samples in (50, 97):
            n = np.arange(samples + 3)
            values = np.stack([7 + (z[c] * np.exp(1j * np.outer(n, w))).real.sum(axis=1) for c in range(2)], axis=1)
            amplitude, noise = ToneFit(w, samples).fit(values[None])
            np.testing.assert_allclose(amplitude[0], z, atol=1e-12)
            self.assertLess(noise.max(), 1e-12)

    def test_hum_and_drift_are_removed(self):
        n = np.arange(200)
        hum = sum(np.sin(2 * np.pi * 50 * harmonic * n / 48_000 + harmonic) / harmonic for harmonic in (1, 3, 5))  # 0.2 of a period
        tones = np.cos(2 * np.pi * np.outer(n, (32, 42, 56)) / 200).sum(axis=1)
        amplitude, _ = ToneFit(2 * np.pi * np.array([32, 42, 56]) / 200, 200).fit((tones + hum + 0.1 * n / 200)[None, :, None])
        np.testing.assert_allclose(amplitude[0, 0], 1, atol=1e-4)  # without a polynomial: 1e-2

    def test_noise_is_that_of_a_sample(self):
        values = np.random.default_rng(1).normal(0, 0.3, (400, 60, 4))
        _, noise = ToneFit(np.array([0.3]), 60).fit(values)
        self.assertAlmostEqual(np.sqrt(np.mean(noise**2)), 0.3, delta=0.003)


class Flags(unittest.TestCase):
    CARRIER = 0.5 * np.cos(2 * np.pi * 0.05 * np.arange(400))
    RUN = flags.natural_run([20], 400)

    def names(self, values, full_scale=1.0):
        found = flags.flags_of(values[None], full_scale, self.RUN)[0].any(axis=1)
        return [name for name, is_set in zip(flags.NAMES, found) if is_set]

    def channels(self):
        return np.column_stack([self.CARRIER] * 4)

    def test_each_fault_has_its_flag(self):
        self.assertEqual(self.RUN, 2)
        good = self.channels()
        self.assertEqual(self.names(good), [])
        for scale, name in ((2.1, ["saturated"]), (1.9, [])):
            self.assertEqual(self.names(good * [1, scale, 1, 1]), name)
        self.assertEqual(self.names(good * [1, 0, 1, 1]), ["stuck"])
        self.assertEqual(self.names(good * [1, 1, 1, 0]), [])  # no current in the reference is not a stuck converter
        self.assertEqual(self.names(good + [0, 0, 0.26, 0]), ["dc_offset"])
        self.assertEqual(self.names(np.clip(good, -0.45, 0.45)), ["clipped"])
        self.assertEqual(self.names(np.clip(good, -1, 0.45)), ["clipped"])

    def test_in_volts_without_full_scale(self):
        self.assertEqual(self.names(20 * self.channels() + 30, 0), [])
        self.assertEqual(self.names(20 * np.clip(self.channels(), -0.4, 0.4), 0), ["clipped"])

    def test_fewer_than_three_flat_tops_are_chance(self):
        values = self.channels()
        for n in (0, 1, 2):
            values[20 * n + 18:20 * n + 24, 0] = 0.5
            self.assertEqual(self.names(values), ["clipped"] if n == 2 else [], n)


class Arrays(unittest.TestCase):
    def test_coils_at_the_same_time(self):
        found = tricoil.demodulate(at_once(), CARRIERS_HZ, rate_hz=RATE_HZ, reference=4)
        np.testing.assert_allclose(found["mean"], X, atol=1e-3)
        np.testing.assert_allclose(found["carrier_offset_ppm"], -450, atol=20)
        self.assertEqual((found["reference_channel"], found["sensor_channels"], found["sensor_present"]), (3, [0, 1, 2], True))
        rows = found["rows"]
        self.assertEqual(len(rows), found["repeats"])
        np.testing.assert_allclose(rows["x"].mean(axis=0), found["mean"], atol=1e-12)
        np.testing.assert_allclose(np.diff(rows["time_s"]), found["block_samples"] / RATE_HZ)
        self.assertAlmostEqual(rows["time_s"][0], (found["block_samples"] - 1) / RATE_HZ / 2)
        np.testing.assert_allclose(rows["sigma"], np.mean(found["scatter"]), rtol=0.5)

    def test_a_carrier_far_off_in_long_blocks(self):
        for ppm in (-9000.0, 300.0, 9000.0):
            found = tricoil.demodulate(at_once(24_000, ppm), CARRIERS_HZ, rate_hz=RATE_HZ, reference=4, block=6000)
            np.testing.assert_allclose(found["carrier_offset_ppm"], ppm, atol=1)
            np.testing.assert_allclose(found["mean"], X, atol=1e-3)

    def test_voltages_of_coils(self):
        """Three carriers induce voltages in proportion to their frequency."""
        growth = np.array(CARRIERS_HZ) / np.mean(CARRIERS_HZ)
        values = at_once()
        values[:, :3] = at_once_of(X * growth)
        raw = tricoil.demodulate(values, CARRIERS_HZ, rate_hz=RATE_HZ, reference=4)
        np.testing.assert_allclose(raw["mean"], X * growth, atol=1e-3)
        self.assertGreater(raw["misfit_share"], 0.01)
        self.assertLess(raw["induced_misfit_share"], 1e-4)
        mended = tricoil.demodulate(values, CARRIERS_HZ, rate_hz=RATE_HZ, reference=4, induced=True)
        np.testing.assert_allclose(mended["mean"], X, atol=1e-3)
        np.testing.assert_allclose(mended["rows"]["x"].mean(axis=0), X, atol=1e-3)
        self.assertIsNone(mended["induced_misfit_share"])
        crossed = tricoil.Wiring((1, 2, 3), (-3, 1, 2))
        found = tricoil.demodulate(values, CARRIERS_HZ, rate_hz=RATE_HZ, reference=4, wiring=crossed)
        self.assertLess(found["induced_misfit_share"], 1e-4)  # divided by the carrier of each source coil
        given = tricoil.demodulate(values, (45.3, 64.6, 80), rate_hz=RATE_HZ, reference=4, induced=True, block=400)  # the carriers of the samples count
        np.testing.assert_allclose(given["mean"], mended["mean"], atol=2e-4)
        self.assertIsNone(tricoil.demodulate(at_once(), CARRIERS_HZ, rate_hz=RATE_HZ, reference=4)["induced_misfit_share"])

    def test_coils_in_turn(self):
        found = tricoil.demodulate(in_turn(), 10_000, rate_hz=200_000)
        np.testing.assert_allclose(found["mean"], X, atol=1e-3)
        self.assertEqual((found["reference_channel"], found["repeats"], found["flags"]), (3, 8, []))

    def test_without_a_reference_signs_are_those_of_the_couplings(self):
        values = at_once()[:, :3]
        found = tricoil.demodulate(values, CARRIERS_HZ, rate_hz=RATE_HZ)
        self.assertIsNone(found["reference_channel"])
        np.testing.assert_allclose(found["mean"], 0.25 * X, atol=1e-3)

    def test_codes_with_and_without_sign(self):
        values = np.rint(8000 * in_turn()).astype(int)
        for codes, bits in ((values, 16), (values + 32768, 16), (values + 8192 * 4, 16), (values // 16 + 2048, 12)):
            found = tricoil.demodulate(codes, 10_000, rate_hz=200_000, bits=bits)
            np.testing.assert_allclose(found["mean"], X, atol=2e-3)
        self.assertEqual(tricoil.demodulate(values * 4, 10_000, rate_hz=200_000, bits=18)["flags"], [])

    def test_a_reversed_channel_or_coil_gives_its_sign(self):
        values = in_turn()
        values[..., 1] *= -1
        np.testing.assert_allclose(abs(np.array(tricoil.demodulate(values, 10_000, rate_hz=200_000)["mean"])), abs(X), atol=1e-3)

    def test_wiring(self):
        values = at_once(noise=0)
        straight = tricoil.demodulate(values, CARRIERS_HZ, rate_hz=RATE_HZ, reference=4)
        crossed = values[:, [1, 0, 2, 3]] * [1, -1, 1, 1]
        for wiring in (tricoil.Wiring((2, -1, 3), (1, 2, 3)), tricoil.Wiring((2, -1, -3), (-1, 2, 3))):
            found = tricoil.demodulate(crossed, CARRIERS_HZ, rate_hz=RATE_HZ, reference=4, wiring=wiring)
            sign = np.array([[1, 1, 1], [1, 1, 1], [np.sign(wiring.sensor[2])] * 3]) * np.sign(wiring.source)
            np.testing.assert_allclose(np.array(found["mean"]) * sign, straight["mean"], atol=1e-9)
            self.assertEqual(found["sensor_channels"], [1, 0, 2])
        for wiring, begin in ((wiring, "# wiring corrected\ntime_us,"), (None, "time_us,")):
            with tempfile.TemporaryDirectory() as folder:
                out = os.path.join(folder, "couplings.csv")
                tricoil.demodulate(crossed, CARRIERS_HZ, rate_hz=RATE_HZ, reference=4, wiring=wiring, out=out)
                with open(out, encoding="utf-8") as file:
                    self.assertTrue(file.read().startswith(begin))

    def test_errors_have_the_names_of_arguments(self):
        values = in_turn()
        for options, message in (
            ({}, "rate_hz 0: give the sample rate, more than 0"),
            ({"rate_hz": 200_000, "guard": 200}, "with guard 200 at least"),
            ({"rate_hz": 200_000, "columns": [1, 2]}, "select them with columns"),
            ({"rate_hz": 200_000, "reference": 9}, "no column '9'; it has 4"),
            ({"rate_hz": 200_000, "reference": "none"}, "4 sensor channels; three are needed"),
            ({"rate_hz": 200_000, "columns": "1,2,3", "reference": 4}, "is not one of columns"),
            ({"rate_hz": 2_000}, "carrier_hz 10000: must be more than 0, and at most 900 Hz"),
            ({"rate_hz": 200_000, "guard": -1}, "guard: -1 is not a whole number"),
            ({"rate_hz": 200_000, "induced": True}, "induced: coils that are driven in turn have one carrier"),
        ):
            with self.assertRaisesRegex(ValueError, message):
                tricoil.demodulate(values, 10_000, **options)
        for capture, message in ((values[0], "has shape"), (values * np.nan, "NaN"), (np.zeros((4, 3, 200, 4), int) + 70_000, "codes from 70000"),
                                 ("/no/such", "cannot be opened"), (values[:1], "1 complete repeats"), (values[:0], "holds no samples"),
                                 (np.zeros((4, 3, 200, 4)), "no channel has a carrier of 10000 Hz"), ("/", "is a folder")):
            with self.assertRaisesRegex(ValueError, message):
                tricoil.demodulate(capture, 10_000, rate_hz=200_000)
        clipped = at_once()
        clipped[:, 1] = np.clip(4 * clipped[:, 1], -0.3, 0.3)
        for capture, carriers, message in ((at_once(), (45, 45, 80), "two frequencies are equal"), (clipped, CARRIERS_HZ, "every block of channel 2 is clipped")):
            with self.assertRaisesRegex(ValueError, message):
                tricoil.demodulate(capture, carriers, rate_hz=RATE_HZ, block=6000 if capture is not clipped else None, reference=4)


class Files(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = folder.name
        self.out = os.path.join(self.folder, "rows.csv")

    def file(self, data):
        path = os.path.join(self.folder, "capture")
        with open(path, "wb") as file:
            file.write(data if isinstance(data, bytes) else data.encode())
        return path

    def test_wav_files_give_the_same_as_arrays(self):
        values = at_once()
        expected = np.array(tricoil.demodulate(values, CARRIERS_HZ, rate_hz=RATE_HZ, reference=4)["mean"])
        for bits, code, tolerance in ((16, 1, 1e-5), (24, 1, 1e-7), (32, 1, 1e-9), (32, 3, 1e-7), (64, 3, 1e-12)):
            found = tricoil.demodulate(self.file(wav(values, bits, code)), CARRIERS_HZ, reference="channel 4")
            np.testing.assert_allclose(found["mean"], expected, atol=tolerance)
            self.assertEqual(found["rate_hz"], 1000)

    def test_wav_files_of_more_than_4_gb(self):
        """RF64: the length stands in another chunk; what follows the samples is none."""
        values = at_once()
        plain = wav(values, 16, length=0xFFFFFFFF)
        sizes = b"ds64" + struct.pack("<IQQQI", 28, 0, 8 * len(values), len(values), 0)
        long = b"RF64" + plain[4:12] + sizes + plain[12:] + b"LIST" + struct.pack("<I", 4) + bytes(4)
        found = tricoil.demodulate(self.file(long), CARRIERS_HZ, reference=4)
        self.assertEqual(found["mean"], tricoil.demodulate(self.file(wav(values, 16)), CARRIERS_HZ, reference=4)["mean"])
        with self.assertRaisesRegex(ValueError, "before the length in its header"):
            tricoil.demodulate(self.file(long[:-60]), CARRIERS_HZ, reference=4)

    def test_captures_that_are_no_wav_or_ambiguous(self):
        for data, message in ((b"fLaC" + bytes(99), "is a file of FLAC; write WAV"), (b"FORM\0\0\0dAIFF" + bytes(99), "is a file of AIFF; write WAV"),
                              ("V,V,V,A\n1,2,3,4\n", "more than one column V; select columns by number"),
                              ("a,b\n1,2\n".encode("utf-16-le"), "binary data; a text file is needed .UTF-16 with its byte-order mark")):
            with self.assertRaisesRegex(ValueError, message):
                tricoil.demodulate(self.file(data), CARRIERS_HZ, rate_hz=RATE_HZ)
        found = tricoil.demodulate(self.file("V,V,V,A\n" + table(at_once(), ",")), CARRIERS_HZ, rate_hz=RATE_HZ, columns=(1, 2, 3, 4), reference=4)
        self.assertTrue(found["sensor_present"])

    def test_wav_samples_come_in_parts_of_any_length(self):
        values = at_once(50)
        for bits, length in ((16, None), (24, 0), (32, 0xFFFFFFFF)):
            for count in (1, 7, 1 << 20):
                stream = Bytes(wav(values, bits, length=length) + (b"LIST" + bytes(96) if length is None else b""), count)
                samples = WavSamples(stream, stream.read())
                parts = []
                while (part := samples.next()) is not None:
                    parts.append(part)
                np.testing.assert_allclose(np.concatenate(parts), values, atol=2.0 ** (1 - bits))

    def test_a_table_gives_the_same_as_an_array(self):
        values = at_once()
        expected = tricoil.demodulate(np.round(values, 6), CARRIERS_HZ, rate_hz=RATE_HZ, reference=4)
        for separator in (" ", ";", ","):
            found = tricoil.demodulate(self.file(table(values, separator)), CARRIERS_HZ, rate_hz=RATE_HZ, reference=4)
            np.testing.assert_allclose(found["mean"], expected["mean"], atol=1e-12)
            np.testing.assert_array_equal(found["rows"]["time_s"], expected["rows"]["time_s"])

    def test_out(self):
        found = tricoil.demodulate(in_turn(), 10_000, rate_hz=200_000, out=self.out)
        with open(self.out, encoding="utf-8") as file:
            self.assertTrue(file.readline().startswith("time_us,sigma,x11,x12,x13,x21"))
            rows = np.loadtxt(file, delimiter=",")
        np.testing.assert_allclose(rows[:, 0], 1e6 * found["rows"]["time_s"], atol=0.5)
        np.testing.assert_allclose(rows[:, 2:11].reshape(-1, 3, 3), found["rows"]["x"], rtol=1e-9)
        np.testing.assert_allclose(rows[:, 11:].reshape(-1, 3, 3), found["rows"]["quadrature"], rtol=1e-9)

    def test_an_output_that_fails_leaves_the_old_file(self):
        with open(self.out, "w", encoding="utf-8") as file:
            file.write("old")
        with self.assertRaises(ValueError):
            tricoil.demodulate(in_turn(1), 10_000, rate_hz=200_000, out=self.out)
        os.symlink(self.out, self.out + ".link")
        with OutputFile(self.out + ".link") as file:
            file.write("new")
        with open(self.out, encoding="utf-8") as file:
            self.assertEqual(file.read(), "old")
        with OutputFile(self.out + ".link") as file:
            file.write("new")
            file.commit()
        self.assertTrue(os.path.islink(self.out + ".link"))
        with open(self.out, encoding="utf-8") as file:
            self.assertEqual(file.read(), "new")
        os.chmod(self.out, 0o400)
        for path, message in ((self.out, "write-protected"), (self.folder, "it is a folder"), (os.path.join(self.folder, "no", "file"), "No such file")):
            with self.assertRaisesRegex(ValueError, f"cannot write {path}: .*{message}"):
                OutputFile(path)
        self.assertEqual(sorted(os.listdir(self.folder)), ["rows.csv", "rows.csv.link"])

    def test_program_prints_the_result_of_the_package(self):
        path = self.file(table(at_once()))
        words = [os.environ["TRICOIL_PROGRAM"], "demodulate", path, "--carriers", "45,65,80", "--rate-hz", "1000", "--columns", "1,2,3", "--columns", "4",
                 "--reference", "4"]
        found = tricoil.demodulate(path, CARRIERS_HZ, rate_hz=1000, reference=4)
        found.pop("rows")
        done = subprocess.run([*words, "--json"], capture_output=True, text=True, check=True)
        self.assertEqual(json.loads(done.stdout), found)
        self.assertEqual(tricoil.command("demodulate", path, carrier_hz=CARRIERS_HZ, rate_hz=1000, reference=4), found)
        done = subprocess.run([*words, "--out", "-"], capture_output=True, text=True, check=True)
        self.assertEqual(len(done.stdout.splitlines()), 1 + found["repeats"])
        self.assertIn("couplings unexplained", done.stderr)
        with open("/dev/full", "w", encoding="utf-8") as full:
            done = subprocess.run(words, stdout=full, stderr=subprocess.PIPE, text=True, check=False)
        self.assertEqual(done.returncode, 3)
        self.assertEqual(done.stderr, "tricoil: standard output could not be written completely (No space left on device); is the disk full?\n")
        with self.assertRaisesRegex(ValueError, "unknown option"):
            tricoil.command("demodulate", path, carrier_hz=1, nothing=2)


class Captures(unittest.TestCase):
    def test_codes_are_centred_after_the_first_block(self):
        for first, expected in ((0, [-32768, 0, 0, 4464]), (-1, [-1, 32768, 32768, 37232])):
            text = f"a,b,c\n{first},0,0\n32768,0,0\n32768,0,0\n37232,0,0\n"
            capture = open_capture(Bytes(text.encode()))
            values = np.concatenate([blocks.values[:, 0, 0] for blocks in capture.blocks(1)])
            self.assertEqual(values.tolist(), expected)

    def test_coils_in_turn_come_in_parts_of_any_length(self):
        text = Damage.SEEDS[0]
        for count in (1, 13, 1 << 20):
            parts = list(open_capture(Bytes(text, count)).blocks(5))
            self.assertEqual(np.concatenate([part.coil for part in parts]).tolist(), [0, 1, 2] * 4)
            self.assertEqual(np.concatenate([part.repeat for part in parts]).tolist(), [n // 3 for n in range(12)])
            self.assertEqual(np.concatenate([part.begin for part in parts]).tolist(), list(range(0, 24, 2)))


class Damage(unittest.TestCase):
    """Random bytes and damaged captures, also as WAV, are read or refused with one line."""

    SEEDS = (
        b"state,repeat,sample,a,b,c,d\n" + b"".join(b"S%d,%d,%d,1,-2,3,400\n" % (1 + n // 2 % 3, n // 6, n % 2) for n in range(24)),
        table(at_once(30)).encode(),
        wav(at_once(30), 16),
        wav(at_once(30), 32, 3),
        b"",
    )

    def read(self, data, count):
        stream = Bytes(data, count)
        capture = open_capture(stream, bits=random.choice((8, 16, 31)), follows=random.random() < 0.3)
        for blocks in capture.blocks(10):
            self.assertTrue(np.isfinite(blocks.values).all())
            self.assertEqual(len(blocks.coil), len(blocks.values))

    def test_random_damage(self):
        random.seed(7)
        refused = 0
        for n in range(3000):
            data = bytearray(self.SEEDS[n % len(self.SEEDS)])
            for _ in range(random.randrange(5)):
                at = random.randrange(len(data) + 1)
                data[at:at + random.randrange(4)] = bytes(random.choice(b"0123456789,;\t \nS-.enaRIFFWfmt \0\xff#\"") for _ in range(random.randrange(6)))
            try:
                self.read(bytes(data), random.choice((1, 11, 1 << 20)))
            except ValueError as error:
                refused += 1
                self.assertTrue(str(error).startswith("capture"), str(error))
                self.assertNotIn("\n", str(error))
        self.assertGreater(refused, 500)
        self.assertLess(refused, 2500)


if __name__ == "__main__":
    unittest.main()
