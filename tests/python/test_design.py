"""tricoil design: signal to noise and errors against the simulation, formulas of coils, files, the printed grid, wrong input."""

import json
import math
import os
import re
import subprocess
import unittest
import zlib

import numpy as np
import scipy.special
from folder_case import FolderCase
import tricoil
from tricoil import _coil, _design, _grid_page

COILS = {"turns": 40, "radius": 0.03, "current": 1, "noise": 3e-9, "wire": 8e-4, "sensor_turns": 100, "sensor_radius": 0.008, "sensor_wire": 2e-4}
WORDS = [f"--{name.replace('_', '-')}={value}" for name, value in COILS.items()]


class Simulation(FolderCase):
    def run_of(self, range_m, mux, **more):
        file = self.path("coils.toml")
        found = tricoil.command("design", **COILS, ranges=[range_m], mux=mux, scenario=file, **more)
        run = tricoil.run(file, mux=mux, duration_s=5, deskew=mux == "fdm", rate_hz=found["rate_hz"])
        return found["ranges"][0], run

    def test_signal_to_noise_and_errors_over_range(self):
        """Of samples, with the demodulator's own estimate of the noise. Its removal of hum adds noise to shorter windows: the errors are 6 % larger with tdm."""
        for mux, more, added in (("fdm", {}, 0.02), ("tdm", {}, 0.06), ("fdm", {"rate_hz": 480}, 0.02)):
            for range_m in (0.2, 0.5, 0.9):
                with self.subTest(mux=mux, range_m=range_m, **more):
                    row, run = self.run_of(range_m, mux, **more)
                    settled = run.poses["time_s"] > 0.5
                    self.assertAlmostEqual(np.median(10 ** (run.poses["snr_db"] / 20)) / 10 ** (row["snr_db"] / 20), 1, delta=0.01)
                    position_m = np.sqrt(np.mean(run.position_errors_m()[settled] ** 2))
                    orientation_rad = np.sqrt(np.mean(run.orientation_errors_rad()[settled] ** 2))
                    self.assertAlmostEqual(position_m / row["position_rms_m"], 1 + added, delta=0.04)
                    self.assertAlmostEqual(orientation_rad / row["orientation_rms_rad"], 1 + added, delta=0.04)

    def test_farthest_valid_pose(self):
        farthest_m = _design.design(**{**COILS, "wire": None, "noise": 1e-7})["farthest_m"]
        for share, is_valid in ((0.95, True), (1.05, False)):
            file = self.path("coils.toml")
            tricoil.command("design", **{**COILS, "noise": 1e-7}, ranges=[share * farthest_m], scenario=file)
            self.assertEqual(np.mean(tricoil.run(file, duration_s=1).poses["valid"]) > 0.5, is_valid, share)

    def test_a_frequency_changes_the_signal_in_the_simulation_too(self):
        row, run = self.run_of(0.5, "tdm", carrier_hz=20160)
        self.assertAlmostEqual(np.median(run.poses["snr_db"]), row["snr_db"], delta=0.42)


