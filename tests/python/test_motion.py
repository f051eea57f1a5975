"""Error model from Python."""

import unittest

import numpy as np
import tricoil


class Motion(unittest.TestCase):
    def test_prediction_agrees_with_simulation(self):
        for example in ("I", "II", "III"):
            rows = tricoil.motion(example)
            self.assertEqual(len(rows), 2401)
            before_poles = rows["time_s"] < 0.1
            for name in ("e_rho_m", "e_alpha_rad", "e_beta_rad"):
                measured, predicted = rows[name][before_poles].T
                np.testing.assert_allclose(predicted, measured, atol=1e-10)

    def test_bad_input(self):
        for arguments, message in (
            ({"example": "IV"}, "example"),
            ({"loop": "opn"}, "did you mean 'open'"),
            ({"rate_hz": 0}, "rate_hz"),
            ({"form": "vectors"}, "closed"),
        ):
            with self.assertRaisesRegex(ValueError, message):
                tricoil.motion(**arguments)


class Budget(unittest.TestCase):
    def test_skew_of_tdm_is_zero_in_fdm(self):
        motion = {"position_m": [0.4, 0.3, 0.1], "velocity_m_s": [0.3, -0.5, 0.8]}
        self.assertEqual(tricoil.error_budget(**motion, mux="fdm")["skew"]["position_m"], 0)
        self.assertGreater(tricoil.error_budget(**motion, mux="tdm")["skew"]["position_m"], 1e-4)

    def test_bad_input(self):
        for arguments, message in (
            ({"position_m": [0, 0, 0]}, "position_m"),
            ({"position_m": [1, 0]}, "shape"),
            ({"position_m": [1, 0, 0], "mux": "cdm"}, "mux"),
            ({"position_m": [1, 0, 0], "rate_hz": -1}, "rate_hz"),
        ):
            with self.assertRaisesRegex(ValueError, message):
                tricoil.error_budget(**arguments)


if __name__ == "__main__":
    unittest.main()
