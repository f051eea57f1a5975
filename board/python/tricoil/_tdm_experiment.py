"""Error budget compared with simulation: a motion sampled by time-division multiplexing, solved as if sampled at one instant."""

import numpy as np

from . import _tricoil

SLOT_S = 1 / 720
STEP_S = 1e-4  # of the central differences
SETTLE_S = 0.5  # at the beginning, which is not scored
RANGE_M = (0.15, 2)  # poses outside are not scored
SKEW_SLOTS = 3  # period of the skew error


def _turn(a, b):
    """Rotation vectors (N, 3), source frame, from attitudes a to b, (N, 4): b = exp(r) a."""
    w = np.sum(a * b, axis=1)
    v = a[:, :1] * b[:, 1:] - b[:, :1] * a[:, 1:] - np.cross(b[:, 1:], a[:, 1:])
    v *= np.where(w < 0, -1, 1)[:, None]
    sine = np.linalg.norm(v, axis=1)
    return v * np.divide(2 * np.arctan2(sine, abs(w)), sine, out=np.full(len(sine), 2.0), where=sine > 0)[:, None]


def _predicted(position_m, q, rates, slots):
    """rates (N, 12): velocity, angular rate, and their derivatives."""
    newest = slots % 3
    ages_s = SLOT_S * ((newest[:, None] - np.arange(3)) % 3)
    return _tricoil.systematic_errors(np.hstack((position_m, q, rates)), ages_s, 3 * SLOT_S, 0.0, 0.0, "direct").sum(axis=1)


def _solved(position_m, q):
    """Direct solutions of the latest three columns, in the true hemisphere; those of the first two slots are not defined."""
    slots = np.arange(len(position_m))
    columns = _tricoil.couplings(position_m, q, 1.0, "")
    x = np.stack([columns[np.maximum(slots - (slots - j) % 3, 0), :, j] for j in range(3)], axis=2)
    rows = _tricoil.solve(x, np.ones(len(x)), 1.0, np.zeros(3), "", None)
    if not rows["solved"][2:].all():
        raise ValueError("TDM experiment: couplings without a direct solution")
    toward = np.sum(rows["position_m"] * position_m, axis=1)
    return rows["position_m"] * np.where(toward < 0, -1, 1)[:, None], rows["quaternion_wxyz"]


def tdm(file, seed):
    """Errors at 240 Hz along the motion of a .traj file, or a generated one if `file` is empty, true minus measured: times (N), errors (N, 3, 6):
    measured, predicted from the true motion, and predicted from the differences of the device's own poses. Raises ValueError if no pose is scored."""
    poses = _tricoil.motion_poses(file, seed, SLOT_S, STEP_S).reshape(-1, 3)
    before, truth, after = (poses[:, n] for n in range(3))
    p, q = truth["position_m"], truth["quaternion_wxyz"]
    own_p, own_q = _solved(p, q)
    slots = np.arange(len(poses))
    range_m = np.linalg.norm(p, axis=1)
    n = slots[(slots * SLOT_S >= SETTLE_S) & (range_m >= RANGE_M[0]) & (range_m <= RANGE_M[1])]
    if not len(n):
        raise ValueError(f"TDM experiment: no pose to score; the motion must last longer than {SETTLE_S:g} s and come within "
                         f"{RANGE_M[0]:g} to {RANGE_M[1]:g} m")
    steps = [np.hstack((b["position_m"] - a["position_m"], _turn(a["quaternion_wxyz"], b["quaternion_wxyz"])))[n] / STEP_S
             for a, b in ((before, truth), (truth, after))]
    rates = np.hstack(((steps[0] + steps[1]) / 2, (steps[1] - steps[0]) / STEP_S))
    back = n - SKEW_SLOTS
    own_rates = np.hstack((own_p[n] - own_p[back], _turn(own_q[back], own_q[n]))) / (SKEW_SLOTS * SLOT_S)
    measured = np.hstack((p[n] - own_p[n], _turn(own_q[n], q[n])))
    predicted = _predicted(p[n], q[n], rates, n)
    by_device = _predicted(own_p[n], own_q[n], np.hstack((own_rates, np.zeros_like(own_rates))), n)
    return n * SLOT_S, np.stack((measured, predicted, by_device), axis=1)
