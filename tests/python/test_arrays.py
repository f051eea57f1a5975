"""NumPy and MATLAB files wherever a table is taken: the same result as from text."""

import importlib.util
import os
import random
import subprocess
import unittest

import numpy as np
from folder_case import FolderCase
import tricoil
from test_demodulate import CARRIERS_HZ, RATE_HZ, at_once
from tricoil._array_file import arrays_of, table_of
from tricoil._band_files import read_band

HAS_SCIPY = importlib.util.find_spec("scipy") is not None
COUNT = 40
RNG = np.random.default_rng(3)
POSITION_M = RNG.uniform(0.2, 0.4, (COUNT, 3))
Q = RNG.normal(size=(COUNT, 4))
Q /= np.linalg.norm(Q, axis=1, keepdims=True)
X = np.array([tricoil.couplings(p, q) for p, q in zip(POSITION_M, Q)])
ARRAYS = {"time_s": 0.01 * np.arange(COUNT), "position_m": POSITION_M, "q_wxyz": Q, "x": X}
HEADER = "time_s,x_m,y_m,z_m,qw,qx,qy,qz,x11,x12,x13,x21,x22,x23,x31,x32,x33"


class Arrays(FolderCase):
    def files(self, arrays):
        """The same arrays in all formats."""
        np.savez(self.path("a.npz"), **arrays)
        np.savez_compressed(self.path("b.npz"), rate_hz=100.0, operator="A", **arrays)
        rows = np.zeros(len(next(iter(arrays.values()))), [(name, array.dtype, array.shape[1:]) for name, array in arrays.items()])
        for name, array in arrays.items():
            rows[name] = array
        np.save(self.path("c.npy"), rows)
        names = ["a.npz", "b.npz", "c.npy"]
        if HAS_SCIPY:
            from scipy.io import savemat

            savemat(self.path("d.mat"), {**arrays, "rate_hz": 100.0, "note": "x"})
            savemat(self.path("e.mat"), {"recording": {name: np.moveaxis(array, 0, -1) if array.ndim == 3 else array for name, array in arrays.items()}})
            names += ["d.mat", "e.mat"]
        return [self.path(name) for name in names]

    def text(self):
        path = self.path("text.csv")
        np.savetxt(path, np.column_stack([array.reshape(COUNT, -1) for array in ARRAYS.values()]), delimiter=",", header=HEADER, comments="", fmt="%.17g")
        return path

    def test_every_command_reads_them(self):
        """A contract: the result from each format is that from text."""
        motion = {"time_us": 10_000.0 * np.arange(COUNT), "x": X}
        rest = {"x": np.repeat(tricoil.couplings((0.4, 0.2, 0.1), (1, 0, 0, 0))[None], 5, axis=0)}
        nodes = np.arange(COUNT)
        grid = {"column": nodes % 8, "row": nodes // 8, "level": np.zeros(COUNT, int),
                "x": np.array([tricoil.couplings((0.2 + 0.05 * (n % 8), 0.05 * (n // 8) - 0.1, 0.1), Q[n]) for n in nodes])}
        out = self.path("out.toml")
        cases = {
            "poses": (ARRAYS, lambda path: vars(tricoil.read_poses(path))["position_m"].tolist()),
            "stage": (ARRAYS, lambda path: tricoil.calibrate([path], out, "stage", model="concentric")["position_rms_m"]),
            "evaluate": (ARRAYS, lambda path: tricoil.command("evaluate", path, calibration=out, refit_fixtures=True)["position_rms_m"]),
            "free-motion": (motion, lambda path: tricoil.calibrate([path], out, "free-motion")["misfit_after"]),
            "wiring": (rest, lambda path: tricoil.command("calibrate wiring", path, at=(0.4, 0.2, 0.1))["misfit"]),
            "without a name": ({"x": X}, lambda path: tricoil.calibrate([path], out, "free-motion")["misfit_after"]),
            "grid": (grid, lambda path: tricoil.calibrate([path], out, "grid", spacing_mm=50)["frames"]),
        }
        for name, (arrays, read) in cases.items():
            text = self.path("table.csv")
            paths = self.files(arrays)
            with open(paths[0], "rb") as file, open(text, "wb") as table:
                table.write(table_of(file.read(), paths[0]))
            expected = read(text)
            if name == "without a name":
                paths.append(self.path("x.npy"))
                np.save(paths[-1], X)
            for path in paths:
                np.testing.assert_allclose(read(path), expected, rtol=1e-12, atol=1e-15, err_msg=f"{name} {path}")

    def test_generator_bands_and_pictures(self):
        generator = tricoil.planar_generator(8)
        axis = np.tile([0.0, 0.6, 0.8], (COUNT, 1))
        coils = {name: column for name, column in zip(generator.names, generator.couplings(POSITION_M, axis, 2.0).T)}
        for path in self.files({"position_m": POSITION_M, "axis": axis, **coils}):
            result = tricoil.command("generator calibrate", path, model="dipole", out=self.path("calibrated.toml"))
            self.assertEqual((result["coils"], result["residual"] < 1e-6), (8, True), path)
        for path in self.files({"x": X}):
            np.testing.assert_allclose(read_band(path), X.transpose(0, 2, 1).reshape(-1, 9), rtol=1e-12, err_msg=path)
        for path in self.files(ARRAYS):
            self.assertEqual(tricoil.command("plot", path, out=self.path("a.svg"))["poses"], COUNT, path)

    def test_the_program_reads_them(self):
        """The same text and exit code, whatever the file is; messages name the file."""
        program = os.environ["TRICOIL_PROGRAM"]
        x = np.array([tricoil.couplings((0.4 + 0.001 * n, 0.1, 0.1), (1, 0, 0, 0)) for n in range(COUNT)])
        path_of_hand = np.tile(np.eye(4), (COUNT, 1, 1))
        path_of_hand[:, :3, 3] = np.linspace(0.3, 0.4, COUNT)[:, None]
        out, folder = self.path("out.toml"), self.path("table.csv")
        cases = (({"time_us": 10_000.0 * np.arange(COUNT), "x": X}, ["calibrate", "free-motion", "--json", "--out", out, "FILE"]),
                 ({"time_us": 10_000.0 * np.arange(COUNT), "x": x}, ["run", "--device", "couplings:FILE,sigma=1e-6", "--hemisphere", "1,0,0", "--out", "-"]),
                 ({"matrix": path_of_hand}, ["run", "--trajectory", "FILE", "--out", "-"]))
        for arrays, words in cases:
            paths = self.files(arrays)
            with open(paths[0], "rb") as file, open(folder, "wb") as table:
                table.write(table_of(file.read(), paths[0]))
            done = [subprocess.run([program, "-q", *(word.replace("FILE", path) for word in words)], capture_output=True, text=True, check=False) for path in (folder, *paths)]
            self.assertEqual(done[0].returncode, 0, done[0].stderr)
            for path, one in zip(paths, done[1:]):
                self.assertEqual(one.returncode, 0, one.stderr)
                self.assertEqual(one.stdout.replace(path, folder), done[0].stdout, path)
        for path in paths:
            self.assertEqual(len(tricoil.run(trajectory=path, duration_s=0.3).poses), len(tricoil.run(trajectory=folder, duration_s=0.3).poses), path)
        path = self.path("new.mat")
        for data, message in ((b"MATLAB 7.3 MAT-file, Platform" + bytes(600), f"{path}: is a MAT file of version 7.3 (HDF5); save it in MATLAB with -v7"),
                              (b"MATLAB 5.0 MAT-file".ljust(126) + b"IM" + bytes([14, 0, 0, 0, 99]), f"{path}: the file is damaged")):
            with open(path, "wb") as file:
                file.write(data)
            for words in (["calibrate", "free-motion", "--out", out, path], ["run", "--device", f"couplings:{path}"]):
                done = subprocess.run([program, *words], capture_output=True, text=True, check=False)
                self.assertEqual((done.returncode, done.stderr.count("\n")), (2, 1), done.stderr)
                self.assertIn(message, done.stderr)

    def test_names_of_columns(self):
        for path in self.files(ARRAYS):
            with open(path, "rb") as file:
                lines = table_of(file.read(), path).decode().splitlines()
            self.assertEqual(sorted(lines[0].split(",")), sorted(HEADER.split(",")), path)
            self.assertEqual(len(lines), 1 + COUNT)
        np.testing.assert_allclose(tricoil.read_poses(self.text()).position_m, POSITION_M)

    def test_inertial_sensor_joints_and_board(self):
        from tricoil._board import read_board
        from tricoil._chain import joint_poses, read_chain
        from tricoil._inertial import read

        still = {"time_s": 0.01 * np.arange(60), "acc_m_s2": np.tile([0.0, 1.0, 9.8], (60, 1)), "gyr_rad_s": RNG.normal(size=(60, 3))}
        arm = {"a_m": np.array([0.3, 0.2]), "alpha_rad": np.array([0.0, 1.0]), "d_m": np.zeros(2), "theta_rad": np.zeros(2)}
        moved = {"time_s": 0.01 * np.arange(5), "q": RNG.normal(size=(5, 2))}
        holes = {"position_mm": RNG.uniform(0, 90, (4, 3))}
        for path in self.files(still):
            np.testing.assert_allclose(read(path).acc, still["acc_m_s2"], err_msg=path)
            np.testing.assert_allclose(read(path).gyro, still["gyr_rad_s"], err_msg=path)
        first, second = moved["q"].T
        reach = 0.3 * np.cos(first) + 0.2 * np.cos(first + second)
        for chain, path in zip([read_chain(one) for one in self.files(arm)], self.files(moved)):
            np.testing.assert_allclose(joint_poses(chain, path).position_m[:, 0], reach, err_msg=path)
        for path in self.files(holes):
            np.testing.assert_allclose(read_board(path).position_m, 1e-3 * holes["position_mm"], err_msg=path)

    def test_captures(self):
        values = at_once()
        expected = tricoil.demodulate(values, CARRIERS_HZ, rate_hz=RATE_HZ, reference=4)["mean"]
        np.save(self.path("a.npy"), values)
        np.savez(self.path("a.npz"), samples=values, rate_hz=RATE_HZ)
        np.savez(self.path("channels.npz"), rate_hz=RATE_HZ, **dict(zip(("s1", "s2", "s3", "current"), values.T)))
        names = ["a.npy", "a.npz", "channels.npz"]
        if HAS_SCIPY:
            from scipy.io import savemat

            savemat(self.path("a.mat"), {"samples": values, "fs": RATE_HZ})
            names.append("a.mat")
        for name in names:
            self.assertEqual(tricoil.demodulate(self.path(name), CARRIERS_HZ, rate_hz=RATE_HZ, reference=4)["mean"], expected)

    def test_what_cannot_be_read_is_said(self):
        good = {}
        for path in self.files(ARRAYS):
            with open(path, "rb") as file:
                good[path] = file.read()
        zipped = good[self.path("a.npz")]
        for data, message in ((b"MATLAB 7.3 MAT-file, Platform" + bytes(600), "version 7.3"), (b"\x89HDF\r\n\x1a\n" + bytes(99), "-v7"),
                              (zipped.replace(b".npy", b".xml"), "spreadsheet"), (zipped[:200], "damaged"), (good[self.path("c.npy")][:-8], "damaged")):
            path = self.path("bad.npz")
            with open(path, "wb") as file:
                file.write(data)
            for read in (tricoil.read_poses, lambda p: tricoil.command("calibrate free-motion", p, out=self.path("o")), lambda p: tricoil.demodulate(p, 1, rate_hz=9)):
                with self.assertRaisesRegex(ValueError, f"bad.npz.*{message}") as refusal:
                    read(path)
                self.assertNotIn("\n", str(refusal.exception))
        np.savez(path, text=np.array("a"))
        with self.assertRaisesRegex(ValueError, "bad.npz: has no array of numbers"):
            tricoil.read_poses(path)
        np.save(self.path("object.npy"), np.array([{}], object), allow_pickle=True)
        with self.assertRaisesRegex(ValueError, "object.npy: the file is damaged"):
            tricoil.read_poses(self.path("object.npy"))
        random.seed(4)
        for path, data in good.items():
            for _ in range(60):
                damaged = bytearray(data)
                for _ in range(random.randrange(1, 6)):
                    damaged[random.randrange(len(damaged))] = random.randrange(256)
                try:
                    arrays_of(bytes(damaged), path)
                except ValueError as error:
                    self.assertIn(path, str(error))


if __name__ == "__main__":
    unittest.main()
