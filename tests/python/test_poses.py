"""Tables of poses of other systems: the same poses, however they are written."""

import itertools
import json
import os
import tempfile
import unittest

import numpy as np
import tricoil
from scipy.spatial.transform import Rotation

COUNT = 25
TIME_S = np.arange(COUNT) / 100
POSITION_M = np.stack((0.3 + 0.1 * np.sin(TIME_S), 0.1 * TIME_S, 0.2 - TIME_S**2), axis=1)
TURN = Rotation.from_rotvec(np.stack((0.4 + TIME_S, -TIME_S, 0.3 * np.cos(3 * TIME_S)), axis=1))
XYZW = TURN.as_quat()
WXYZ = XYZW[:, [3, 0, 1, 2]]


class Poses(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.path = os.path.join(folder.name, "poses.csv")

    def write(self, text, encoding="utf-8"):
        with open(self.path, "w", encoding=encoding, newline="") as file:
            file.write(text)

    def table(self, columns, separator=",", end="\n", decimal="."):
        """Text of a table; columns: name and values."""
        lines = [separator.join(columns)]
        for row in zip(*columns.values()):
            lines.append(separator.join(one if isinstance(one, str) else f"{one:.9f}".replace(".", decimal) for one in row))
        return end.join(lines) + end

    def plain(self, **changed):
        columns = {"time_s": TIME_S, "x_m": POSITION_M[:, 0], "y_m": POSITION_M[:, 1], "z_m": POSITION_M[:, 2],
                   "qw": WXYZ[:, 0], "qx": WXYZ[:, 1], "qy": WXYZ[:, 2], "qz": WXYZ[:, 3]}
        return {**columns, **changed}

    def agree(self, time_s=TIME_S, attitude=True, **options):
        poses = tricoil.read_poses(self.path, **options)
        np.testing.assert_allclose(poses.time_s, time_s, atol=2e-6)
        np.testing.assert_allclose(poses.position_m, POSITION_M, atol=2e-8)
        if attitude:
            turn = Rotation.from_quat(poses.quaternion_wxyz[:, [1, 2, 3, 0]])
            self.assertLess((turn * TURN.inv()).magnitude().max(), 1e-6)
        else:
            self.assertIsNone(poses.quaternion_wxyz)
        return poses

    def refused(self, pattern, **options):
        with self.assertRaisesRegex(ValueError, pattern):
            tricoil.read_poses(self.path, **options)

    def test_separators_line_ends_and_encodings(self):
        for separator, end, encoding in itertools.product((",", ";", "\t", " "), ("\n", "\r\n"), ("utf-8", "utf-8-sig", "utf-16")):
            with self.subTest(separator=separator, end=end, encoding=encoding):
                self.write(self.table(self.plain(), separator, end), encoding)
                self.agree()
        for separator in ";\t":
            self.write(self.table(self.plain(), separator, decimal=","))
            self.agree()

    def test_other_order_comments_quotes_and_empty_lines(self):
        columns = self.plain()
        text = self.table({name: columns[name] for name in reversed(columns)})
        first, rest = text.split("\n", 1)
        self.write("# recorded today\n\n" + ",".join(f'"{name}"' for name in first.split(",")) + "\n" + rest + "\n,,,,,,,\n\n")
        self.agree()
        self.write("% " + self.table(columns, " "))  # the names are a comment
        self.agree()

    def test_units_of_the_header_and_of_the_option(self):
        for names, per_m in ((("x_mm", "y_mm", "z_mm"), 1e3), (("X (cm)", "Y (cm)", "Z (cm)"), 1e2), (("pos_x [in]", "pos_y [in]", "pos_z [in]"), 1 / 0.0254),
                             (("position.x", "position.y", "position.z"), 1)):
            columns = {"time_s": TIME_S, **dict(zip(names, per_m * POSITION_M.T))}
            self.write(self.table(columns))
            self.agree(attitude=False)
        self.write(self.table({"time_s": TIME_S, **dict(zip("xyz", 1e3 * POSITION_M.T))}))
        self.refused(r"m away; is the unit mm\? Give it with unit")
        self.agree(attitude=False, unit="mm")

    def test_wrong_unit_in_the_header_is_noticed(self):
        self.write(self.table(self.plain(x_m=1e3 * POSITION_M[:, 0], y_m=1e3 * POSITION_M[:, 1], z_m=1e3 * POSITION_M[:, 2])))
        self.refused(r"is the unit mm\? Correct it in the file")
        self.refused("column x_m is in m, not mm; leave unit out", unit="mm")

    def test_unit_that_the_file_names_is_not_replaced(self):
        self.write(self.table(self.plain()))
        self.agree(unit="m", time_unit="s")
        self.refused("column x_m is in m, not mm; leave unit out, or with two files give one for each", unit="mm")
        self.refused("column time_s is in s, not ms; leave time_unit out", time_unit="ms")

    def test_no_text_ends_in_another_exception(self):
        no_table = "is no table of poses that can be read"
        for text, why in (('time_s,x_m,y_m,z_m\n0,"' + "1" * 200_000 + '",0,0\n', ":2: the position is not finite"), ('{"a":' * 100_000, no_table),
                          ("time_us,x_m,y_m,z_m\n" + "1" * 400 + ",0,0,0\n", no_table)):
            self.write(text)
            self.refused(why)
        for header in ("Frame,Time (Seconds),X,Y", "Frame"):
            self.write("Format Version,1.23,Length Units,Meters,Capture Frame Rate,100\n\n,Type,Body,Body,Body\n,Name,pen,pen,pen\n,,Position,Position\n" + header + "\n0,0,1,2\n")
            self.refused("has no column Position Z" if "," in header else "poses.csv")

    def test_numbers_and_their_limits(self):
        lines = self.table(self.plain()).splitlines()
        for row, pattern in (("0.025,2e6,0,0,1,0,0,0", r"poses.csv:5: the position is 2e\+06 m away"), ("2e12,0,0,0,1,0,0,0", r"poses.csv:5: the time is 2e\+12 s"),
                             ("0.025,0_7,0,0,1,0,0,0", "poses.csv:5: '0_7' in column x_m is not a number"), ("0.025,\u0663,0,0,1,0,0,0", "in column x_m is not a number")):
            self.write("\n".join([*lines[:4], row, *lines[4:]]))
            self.refused(pattern)

    def test_rotations(self):
        base = {"t_s": TIME_S, **dict(zip("xyz", POSITION_M.T))}
        euler = TURN.as_euler("ZYX", degrees=True).T
        vector = TURN.as_rotvec().T
        matrix = {f"r{i + 1}{j + 1}": TURN.as_matrix()[:, i, j] for i in range(3) for j in range(3)}
        homogeneous = {f"m{i}{j}": TURN.as_matrix()[:, i, j] for i in range(3) for j in range(3)}
        for rotation, options in ((dict(zip(("azimuth", "elevation", "roll"), euler)), {}),
                                  (dict(zip(("yaw_rad", "pitch_rad", "roll_rad"), np.radians(euler))), {}),
                                  (dict(zip(("rotvec_x", "rotvec_y", "rotvec_z"), vector)), {}),
                                  (dict(zip(("rx", "ry", "rz"), vector)), {"rotation": "rotvec"}),
                                  (dict(zip(("rx_deg", "ry_deg", "rz_deg"), TURN.as_euler("xyz", degrees=True).T)), {"rotation": "xyz"}),
                                  (dict(zip(("q1", "q2", "q3", "q4"), XYZW.T)), {"rotation": "xyzw"}),
                                  (dict(zip(("q0", "q1", "q2", "q3"), WXYZ.T)), {}), (matrix, {}), (homogeneous, {})):
            with self.subTest(columns=list(rotation)):
                self.write(self.table({**base, **rotation}))
                self.agree(**options)
        self.write(self.table(self.plain()))
        self.refused("rotation must be polhemus", rotation="foo")
        self.write(self.table({**base, **dict(zip(("rx", "ry", "rz"), vector))}))
        self.refused("say how they turn with rotation")
        self.write(self.table({**base, **dict(zip(("q1", "q2", "q3", "q4"), XYZW.T))}))
        self.refused("give their order with rotation wxyz or xyzw")

    def test_axes_of_angles_and_names_of_polhemus(self):
        """Orientation without a w is no quaternion; angles that are not complete are not left out in silence; a marker is no sensor."""
        angles = TURN.as_euler("ZYX", degrees=True).T
        base = {"time_s": TIME_S, "marker": (["3", "4"] * COUNT)[:COUNT], "sensor": ["1"] * COUNT, **dict(zip(("position_x", "position_y", "position_z"), POSITION_M.T))}
        self.write(self.table({**base, **dict(zip(("orientation_x", "orientation_y", "orientation_z"), angles))}))
        self.refused("columns orientation_x, orientation_y, orientation_z: say how they turn with rotation")
        self.agree(rotation="polhemus")
        self.write(self.table({**base, **dict(zip(("Az", "El", "Ro"), angles))}))
        self.agree()
        self.write(self.table({**base, **dict(zip(("Az", "El", "Twist"), angles))}))
        self.refused("of three angles there is only Az, El; name all three")

    def test_bursts(self):
        """Packets of four poses, stamped by the host: equal times or nearly so, with two packets lost."""
        count, rate_hz = 400, 240
        t = np.arange(count) / rate_hz
        p = np.stack((0.5 + 0.1 * np.sin(2 * t), 0.1 * np.cos(3 * t), 0.05 * t), axis=1)
        random = np.random.default_rng(3)
        packet = np.arange(count) // 4
        for apart_s, late_s in ((0, 0), (1e-5, 3e-4)):
            stamp = t[4 * packet + 3] + 0.002 + late_s * random.random(count)[packet] + apart_s * (np.arange(count) % 4)
            keep = (packet != 20) & (packet != 61)
            self.write(self.table({"time_s": [f"{value:.7f}" for value in stamp[keep]], **dict(zip("xyz", p[keep].T))}))
            poses = tricoil.read_poses(self.path)
            np.testing.assert_allclose(poses.time_s - poses.time_s[0], t[keep], atol=1e-4)
            self.assertRegex(" ".join(poses.notes), "rows came in bursts of 4; the times of an even clock, (240|239.99)")
        two = np.repeat(p, 2, axis=0) + np.tile([[0], [0.3]], (count, 1))
        self.write(self.table({"time_s": np.repeat(t, 2), **dict(zip("xyz", two.T))}))
        self.refused("two poses have the same time; if they are of two sensors")
        jumps = t[4 * packet + 3] + 0.2 * np.sin(0.1 * packet)
        self.write(self.table({"time_s": np.maximum.accumulate(jumps), **dict(zip("xyz", p.T))}))
        self.refused("no even clock explains their times")

    def test_times(self):
        unix = 1764283200.25
        iso = [f"2025-11-27T22:40:{0.25 + t:09.6f}Z" for t in TIME_S]
        for column, options, start in (({"time_us": [f"{1e6 * t:.0f}" for t in TIME_S]}, {}, 0), ({"time (ms)": 1e3 * TIME_S}, {}, 0),
                                       ({"frame": [str(n) for n in range(COUNT)]}, {"rate_hz": 100}, 0), ({"timestamp": unix + TIME_S}, {}, unix),
                                       ({"stamp_ns": [f"{int(unix * 1e9) + 10_000_000 * n}" for n in range(COUNT)]}, {}, None),
                                       ({"time_ns": [f"{int(unix * 1e9) + 10_000_000 * n}" for n in range(COUNT)]}, {}, unix),
                                       ({"time": iso}, {}, 1764283200.25), ({"time": [f"9:59:{59 + t:.6f}" for t in TIME_S]}, {}, 35999), ({}, {"rate_hz": 100}, 0)):
            with self.subTest(column=list(column), options=options):
                columns = self.plain()
                del columns["time_s"]
                self.write(self.table({**column, **columns}))
                if start is None:
                    self.refused("has no column of time")
                else:
                    self.agree(start + TIME_S, **options)
        columns = {"time": [f"05/01/2024 15:25:{39 + t:.6f}" for t in TIME_S], **self.plain()}
        del columns["time_s"]
        self.write(self.table(columns))
        self.refused("is no time of the day .* and no ISO time")
        columns = {"time": 1e3 * TIME_S * 10, **self.plain()}
        del columns["time_s"]
        self.write(self.table(columns))
        self.refused("column time has no unit, and its steps of 100 are no seconds; give time_unit")

    def test_several_sensors(self):
        columns = self.plain()
        twice = {name: np.repeat(values, 2) for name, values in columns.items()}
        twice["x_m"][1::2] += 1
        self.write(self.table({"sensor": ["0", "1"] * COUNT, **twice}))
        self.refused("has the sensors 0, 1; choose one with sensor")
        self.refused("has no sensor 3; it has 0, 1", sensor=3)
        self.agree(sensor=0)
        self.write(self.table({"sensor": ["0.0", "1.0"] * COUNT, **twice}))
        self.agree(sensor=0)
        self.agree(sensor="0.0")
        self.refused("has no sensor 0.5; it has 0, 1", sensor="0.5")
        self.write(self.table({"sensor": ["0", "1.5"] * COUNT, **twice}))
        self.refused("poses.csv:3: '1.5' in column sensor must be a whole number or a name", sensor=0)

    def test_rows_twice_invalid_and_empty(self):
        again = self.table(self.plain()).splitlines()
        self.write("\n".join([*again[:5], again[4], *again[5:]]))
        self.assertIn("1 rows are there twice; taken once", self.agree().notes)
        self.write("\n".join([again[0] + ",valid", *(line + ",1" for line in again[1:4]), "0.025,9,9,9,1,0,0,0,0", *(line + ",1" for line in again[4:])]))
        self.assertIn("1 rows without a valid pose are left out", self.agree().notes)
        self.write("\n".join([*again[:4], "0.025,,,,,,,", *again[4:]]))
        self.agree()

    def test_bad_rows_have_line_and_column(self):
        lines = self.table(self.plain()).splitlines()
        for row, pattern in (("0.025,abc,0,0,1,0,0,0", "poses.csv:5: 'abc' in column x_m is not a number"),
                             ("0.025,0,0,0,1,0,0", "poses.csv:5: 7 fields; the header has 8"),
                             ("0.025,nan,0,0,1,0,0,0", "poses.csv:5: the position is not finite"),
                             ("0.025,0,0,0,1,1,0,0", r"poses.csv:5: quaternion has length 1\.414, not 1"),
                             ("0.005,0,0,0,1,0,0,0", "poses.csv:5: time does not increase")):
            self.write("\n".join([*lines[:4], row, *lines[4:]]))
            self.refused(pattern)
        self.write("\n".join(lines[1:]))
        self.refused("no line of names above them; give columns")
        self.write(lines[0])
        self.refused("has no poses")

    def test_wrapped_clock_and_reflection(self):
        time_us = (np.arange(COUNT) * 10_000 + 2**32 - 50_000) % 2**32
        self.write(self.table({"time_us": [str(t) for t in time_us], **{k: v for k, v in self.plain().items() if k != "time_s"}}))
        self.refused("a 32-bit counter started again")
        reflected = TURN.as_matrix() * np.array([1, 1, -1])
        self.write(self.table({"time_s": TIME_S, **dict(zip("xyz", POSITION_M.T)),
                               **{f"r{i + 1}{j + 1}": reflected[:, i, j] for i in range(3) for j in range(3)}}))
        self.refused("these data are left-handed")

    def test_json_lines(self):
        rows = [{"sensor": 0, "time_us": round(1e6 * t), "valid": True, "position_m": list(p), "q_wxyz": list(q)} for t, p, q in zip(TIME_S, POSITION_M, WXYZ)]
        self.write("\n".join(map(json.dumps, rows)) + '\n{"sensor": 0, "time_us": 999999, "valid": false}\n')
        self.agree()

    def test_polhemus_export_without_names(self):
        euler = TURN.as_euler("ZYX", degrees=True)
        self.write("".join(f"01 {p[0]:11.7f} {p[1]:11.7f} {p[2]:11.7f} {e[0]:11.7f} {e[1]:11.7f} {e[2]:11.7f}\n" for p, e in zip(POSITION_M / 0.0254, euler)))
        self.agree(columns="polhemus", unit="in", rate_hz=100)
        self.agree(columns=["sensor", "x", "y", "z", "azimuth", "elevation", "roll"], unit="in", rate_hz=100)

    def test_motive(self):
        head = ["Format Version,1.23,Take Name,a,Capture Frame Rate,100.0,Rotation Type,Quaternion,Length Units,Millimeters,Coordinate Space,Global", "",
                ",Type" + ",Rigid Body" * 7 + ",Marker" * 3, ",Name" + ",wand" * 7 + ",wand:1" * 3, ",ID" + ",1" * 10,
                ",," + "Rotation," * 4 + "Position," * 3 + "Position,Position,Position", "Frame,Time (Seconds),X,Y,Z,W,X,Y,Z,X,Y,Z"]
        rows = [",".join([str(n), f"{t:.6f}", *(f"{v:.9f}" for v in (*q, *(1e3 * p), *(1e3 * p)))]) for n, (t, p, q) in enumerate(zip(TIME_S, POSITION_M, XYZW))]
        self.write("\n".join(head + rows))
        self.agree()
        self.agree(sensor="wand:1", attitude=False)
        self.refused("has no pen; it has wand", sensor="pen")
        # Older versions: lines without a title, without a unit, and, the oldest, without the names of frame and time.
        of = [line.replace(",Type,", ",,").replace(",Name,", ",,").replace(",ID,", ",,") for line in head]
        self.write("\n".join(of + rows))
        self.agree()
        of[0] = of[0].replace("Length Units,Millimeters,", "")
        of[-1] = of[-1].replace("Frame,Time (Seconds)", ",")
        self.write("\n".join(of + rows))
        self.refused("is the unit mm")
        self.agree(unit="mm")
        self.write("\n".join([head[0].replace("Millimeters", "Feet"), *head[1:], *rows]))
        self.refused("Length Units must be Meters, Centimeters or Millimeters; is 'Feet'")

    def test_ndi(self):
        lines = ["Tools,Port 1,Frame,Face,State,Q0,Qx,Qy,Qz,Tx,Ty,Tz,Error"]
        for n, (p, q) in enumerate(zip(POSITION_M, WXYZ)):
            lines.append(f"1,Tool,{n},0,OK," + ",".join(f"{v:.9f}" for v in (*q, *(1e3 * p))) + ",0.1")
        lines.insert(4, "1,Tool,2,0,Missing,,,,,,,,")
        self.write("\n".join(lines))
        self.agree(rate_hz=100)
        tool = lines[0].removeprefix("Tools,")
        self.write("\n".join([f"Tools,{tool},{tool.replace('1', '2')}", *(f"{line},{line[2:]}" for line in lines[1:])]))
        self.refused("has the tools Port 1, Port 2; choose one with sensor", rate_hz=100)
        self.agree(rate_hz=100, sensor="Port 2")
        self.agree(rate_hz=100, sensor=2)

    def test_plus_toolkit(self):
        lines = ["ObjectType = Image", "NDims = 3"]
        for n, (t, p, m) in enumerate(zip(TIME_S, POSITION_M, TURN.as_matrix())):
            rows = np.eye(4)
            rows[:3, :3], rows[:3, 3] = m, 1e3 * p
            lines += [f"Seq_Frame{n:04}_StylusToTrackerTransform = " + " ".join(f"{v:.9f}" for v in rows.ravel()),
                      f"Seq_Frame{n:04}_StylusToTrackerTransformStatus = OK", f"Seq_Frame{n:04}_Timestamp = {t:.6f}"]
        self.write("\n".join([*lines, "ElementDataFile = LOCAL", "\0\1"]))
        self.agree()

    def test_blocks_of_four_lines(self):
        text = ""
        for p, m in zip(POSITION_M, TURN.as_matrix()):
            text += "\n".join(" ".join(f"{v:.9f}" for v in (*m[i], p[i])) for i in range(3)) + "\n0 0 0 1\n\n"
        self.write(text)
        self.agree(rate_hz=100)

    def test_standard_deviations(self):
        """They have the unit of their names; a file that has none for a pose has none."""
        names = ("std_x_mm", "std_y_mm", "std_z_mm", "std_rx_rad", "std_ry_rad", "std_rz_rad")
        stated = {name: np.full(COUNT, n + 1.0) for n, name in enumerate(names)}
        self.write(self.table(self.plain(**stated)))
        poses = self.agree()
        np.testing.assert_allclose(poses.deviation[0], (1e-3, 2e-3, 3e-3, 4, 5, 6))
        lines = self.table(self.plain(**stated)).splitlines()
        self.write("\n".join([*lines[:3], lines[2], *lines[3:]]))
        self.assertEqual(len(self.agree().deviation), COUNT)  # of rows that are there twice as well
        for value in ("", "inf"):
            self.write(self.table(self.plain(**{**stated, "std_y_mm": [value] + ["1"] * (COUNT - 1)})))
            self.assertIsNone(self.agree().deviation)
        self.write(self.table(self.plain(**{**stated, "std_y_mm": ["1", "-1"] + ["1"] * (COUNT - 2)})))
        self.refused(":3: a standard deviation is negative")
        self.write(self.table(self.plain(**{**stated, "std_y_mm": ["1", "1e180"] + ["1"] * (COUNT - 2)})))
        self.refused(":3: a standard deviation is larger than")
        self.write(self.table(self.plain()))
        self.assertIsNone(self.agree().deviation)

    def test_own_files(self):
        take = os.path.join(os.path.dirname(self.path), "take")
        tricoil.run("hand", duration_s=0.5, record=take, fidelity="columns")
        recorded = tricoil.load(take)
        recorded = recorded[recorded["valid"]]
        for kind in ("csv", "jsonl"):
            tricoil.command("convert", take, to=kind, out=self.path)
            poses = tricoil.read_poses(self.path)
            np.testing.assert_allclose(poses.position_m, recorded["position_m"], atol=1e-6)
            np.testing.assert_allclose(poses.quaternion_wxyz, recorded["quaternion_wxyz"], atol=1e-6)
            os.remove(self.path)


if __name__ == "__main__":
    unittest.main()
