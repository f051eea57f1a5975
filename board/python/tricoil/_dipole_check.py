"""Presence of a sensor: couplings that are large relative to their scatter and fit a dipole."""

import numpy as np

from . import _tricoil

LEAST_ROOT = 8 * np.finfo(float).eps  # product of the smaller singular values, of a matrix whose largest entry is 1


def _verdict(x, s, snr_db, misfit_share):
    largest = abs(x).max()
    if not largest > np.finfo(float).tiny:
        return "no sensor: signal matrix is zero: no field at the sensor"
    if not s[1] * s[2] / largest**2 > LEAST_ROOT:
        return "no sensor: signal matrix has rank below three: a coil or a channel is dead"
    if snr_db < 20 * np.log10(_tricoil.MIN_SNR):
        return f"no sensor: couplings are only {snr_db:.1f} dB above their scatter, {20 * np.log10(_tricoil.MIN_SNR):.0f} dB are needed"
    if misfit_share > _tricoil.MAX_MISFIT:
        return (f"no sensor: {100 * misfit_share:.0f} % of the couplings' power fits no dipole ({100 * _tricoil.MAX_MISFIT:.0f} % is the limit); "
                f"singular values {s[0] / s[2]:.2f} : {s[1] / s[2]:.2f} : 1 instead of about 2 : 1 : 1. Inputs that are not connected can cause this")
    return None


def sensor_in(x, scatter) -> dict:
    """x, scatter: mean couplings and their standard deviations, (3, 3). By the singular values s of x, as core/solver/direct.hpp: strength
    k = (2 s1 + s2 + s3) / 3 of the nearest dipole, and share of the power that it does not explain."""
    s = np.linalg.svd(x, compute_uv=False)
    deviation = np.sqrt(np.mean(scatter**2))
    strength = (2 * s[0] + s[1] + s[2]) / 3
    misfit = (s[0] - s[1] - s[2]) ** 2 / 3 + (s[1] - s[2]) ** 2 / 2
    is_solved = abs(x).max() > np.finfo(float).tiny and s[1] * s[2] / abs(x).max() ** 2 > LEAST_ROOT
    snr_db = float(20 * np.log10(strength / max(deviation, 1e-300))) if is_solved else 0.0
    misfit_share = float(misfit / np.sum(x**2)) if is_solved else 0.0
    verdict = _verdict(x, s, snr_db, misfit_share)
    return {"sensor_present": verdict is None, "verdict": verdict or "sensor present", "singular_values": s.tolist(), "snr_db": snr_db,
            "misfit_share": misfit_share}
