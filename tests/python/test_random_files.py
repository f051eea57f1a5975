"""Random changes of valid files, read by read_poses(), demodulate() and `tricoil couplings`: a result, or a ValueError of one line that names the file. No other
exception, no warning, no input that takes seconds. TRICOIL_RANDOM_S: seconds for each, from another seed each time; default: 300 files."""

import json
import os
import random
import struct
import tempfile
import time
import unittest
import warnings

import numpy as np
import tricoil
from tricoil import _band_checks, _band_files
from tricoil._dual_rate import DualRateParams, dual_rate
from two_bands import Scene, calibration, two_bands

COUNT = 300
LONGEST_S = 5
HOSTILE = [b"1e308", b"-1e308", b"nan", b"inf", b"", b"-", b"0", b"99999999999999999999", b"\0", b"\xff\xfe", b",", b";", b"\t", b"\n", b"\r\n", b'"', b"{", b"}", b"[", b"]",
           b"1e-320", b"0x10", b"\xc3\xa9", b"#", b" = "]
CARRIERS_HZ = (45, 65, 80)


def pose_files():
    time_s = np.arange(12) / 100
    rows = [[t, 0.4 + t, 0.1, 0.2 - t, 1, 0, 0, 0] for t in time_s]
    plain = "".join(",".join(f"{value:.6f}" for value in row) + "\n" for row in rows)
    lines = "".join(f'{{"sensor":0,"time_us":{1e6 * row[0]:.0f},"valid":1,"position_m":[{row[1]},{row[2]},{row[3]}],"q_wxyz":[1,0,0,0]}}\n' for row in rows)
    euler = "".join(f"1;{row[0]};{1e3 * row[1]};{1e3 * row[2]};{1e3 * row[3]};10;20;{30 + n}\n" for n, row in enumerate(rows))
    motive = ("Format Version,1.23,Length Units,Meters\n\n,Type,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body\n"
              ",Name,One,One,One,One,One,One,One\n,ID,1,1,1,1,1,1,1\n,,Rotation,Rotation,Rotation,Rotation,Position,Position,Position\n"
              "Frame,Time (Seconds),X,Y,Z,W,X,Y,Z\n" + "".join(f"{n},{row[0]},0,0,0,1,{row[1]},{row[2]},{row[3]}\n" for n, row in enumerate(rows)))
    mha = "ObjectType = Image\nNDims = 3\n" + "".join(
        f"Seq_Frame{n:04}_ProbeToTrackerTransform = 1 0 0 {1e3 * row[1]} 0 1 0 {1e3 * row[2]} 0 0 1 {1e3 * row[3]} 0 0 0 1\n"
        f"Seq_Frame{n:04}_ProbeToTrackerTransformStatus = OK\nSeq_Frame{n:04}_Timestamp = {row[0]}\n" for n, row in enumerate(rows)) + "ElementDataFile = LOCAL\n"
    ndi = "Tools,Port 1,Frame,State,Q0,Qx,Qy,Qz,Tx,Ty,Tz\n" + "".join(f"1,Port 1,{n},OK,1,0,0,0,{1e3 * row[1]},{1e3 * row[2]},{1e3 * row[3]}\n" for n, row in enumerate(rows))
    return [text.encode() for text in ("time_s,x_m,y_m,z_m,qw,qx,qy,qz\n" + plain, lines, "sensor;time_s;x_mm;y_mm;z_mm;azimuth_deg;elevation_deg;roll_deg\n" + euler,
                                       motive, mha, ndi)]


def captures():
    n = np.arange(1600)
    tones = np.stack([np.cos(2 * np.pi * hz * n / 1000) for hz in CARRIERS_HZ], axis=1)
    values = 0.25 * np.column_stack((tones @ np.array([[0.5, 0.1, 0.2], [0.1, -0.3, 0.05], [0.15, 0.1, 0.4]]).T, tones.sum(axis=1)))
    data = np.rint(values * 2**15).astype("<i2").tobytes()
    wav = b"WAVEfmt " + struct.pack("<IHHIIHH", 16, 1, 4, 1000, 8000, 8, 16) + b"data" + struct.pack("<I", len(data)) + data
    table = "".join(",".join(f"{value:.5f}" for value in row) + "\n" for row in values)
    return [b"RIFF" + struct.pack("<I", len(wav)) + wav, table.encode(), b"x,y,z,current\n" + table.encode()]


