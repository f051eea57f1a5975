"""Noise of a fusion, from poses that are hidden from it: single ones for the optical noise, stretches for the inertial sensor."""

import dataclasses

import numpy as np

from ._fusion import STILL_RATE, Measurement, Noise
from ._pose_path import continuous

PASSES = 8
SHORT_S, LONG_S = 0.1, 0.35  # hidden stretches
SHOWN_S = 0.35  # between them
SINGLE = 5  # one of so many of the other poses is hidden
LONGEST_S = 8.0  # of the recording that is used
DAMPING = 1.0  # power of a ratio by which a variance changes in one pass
LARGEST_STEP = 9.0  # of a variance in one pass
LARGEST_RATIO = 25.0  # of one pose; more are outliers
SIXTH = 924.0  # variance of a sixth difference of white noise


def white_variance(values):
    """Variance of the white noise of rows of smooth values, (N, D), by sixth differences, robust."""
    if len(values) < 8:
        return 0.0
    return float(np.mean(np.median(np.abs(np.diff(values, 6, axis=0)), axis=0) ** 2) / 0.6745**2 / SIXTH)


def kinds(time_s):
    """0: shown; 1: hidden alone; 2, 3: hidden in a short and in a long stretch. (N,)"""
    kind = np.zeros(len(time_s), int)
    begin, n = time_s[0] + LONG_S, 0
    while begin + LONG_S + SHOWN_S < time_s[-1]:
        length = (SHORT_S, LONG_S)[n % 2]
        kind[(time_s >= begin) & (time_s < begin + length)] = 2 + n % 2
        begin, n = begin + length + SHOWN_S, n + 1
    shown = np.flatnonzero(kind == 0)
    alone = shown[SINGLE // 2:-1:SINGLE]
    kind[alone[(kind[alone - 1] == 0) & (kind[alone + 1] == 0)]] = 1
    return kind


def taken(m, rows):
    return Measurement(m.node[rows], m.position_m[rows], None if m.turn is None else m.turn[rows], m.factor[rows], m.has_smooth_error)


def ratios(fusion, s, m):
    """Squared errors of hidden poses over their expectation, position and rotation, (M, 2)."""
    e, by_state, by_constant, deviation = fusion.residual(s, m)
    covariance = fusion.covariance(m.node, by_state, by_constant) + deviation[:, :, None] ** 2 * np.eye(6)
    parts = (slice(0, 3), slice(3, 6))
    return np.column_stack([np.einsum("ni,nij,nj->n", e[:, part], np.linalg.inv(covariance[:, part, part]), e[:, part]) / 3 for part in parts])


FIRST = Noise(0.01**2, 2.5e-3**2, 0.05**2, 0.01**2, np.array([1e-4**2, 5e-4**2]), np.array([1e-7**2, 1e-7**2]))  # of a usual MEMS sensor
FIRST_WITHOUT = (30.0, 1e3)  # densities of the white derivatives of velocity and angular rate: m^2/s^3, rad^2/s^3
LEAST = np.array([1e-7**2, 1e-6**2])  # of an optical variance: the digits of a file


def first_noise(has_acc, has_gyro, has_turn):
    acceleration, walk = FIRST_WITHOUT
    walk = walk if has_turn else STILL_RATE**2
    return dataclasses.replace(FIRST, acceleration=FIRST.acceleration if has_acc else acceleration, rate=FIRST.rate if has_gyro else STILL_RATE**2,
                               gyro_walk=FIRST.gyro_walk if has_gyro else walk)


def learned(make, s, m, time_s):
    """Noise with which hidden poses have the errors that their covariance says, the fusion of the shown poses and its state.

    Long stretches show the noise of the inertial sensor; single poses and short stretches that of the optical system, which also causes errors
    within them.

    make(measurement, noise): a Fusion. s: first state. m, time_s: poses of the first optical system, of at most LONGEST_S.
    """
    kind = kinds(time_s)
    shown, hidden = taken(m, kind == 0), [taken(m, kind == k) for k in (1, 2, 3)]
    fusion = make(shown, None)
    noise, has_gyro = fusion.noise, fusion.gyro is not None
    s = fusion.fit(s)
    white = [white_variance(m.position_m), noise.optical[1] if m.turn is None else white_variance(2 * continuous(m.turn.as_quat()))]
    left = np.median(fusion.residual(s, shown)[0].reshape(-1, 2, 3) ** 2, axis=(0, 2)) / 0.455
    noise.optical = np.maximum(white, LEAST)
    noise.smooth = np.maximum(left - white, 0.01 * noise.optical)
    first_smooth = noise.smooth
    for _ in range(PASSES):
        fusion = make(shown, noise)
        s = fusion.fit(s, 1)  # the noise alone has changed
        ratio = np.array([np.minimum(ratios(fusion, s, one), LARGEST_RATIO).mean(axis=0) if len(one.node) else np.ones(2) for one in hidden])
        optical, within = np.clip((np.sqrt(ratio[0] * ratio[1]), ratio[2]), 1 / LARGEST_STEP, LARGEST_STEP) ** DAMPING
        if m.turn is None:
            optical[1] = within[1] = 1
        noise = Noise(noise.acceleration * within[0], noise.rate * (within[1] if has_gyro else 1), noise.acc_walk * within[0], noise.gyro_walk * within[1],
                      noise.optical, np.clip(noise.smooth * optical, first_smooth / 2, first_smooth * LARGEST_STEP))
    return noise, fusion, s