class Formulas(unittest.TestCase):
    def test_elliptic_integrals(self):
        m = np.linspace(0, 0.999999, 101)
        for own, theirs in zip(_coil.ellipk(m), (scipy.special.ellipk(m), scipy.special.ellipe(m))):
            np.testing.assert_allclose(own, theirs, rtol=1e-14)

    def test_inductance_of_a_brooks_coil(self):
        """1.6994e-6 a N^2 for a mean radius of 1.5 times the square section (Brooks 1931; Grover, Inductance Calculations)."""
        for turns in (100, 400, 2500):
            side_m = 0.02
            own = _coil.inductance_h(turns, 1.5 * side_m, side_m / math.sqrt(turns))
            self.assertAlmostEqual(own / (1.6994e-6 * 1.5 * side_m * turns**2), 1, delta=1e-3)

    def test_inductance_of_a_ring_and_of_two_turns(self):
        ring_h = _coil.MU_0 * 0.03 * (math.log(8 * 0.03 / 0.0005) - 1.75)
        self.assertAlmostEqual(_coil.inductance_h(1, 0.03, 1e-3) / ring_h, 1)
        a = 0.03
        m = 4 * a * a / (4 * a * a + 1e-6)
        mutual = 4e-7 * math.pi * a * ((2 / math.sqrt(m) - math.sqrt(m)) * scipy.special.ellipk(m) - 2 / math.sqrt(m) * scipy.special.ellipe(m))
        self.assertAlmostEqual(_coil.inductance_h(2, a, 1e-3) / (2 * ring_h + 2 * mutual), 1, places=6)

    def test_a_winding_has_all_turns_about_its_mean_radius(self):
        for turns in (1, 2, 7, 40, 101):
            layers = _coil.winding(turns, 0.03, 1e-4)
            self.assertEqual(sum(count for _, count in layers), turns)
            self.assertAlmostEqual(np.mean([radius for radius, _ in layers]), 0.03)

    def test_resistance_and_noise(self):
        self.assertAlmostEqual(_coil.resistance_ohm(100, 0.01, 1e-3), 1.72e-8 * 100 * 2 * math.pi * 0.01 / (math.pi * 1e-6 / 4))
        self.assertAlmostEqual(_coil.thermal_noise(1000), 4.02e-9, delta=0.01e-9)

    def test_field_of_a_dipole(self):
        row, = _design.design(**COILS, ranges=[0.5])["ranges"]
        self.assertAlmostEqual(row["field_t"], 2e-7 * 40 * math.pi * 0.03**2 / 0.5**3)
        on_axis_t = 2e-7 * math.pi * 40 * 0.03**2 / (0.03**2 + 0.5**2) ** 1.5  # Biot and Savart
        self.assertAlmostEqual(row["field_off_dipole"], 1 - on_axis_t / row["field_t"])

    def test_range_of_1_mm(self):
        range_m = _design.design(**COILS)["range_of_1_mm_m"]
        self.assertAlmostEqual(_design.design(**COILS, ranges=[range_m])["ranges"][0]["position_rms_m"], 1e-3)

    def test_sensor_coils_are_the_source_coils_by_default(self):
        same = tricoil.command("design", turns=40, radius=0.03, current=1, noise=3e-9)
        self.assertEqual((same["sensor"]["turns"], same["sensor"]["radius_m"], same["source"]["inductance_h"]), (40, 0.03, None))


class Program(FolderCase):
    def program(self, *words):
        return subprocess.run([os.environ["TRICOIL_PROGRAM"], "design", *words], capture_output=True, text=True, cwd=self.folder, check=False)

    def test_json_is_the_result_of_the_package(self):
        self.assertEqual(json.loads(self.program(*WORDS, "--json").stdout), tricoil.command("design", **COILS))

    def test_unknown_option_of_the_package(self):
        with self.assertRaisesRegex(ValueError, "gain: unknown option of design"):
            tricoil.command("design", **COILS, gain=10)

    def test_text_and_picture(self):
        done = self.program(*WORDS, "--ranges", "0.5,1", "--plot", "design.svg")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("moment 0.1131 A m^2", done.stdout)
        with open(self.path("design.svg"), encoding="utf-8") as file:
            self.assertIn("<svg", file.read())

    def test_numbers_at_their_limits(self):
        for end in (0, 1):
            found = tricoil.command("design", **{name: limits[end] for name, limits in _design.LIMITS.items() if "wire" not in name and name != "rate_hz"})
            self.assertTrue(all(math.isfinite(value) for value in found["ranges"][0].values()), found)

    def test_wrong_input(self):
        for words, message in (
            ([], "design needs --turns, --radius, --current, --noise"), (["--turns=0"], "--turns"), ([*WORDS[1:], "--turns=1.5"], "whole number"),
            (["--noise=nan"], "--noise"), (["--radius=1e300"], "--radius"), ([*WORDS, "--ranges=1e300"], "--ranges"), ([*WORDS, "--ranges=0.5,-1"], "--ranges"), ([*WORDS, "--mux=cdm"], "--mux"),
            ([*WORDS[:4], "--wire=0.02"], "do not fit"), ([*WORDS, "--rate-hz=7"], "--rate-hz 7: "), ([*WORDS, "--plot=a.txt"], "--plot must end in"),
            ([*WORDS, "--scenario=a.txt"], "--scenario must end in"), ([*WORDS, "--scenario=/nowhere/a.toml"], "cannot write"),
            ([*WORDS, "--grid-pdf=a.pdf"], "--grid-pdf: only with"), (["--spacing-mm=40"], "requires --grid-pdf"),
            (["--grid-pdf=a.png"], "--grid-pdf must end in .pdf"), (["--grid-pdf=a.pdf", "--spacing-mm=500"], "--spacing-mm"),
        ):
            done = self.program(*words)
            self.assertEqual((done.returncode, done.stderr.count("\n")), (2, 1), (words, done.stderr))
            self.assertIn(message, done.stderr, words)
        self.assertEqual(os.listdir(self.folder), [])


