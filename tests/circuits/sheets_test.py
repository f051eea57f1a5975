#!/usr/bin/env python3
"""Schematic sheets: every pad of the netlist is on a sheet once, and each sheet connects what the netlist connects; each check fails with a
wrong sheet."""
import copy
import os
import sys
import unittest

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import netlist
import schematic
import schematics

PARTS = netlist.parts()
SHEETS = schematics.sheets(PARTS)


def errors(change):
    """Of sheets that `change` spoils."""
    wrong = copy.deepcopy(SHEETS)
    change(wrong)
    return schematic.errors(wrong, PARTS)


class SheetsTest(unittest.TestCase):
    def test_agree_with_the_netlist(self):
        self.assertEqual(schematic.errors(SHEETS, PARTS), [])
        self.assertEqual(sum(len(sheet.pins) for sheet in SHEETS.values()), sum(len(part.pads) for part in PARTS))

    def test_every_designator_is_written(self):
        text = "".join(sheet.svg() for sheet in SHEETS.values())
        self.assertEqual([part.designator for part in PARTS if f">{part.designator}" not in text], [])

    def test_find_a_missing_part(self):
        self.assertIn("C403.1 is on no sheet", errors(lambda sheets: sheets["reference.svg"].pins.pop(("C403", "1"))))

    def test_find_a_part_on_two_sheets(self):
        found = errors(lambda sheets: sheets["enable.svg"].pins.update({("C403", "1"): (1, 1)}))
        self.assertIn("C403.1 is on 2 sheets", found)

    def test_find_a_wire_between_two_nets(self):
        self.assertIn("reference.svg: connects AGND, REFM", errors(lambda sheets: sheets["reference.svg"].link("C401.1", "C401.2")))

    def test_find_a_missing_wire(self):
        found = errors(lambda sheets: sheets["reference.svg"].links.pop(0))
        self.assertTrue(any("REFM" in error for error in found), found)

    def test_find_a_wrong_name(self):
        self.assertIn("supply.svg: connects AGND, V+", errors(lambda sheets: sheets["supply.svg"].names.append(("AGND", (1210, 120)))))

    def test_crossing_wires_do_not_connect(self):
        sheet = schematic.Schematic(10, 10, "", [])
        sheet.link((0, 5), (10, 5))
        sheet.link((5, 0), (5, 10))
        sheet.names = [("A", (0, 5)), ("B", (5, 0))]
        self.assertEqual(len(sheet.groups()), 2)


if __name__ == "__main__":
    unittest.main()
