"""Generates the tables of the pages from results.csv. In a page a table is between <!-- table NAME --> and <!-- end -->."""
import csv
import math
import os
import re

import budget
import checks
import coil_drawings
import formers
import netlist
import schematics
import spice
from spice import CIRCUITS
from winding import Triads

BOARD = os.path.dirname(CIRCUITS)
PLACE = re.compile(r"(<!-- table (\w+) -->\n)(.*?)(<!-- end -->)", re.S)


def _table(head, rows):
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    return "\n".join(lines + ["| " + " | ".join(row) + " |" for row in rows]) + "\n"


def ranges(r):
    head = ["range, m", "field, nT", "sensor coil, uV", "drive", "gain", "converter, V", "SNR, dB", "noise, mm", "all causes, mm",
            "without calibrate converters, mm"]
    return _table(head, [[f"{cm / 100:.2f}", f"{1e9 * r[f'range.field_{cm}_t']:.1f}", f"{1e6 * r[f'range.coil_{cm}_v']:.0f}",
                          f"1/{1 / r[f'range.drive_{cm}']:.0f}", f"{r[f'range.gain_{cm}']:.0f}", f"{r[f'range.converter_{cm}_v']:.2f}",
                          f"{r[f'range.snr_{cm}_db']:.1f}", *(f"{r[f'budget.{what}_{cm}_mm']:.2f}" for what in ("noise", "total", "plain"))]
                         for cm in (15, 30, 60, 75, 90, 120)])


def modes(r):
    head = ["mode", "window, ms", "weakest carrier, kHz", "SNR at 0.3 m, dB", "0.6 m", "1.2 m"]
    rows = []
    for mode in budget.modes():
        hz, window, _, _ = budget.load_of(mode)
        rows.append([mode["mode"], f"{1e3 * window:.2f}", f"{hz / 1e3:.2f}",
                     *(f"{r['snr.' + mode['mode'] + f'_{cm}_db']:.1f}" for cm in (30, 60, 120))])
        if mode["multiplexing"] == "dual-band":
            rows.append(["its low band", f"{1e3 * window:.2f}", f"{float(mode['low1_hz']) / 1e3:.2f}",
                         *(f"{r[f'snr.low band 240_{cm}_db']:.1f}" for cm in (30, 60, 120))])
    return _table(head, rows)


def causes(r):
    names = [name[len("cause."):] for name in r if name.startswith("cause.")]
    rows = [[name, f"{r['cause.' + name]:.3f}", f"{r['plain.' + name]:.3f}"] for name in names]
    rows.append(["**all together**", f"**{r['budget.total_75_mm']:.3f}**", f"**{r['budget.plain_75_mm']:.3f}**"])
    return _table(["cause", "with calibrate converters, mm", "without calibrate converters, mm"], rows)


# Acceptance of a coil, relative to its computed values
INDUCTANCE, RESISTANCE, Q_LEAST, RESONANCE_LEAST = 0.1, 0.06, 0.85, 0.5


def coils(r):
    triads = Triads()
    names = [coil.name.lower() for coil in triads.coils]

    def span(values, share, digits):
        return [f"{value * (1 - share):.{digits}f}-{value * (1 + share):.{digits}f}" for value in values]

    rows = [["turns", *(str(coil.turns) for coil in triads.coils)],
            ["in layers", *("+".join(str(n) for n in coil.layers) if len(coil.layers) < 4 else f"{len(coil.layers)} of {coil.per_layer}"
                            for coil in triads.coils)],
            ["mean radius, mm", *(f"{1e3 * coil.radius_m:.2f}" for coil in triads.coils)],
            ["wire, m", *(f"{1e-3 * coil.wire_mm:.1f}" for coil in triads.coils)],
            ["turns times area, cm^2", *(f"{1e4 * r[f'coils.{n}_m2']:.0f}" for n in names)],
            ["L at 10 kHz, uH", *span([1e6 * r[f"coils.{n}_h"] for n in names[:3]], INDUCTANCE, 1),
             *span([1e6 * r[f"coils.{n}_h"] for n in names[3:]], INDUCTANCE, 0)],
            ["R at 20 degrees, ohm", *span([r[f"coils.{n}_ohm"] for n in names[:3]], RESISTANCE, 3),
             *span([r[f"coils.{n}_ohm"] for n in names[3:]], RESISTANCE, 1)],
            ["Q at 10 kHz, at least", *(f"{Q_LEAST * r[f'coils.{n}_q']:.1f}" for n in names)],
            ["own resonance above, kHz", *(f"{1e-3 * RESONANCE_LEAST * r[f'coils.{n}_resonance_hz']:.0f}" for n in names)]]
    return _table(["", *(coil.name for coil in triads.coils)], rows)


