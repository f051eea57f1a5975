#!/usr/bin/env python3
"""Coils of coils.toml fit; those that do not are named."""
import os
import sys
import unittest

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import winding


class CoilsTest(unittest.TestCase):
    def test_todays_coils_fit(self):
        self.assertEqual(winding.Triads().misfits(), [])

    def test_what_does_not_fit_is_named(self):
        for override, words in (({"S1.turns": 60}, "coil S1 does not fit into S2: 3.50 mm too large; fewer turns, or a larger bore of S2"),
                                ({"S1.per_layer": 12}, "coil S1: a layer of 12 turns is 2.20 mm wider than the window"),
                                ({"C2.turns": 700}, "the sensor's coils are 0.38 mm higher than its grooves"),
                                ({"sensor.groove": 10.0}, "coil C1: its window is wider than the groove")):
            with self.subTest(words):
                self.assertIn(words, "; ".join(winding.Triads(**override).misfits()))

    def test_a_wire_that_is_not_in_the_table_is_named(self):
        with self.assertRaisesRegex(ValueError, r"coils.toml: \[source\] names the wire 'thick', but there is no \[wire.thick\]; use one of: litz"):
            winding.Triads(**{"source.wire": "thick"})


if __name__ == "__main__":
    unittest.main()