def bands():
    """Calibration, high and low band, one after the other, and without its last rows."""
    data = two_bands(Scene(duration_s=0.25, ratio=8, metal_from_s=0.1))

    def table(x):
        return ",".join(_band_files.COLUMNS) + "\n" + "".join(",".join(f"{value:.9g}" for value in row) + "\n" for row in x)
    return ["\f".join((json.dumps(calibration(data), indent=indent), table(data.high[:8 * lines]), table(data.low[:lines]))).encode() for indent, lines in ((1, 47), (None, 45))]


def read_bands(path):
    """Files of the parts between form feeds."""
    with open(path, "rb") as file:
        parts = (file.read().split(b"\f") + 3 * [b""])[:3]
    names = [f"{path}.{name}" for name in ("json", "high", "low")]
    for name, part in zip(names, parts):
        with open(name, "wb") as file:
            file.write(part)
    coils, x = _band_files.read_coils(names[0]), _band_files.read_bands(*names[1:], 8)
    _band_checks.check_bands(names[1:], coils, x, 8, np.zeros(3))
    dual_rate(*coils, *x, DualRateParams(rows_per_line=8))


def changed(files, chance):
    """One of the files with a few changes."""
    data = bytearray(chance.choice(files))
    for _ in range(chance.choice((1, 1, 2, 4, 16))):
        at, end = sorted(chance.randrange(len(data) + 1) for _ in range(2))
        end = min(end, at + chance.choice((0, 1, 4, 64, 10_000)))
        kind = chance.randrange(6)
        if kind == 0 and data:  # one bit
            data[at % len(data)] ^= 1 << chance.randrange(8)
        elif kind == 1:  # a field
            data[at:end] = chance.choice(HOSTILE)
        elif kind == 2:  # bytes
            data[at:end] = chance.randbytes(end - at)
        elif kind == 3:  # removed
            del data[at:end]
        elif kind == 4:  # twice
            data[at:at] = data[at:end]
        else:  # of another file
            other = chance.choice(files)
            data[at:end] = other[:chance.randrange(len(other))]
    return bytes(data)


class RandomFiles(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.path = os.path.join(folder.name, "input.csv")

    def check(self, data, read):
        with open(self.path, "wb") as file:
            file.write(data)
        begin = time.process_time()
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("error")
                read(self.path)
        except ValueError as error:
            if type(error) is not ValueError or "\n" in str(error) or self.path not in str(error):
                raise
        self.assertLess(time.process_time() - begin, LONGEST_S)

    def run_on(self, files, read):
        for data in files:  # they are valid
            with open(self.path, "wb") as file:
                file.write(data)
            read(self.path)
        seconds = float(os.environ.get("TRICOIL_RANDOM_S", 0))
        seed = time.time_ns() if seconds else 1
        chance, end, count = random.Random(seed), time.monotonic() + seconds, 0
        while count < COUNT or time.monotonic() < end:
            data = changed(files, chance)
            with self.subTest(seed=seed, count=count, data=data[:2000]):
                self.check(data, read)
            count += 1
        print(f"{count} files, seed {seed}")

    def test_poses(self):
        self.run_on(pose_files(), lambda path: tricoil.read_poses(path, rate_hz=100))

    def test_numbers_whose_squares_are_infinite(self):
        names, row = b"time_s,x_m,y_m,z_m,qw,qx,qy,qz\n", b"%d,0.4,0.1,0.2,%s,0,0,0\n"
        self.refuses(names + row % (0, b"1") + row % (1, b"-1e308"), ":3: quaternion has length", tricoil.read_poses)
        samples = captures()[1].splitlines()
        samples[700] = b"0,0,1e200,0"
        self.refuses(b"\n".join(samples), ":701: column 3: 1e200 is above 1e\\+12", lambda path: tricoil.demodulate(path, CARRIERS_HZ, rate_hz=1000))

    def refuses(self, data, pattern, read):
        with open(self.path, "wb") as file:
            file.write(data)
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            self.assertRaisesRegex(ValueError, pattern, read, self.path)

    def test_bands(self):
        self.run_on(bands(), read_bands)

    def test_captures(self):
        self.run_on(captures(), lambda path: tricoil.demodulate(path, CARRIERS_HZ, rate_hz=1000))


if __name__ == "__main__":
    unittest.main()
