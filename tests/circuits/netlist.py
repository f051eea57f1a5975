"""Netlist of the whole board, from netlist.csv: parts with footprints, and the net of each pad. Values of the simulated circuits come from
their .cir files. Written as a netlist for KiCad; pcbnew checks it (check_kicad.py)."""
import collections
import csv
import os

import spice
from spice import CIRCUITS

FOOTPRINTS = {"R0805": "Resistor_SMD:R_0805_2012Metric", "C0805": "Capacitor_SMD:C_0805_2012Metric", "TP": "TestPoint:TestPoint_Pad_D1.5mm",
              "EFUSE": "Package_SO:HTSSOP-16-1EP_4.4x5mm_P0.65mm_EP3.4x5mm", "LDO": "Package_SO:MSOP-8-1EP_3x3mm_P0.65mm_EP1.68x1.88mm",
              "MORPHO": "Connector_PinSocket_2.54mm:PinSocket_2x19_P2.54mm_Vertical"}
OPEN = "-"  # pad without connection

Part = collections.namedtuple("Part", "designator value footprint pads")  # pads: number to net; OPEN: not connected


def _value(text):
    """'@FILE PARAMETER UNIT': of a netlist of ngspice."""
    if not text.startswith("@"):
        return text
    return spice.readable(*text[1:].split())


def parts():
    found = []
    with open(os.path.join(CIRCUITS, "netlist.csv")) as file:
        for row in csv.DictReader(file):
            for copy in row["copies"].split() or [""]:
                pads = dict(pad.split("=") for pad in row["pads"].replace("#", copy).split())
                found.append(Part(row["designator"].replace("#", copy), _value(row["value"]),
                                  FOOTPRINTS.get(row["footprint"], row["footprint"]), pads))
    return found


def nets(of_parts):
    """Pads (designator, number) by net."""
    found = collections.defaultdict(list)
    for part in of_parts:
        for number, net in part.pads.items():
            if net != OPEN:
                found[net].append((part.designator, number))
    return dict(sorted(found.items()))


def errors(of_parts):
    """A designator twice; a net with one pad."""
    counts = collections.Counter(part.designator for part in of_parts)
    twice = [f"netlist.csv: {name} is there {count} times" for name, count in counts.items() if count > 1]
    return twice + [f"netlist.csv: net {net} ends at {pads[0][0]}.{pads[0][1]}" for net, pads in nets(of_parts).items() if len(pads) < 2]


def kicad(of_parts):
    """Text for the import of a netlist in pcbnew."""
    lines = ['(export (version "E")', "  (components"]
    for part in of_parts:
        lines.append(f'    (comp (ref "{part.designator}") (value "{part.value}") (footprint "{part.footprint}"))')
    lines += ["  )", "  (nets"]
    for code, (net, pads) in enumerate(nets(of_parts).items(), 1):
        nodes = " ".join(f'(node (ref "{designator}") (pin "{number}"))' for designator, number in pads)
        lines.append(f'    (net (code "{code}") (name "{net}") {nodes})')
    return "\n".join([*lines, "  )", ")"]) + "\n"