def drive(r):
    full = r["drive.full_a"]
    rows = []
    for hz, use, share in ((300, "low band", None), (1000, "low band", None), (7658, "FDM 240, S1", 0.65),
                           (9572, "FDM 240, S2", 0.52), (10769, "TDM 240, each", 1), (13401, "FDM 240, S3", 0.37)):
        ohm = r[f"drive.ohm_{hz}"]
        amps = share * full if share else min(1.5, r["drive.swing_v"] / ohm)
        rows.append([f"{hz / 1e3:.2f}", use, f"{ohm:.2f}", f"{amps:.2f}" + ("" if share else " (the part's limit)"), f"{ohm * amps:.1f}"])
    return _table(["carrier, kHz", "use", "coil S1 and sense resistor, ohm", "current, A", "voltage, V"], rows)


def heat(r):
    rows = [["TDM, each stage", f"{r['heat.tdm_stage_w']:.1f}"], ["TDM, all", f"{r['heat.tdm_all_w']:.1f}"],
            *([f"FDM, stage S{k}", f"{r[f'heat.fdm_s{k}_w']:.1f}"] for k in (1, 2, 3)), ["FDM, all", f"{r['heat.fdm_all_w']:.1f}"],
            ["two bands, stage S1", f"{r['two_bands.heat_w']:.1f}"]]
    return _table(["", "heat, W"], rows)


def preamplifier(r):
    rows = [[f"{f / 1e3:.2f}", f"{r[f'preamplifier.gain_{f}']:.1f}", f"{1e9 * r[f'preamplifier.noise_{f}']:.2f}"]
            for f in (500, 7658, 9572, 10769, 13401)]
    return _table(["kHz", "gain", "noise at the coil, nV/rtHz"], rows)


def densities(r):
    rows = []
    for gain in (1, 2, 4, 8, 16, 32, 64):
        own = [1e9 * r[f"density.{name}_{gain}"] for name in ("converter", "opamp", "preamplifier")]
        rows.append([str(gain), *(f"{d:.0f}" for d in own), f"{sum(d * d for d in own) ** 0.5:.0f}"])
    return _table(["gain", "12-bit converter, nV/rtHz", "op-amp", "coil and preamplifier", "together"], rows)


def fields(r):
    rows = [[f"{cm} cm", *(f"{r[f'field.{mode}_{cm}cm{kind}_ut']:.2f}" for mode in ("tdm", "fdm") for kind in ("", "_worst")), "27", "100"]
            for cm in (10, 30)]
    return _table(["from the middle of the source", "TDM, uT RMS", "with tolerances", "FDM, sum of the three carriers", "with tolerances",
                   "general public", "occupational"], rows)


def _resistors():
    """Ohms of the resistors of netlist.csv by designator."""
    pattern = re.compile(r"([0-9.]+) (k|)ohm")
    found = {part.designator: pattern.fullmatch(part.value) for part in netlist.parts() if part.designator[0] == "R"}
    return {name: float(match[1]) * (1e3 if match[2] else 1) for name, match in found.items() if match}


def dc(r):
    """Voltages at the test points, from dividers and feedback of the netlist."""
    ohm = _resistors()
    supply, digital, analog = spice.value("power_stage.cir", "vs"), spice.value("supply_start.cir", "vreg"), 5.0
    avdd = 2 * budget.HALF_SUPPLY_V
    bias = avdd * ohm["R692"] / (ohm["R691"] + ohm["R692"])
    reference = avdd * ohm["R408"] / (ohm["R407"] + ohm["R408"])
    rows = [("TP901 V+", supply, 0.02), ("TP902 V-", -supply, 0.02), ("TP903 V_DIG", digital - supply, 0.04), ("TP904, analog", analog, 0.03),
            ("TP905, analog", -analog, 0.03), ("TP906 AVDD", avdd, 0.02), ("TP401 reference", reference * (1 + 3 * ohm["R405"] / ohm["R401"]), 0.03),
            ("TP611, TP621, TP631 sensor", bias * (1 + ohm["R615"] / ohm["R614"]), 0.03), ("TP502 COOL", r["flag.cool_v"], 0.03)]
    return _table(["test point", "V", "within, V"], [[name, f"{volts:.2f}", f"{abs(volts) * share:.2f}"] for name, volts, share in rows])


PLACE_OF_CHECK_M = (0.3, 0.1, -0.05)  # of the sensor, source frame, axes parallel
MEASURING = os.path.join(BOARD, "measuring.hpp")