class Grid(FolderCase):
    def setUp(self):
        super().setUp()
        self.found = tricoil.command("design", grid_pdf=self.path("grid.pdf"), spacing_mm=40)

    def test_true_scale(self):
        """Lines of the page, in mm."""
        with open(self.path("grid.pdf"), "rb") as file:
            content = file.read()
        self.assertIn(b"/MediaBox [ 0 0 841.8897637795 595.2755905512 ]", content)
        page = b"".join(zlib.decompress(part) for part in re.findall(rb"FlateDecode.*?stream\r?\n(.*?)\r?\nendstream", content, re.S)[:1])
        number = rb"(-?[\d.]+)"
        lines = [[float(one) * 25.4 / 72 for one in found] for found in re.findall(rb"%b %b m\n%b %b l\n" % (4 * (number,)), page)]
        across = sorted(y for x, y, to_x, to_y in lines if y == to_y and 240 < to_x - x < 290)  # the page is wider
        up = sorted(x for x, y, to_x, to_y in lines if x == to_x and abs(to_y - y) > 100)
        np.testing.assert_allclose(np.diff(across), np.full(4, 40), atol=1e-3)
        np.testing.assert_allclose(np.diff(up), np.full(6, 40), atol=1e-3)
        self.assertTrue(any(abs(to_x - x - 200) < 1e-3 and y == to_y for x, y, to_x, to_y in lines), "ruler")

    def test_keeps_a_filled_table(self):
        with open(self.path("grid.csv"), "w", encoding="utf-8") as file:
            file.write("number,x11\n1,2\n")
        with self.assertRaisesRegex(ValueError, "other columns"):
            tricoil.command("design", grid_pdf=self.path("grid.pdf"), spacing_mm=40)
        with open(self.path("grid.csv"), encoding="utf-8") as file:
            self.assertEqual(file.read(), "number,x11\n1,2\n")
        os.remove(self.path("grid.csv"))
        tricoil.command("design", grid_pdf=self.path("grid.pdf"), spacing_mm=40)
        tricoil.command("design", grid_pdf=self.path("grid.pdf"), spacing_mm=50)

    def test_calibration_on_its_nodes(self):
        """Six attitudes at each node, the sensor 10 mm above the paper."""
        random = np.random.default_rng(1)
        with open(self.path("grid.csv"), encoding="utf-8") as file:
            names, *nodes = file.read().split()
        self.assertEqual(len(nodes), self.found["columns"] * self.found["rows"])
        lines = [names + "".join(f",x{i}{j}" for i in "123" for j in "123")]
        for node in nodes:
            x_mm, y_mm = (float(one) for one in node.split(",")[-2:])
            for _ in range(6):
                X = tricoil.couplings([0.25 + 1e-3 * x_mm, 1e-3 * y_mm - 0.08, 0.01], random.normal(size=4), coupling_constant=5e-3)
                lines.append(node + "".join(f",{x:.9g}" for x in (X * (1 + 1e-4 * random.normal(size=(3, 3)))).flat))
        with open(self.path("filled.csv"), "w", encoding="utf-8") as file:
            file.write("\n".join(lines) + "\n")
        result = tricoil.command("calibrate grid", self.path("filled.csv"), spacing_mm=40, out=self.path("cal.toml"))
        self.assertAlmostEqual(result["coupling_constant"] / 5e-3, 1, delta=2e-3)

    def test_smallest_and_largest(self):
        for spacing_mm in (10, 25, 165):
            page = _grid_page.layout(spacing_mm)
            left, bottom = page.corner_mm
            self.assertGreaterEqual(min(left, 297 - left - (page.columns - 1) * spacing_mm), 15 - 1e-9)
            self.assertGreater(bottom, 20)
            self.assertLess(bottom + (page.rows - 1) * spacing_mm, 195)


if __name__ == "__main__":
    unittest.main()
