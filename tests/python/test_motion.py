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
            ({"kappa": "tow"}, "unknown kappa 'tow'; did you mean 'two'"),
        ):
            with self.assertRaisesRegex(ValueError, message):
                tricoil.motion(**arguments)


    def test_kappa_selects_the_formula(self):
        measured, predicted = tricoil.motion("II", kappa="two")["e_beta_rad"][-1]
        self.assertAlmostEqual(measured, -4.568888, places=5)
        self.assertAlmostEqual(predicted, 3.576, places=3)

    def test_errors_of_the_attitude_are_zero_for_a_fixed_attitude(self):
        names = ["e_psi_rad", "e_theta_rad", "e_phi_rad"]
        fixed, turning = (tricoil.motion(example) for example in ("I", "orientation"))
        for name in names:
            self.assertLess(abs(fixed[name]).max(), 1e-9)
            self.assertGreater(abs(turning[name]).max(), 0.1)


class Budget(unittest.TestCase):
    def test_skew_of_tdm_is_zero_in_fdm(self):
        motion = {"position_m": [0.4, 0.3, 0.1], "velocity_m_s": [0.3, -0.5, 0.8]}
        self.assertEqual(tricoil.error_budget(**motion, mux="fdm")["skew"]["position_m"], 0)
        self.assertGreater(tricoil.error_budget(**motion, mux="tdm")["skew"]["position_m"], 1e-4)

    def test_skew_of_tdm_is_that_of_a_simulation(self):
        run = tricoil.run("line", mux="tdm", deskew=False, duration_s=2, noise=False, fidelity="columns")
        settled = run.poses["time_s"] >= 0.5
        velocities = np.gradient(run.truth["position_m"], run.poses["time_s"], axis=0)
        terms = [tricoil.error_budget(p, v, mux="tdm", noise_ratio=0)["skew"] for p, v in zip(run.truth["position_m"], velocities)]
        position_m, rotation_rad = np.array([(term["position_m"], term["rotation_rad"]) for term in terms])[settled].T
        self.assertAlmostEqual(1e3 * np.sqrt(np.mean(position_m**2)) / run.rms_mm(), 1, delta=0.01)
        simulated_rad = run.orientation_errors_rad()[settled]
        self.assertAlmostEqual(np.sqrt(np.mean(rotation_rad**2) / np.mean(simulated_rad**2)), 1, delta=0.01)

    def test_bad_input(self):
        for arguments, message in (
            ({"position_m": [0, 0, 0]}, "position_m"),
            ({"position_m": [1, 0]}, "shape"),
            ({"position_m": [1, 0, 0], "mux": "cdm"}, "mux"),
            ({"position_m": [1, 0, 0], "rate_hz": -1}, "rate_hz"),
            ({"position_m": [1, 0, 0], "rate_hz": float("inf")}, "rate_hz"),
            ({"position_m": [1, 0, 0], "noise_ratio": float("nan")}, "noise_ratio"),
            ({"position_m": [1, 0, 0], "latency_s": float("inf")}, "latency_s"),
            ({"position_m": [1, 0, 0], "velocity_m_s": [0, np.nan, 0]}, "velocity_m_s: contains NaN"),
        ):
            with self.assertRaisesRegex(ValueError, message):
                tricoil.error_budget(**arguments)


if __name__ == "__main__":
    unittest.main()