def expected_couplings():
    """At that place, by sensor coil and source coil: C / r^3 (1.5 u u^T - 0.5), the firmware's constant and moments."""
    with open(MEASURING) as file:
        text = file.read()
    constant = float(re.search(r"kCouplingConstant = ([0-9.]+)F", text)[1])
    moments = [float(number) for number in re.search(r"kMoments\{(.*?)\}", text)[1].replace("F", "").split(",")]
    distance = math.hypot(*PLACE_OF_CHECK_M)
    u = [x / distance for x in PLACE_OF_CHECK_M]
    return [[constant * moments[j] / distance**3 * (1.5 * u[i] * u[j] - 0.5 * (i == j)) for j in range(3)] for i in range(3)]


def expected(r):
    x = expected_couplings()
    return _table(["", "C1", "C2", "C3"], [[f"S{j + 1}", *(f"{x[i][j]:+.2f}" for i in range(3))] for j in range(3)])


def limits(r):
    """limits.csv"""
    rows = [f"{c.result},{r[c.result]:.4g},{c.limit()},{' '.join(f'{k}={v}' for k, v in c.wrong.items())}" for c in checks.CHECKS]
    return "\n".join(["result,value,limit,a part that breaks it", *rows]) + "\n"


TABLES = {table.__name__: table for table in (ranges, modes, causes, coils, drive, heat, preamplifier, densities, fields, dc, expected)}


def _pages():
    yield os.path.join(BOARD, "HARDWARE.md")
    yield os.path.join(BOARD, "BRING-UP.md")
    for name in sorted(os.listdir(CIRCUITS)):
        if name.endswith(".md"):
            yield os.path.join(CIRCUITS, name)


def _filled(page, results):
    with open(page) as file:
        text = file.read()
    return text, PLACE.sub(lambda place: place[1] + TABLES[place[2]](results) + place[4], text)


def _path(name):
    return os.path.join(CIRCUITS, name)


WASTE = 1.05  # of the wire


def wires_to_buy():
    """(text that the bill of materials must contain) of each wire."""
    triads = Triads()
    return [f"{wire['name']}; {math.ceil(WASTE * triads.wire_m(name))} m" for name, wire in triads.data["wire"].items()]


# Parts of the netlists by circuit of the bill of materials: (netlist, parameters)
PARTS = {"power stage": ("power_stage.cir", "ra rb rf rd rset rsn cblk cb csn cbulk rs"),
         "preamplifier": ("preamplifier.cir", "rg rf r1 r2 r3 r4 c1 c2 c4 rdamp"),
         "reference": ("reference.cir", "r1 r2 r3 r4 c1 c2 c4 rfeed cfeed"), "enable": ("enable.cir", "re rpull chb rhb rin rbase rdown rup ccool")}


def _value_of_part(file, name):
    """'8.06 k', '2.2 nF' of a part, as in the bill of materials."""
    return spice.readable(file, name, "F" if name.startswith("c") else "")


def _bill_errors():
    """Wires and values of the netlists that the bill of materials does not have."""
    with open(_path("bill-of-materials.csv")) as file:
        rows = list(csv.DictReader(file))
    needed = [("coils", text) for text in wires_to_buy()]
    needed += [(circuit, _value_of_part(file, name)) for circuit, (file, names) in PARTS.items() for name in names.split()]
    return [f"bill-of-materials.csv: {circuit} without '{text}'" for circuit, text in needed
            if not any(circuit in row["circuit"] and re.search(rf"(?<![0-9.]){re.escape(text)}(?![0-9.])", row["value or type"]) for row in rows)]


def _files(results):
    drawn = [(name, draw().svg()) for name, draw in coil_drawings.DRAWINGS.items()]
    drawn += [(name, sheet.svg()) for name, sheet in schematics.sheets(netlist.parts()).items()]
    return [*drawn, ("formers.scad", formers.model(Triads())), ("limits.csv", limits(results)),
            ("board.net", netlist.kicad(netlist.parts()))]


def stale(results):
    """Errors: tables without a page, outdated tables in pages, outdated drawings and files."""
    found, used = [], set()
    for page in _pages():
        text, filled = _filled(page, results)
        used |= {place[1] for place in PLACE.findall(text)}
        if text != filled:
            found.append(os.path.basename(page))
    for name, content in _files(results):
        if not os.path.exists(_path(name)):
            found.append(name)
            continue
        with open(_path(name)) as file:
            if file.read() != content:
                found.append(name)
    wrong = [f"{name} is not current: tests/circuits/run update" for name in found]
    return wrong + _bill_errors() + netlist.errors(netlist.parts()) + schematics.errors_of(netlist.parts()) + [f"table {name} is in no page" for name in TABLES if name not in used]


def rewrite(results):
    for page in _pages():
        text, filled = _filled(page, results)
        if text != filled:
            with open(page, "w") as file:
                file.write(filled)
    for name, content in _files(results):
        with open(_path(name), "w") as file:
            file.write(content)
