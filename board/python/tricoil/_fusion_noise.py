"""Noise of a fusion, from poses that are hidden from it: single ones and short stretches for the optical error, long stretches for the inertial sensor."""

import dataclasses

import numpy as np

from ._fusion import STILL_RATE, Measurement, Noise
from ._pose_path import continuous

PASSES = 8
SHORT_S, LONG_S = 0.1, 0.35  # hidden stretches
SHOWN_S = 0.35  # between them
SINGLE = 5  # one of so many of the other poses is hidden
LONGEST_S = 8.0  # of the recording that is used
HASTE = 1.5  # power of a ratio by which a random walk changes in one pass: it causes a part of the error only
LARGEST_STEP = 9.0  # of a variance in one pass
SMOOTH_PER_S = 60.0, 2000.0  # least and most: a short stretch shows the size
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
    """Squared errors of hidden poses less the white optical noise, over the variance of the path: position and rotation, (2,).

    The step of Fisher scoring for a factor k on variances v of Gaussian errors with k v + w: sum v (e^2 - w) / (v + w)^2 over sum v^2 / (v + w)^2.
    """
    e, by_state, by_constant, deviation = fusion.residual(s, m)
    v = np.diagonal(fusion.covariance(m.node, by_state, by_constant), axis1=1, axis2=2)
    weight = v / (v + deviation**2) ** 2
    squares, expected = (np.sum(weight * one, axis=0).reshape(2, 3).sum(axis=1) for one in (e**2 - deviation**2, v))
    return np.divide(squares, expected, out=np.ones(2), where=expected > 0)  # no attitudes: 1


def white_turn_variance(turn):
    """Variance of the white noise of attitudes about one axis: 2 q has three noisy components of four."""
    return 4 / 3 * white_variance(2 * continuous(turn.as_quat()))


# Of a usual MEMS sensor.
FIRST = Noise(0.01**2, 2.5e-3**2, 0.05**2, 0.01**2, np.array([1e-4**2, 5e-4**2]), np.array([1e-7**2, 1e-7**2]), np.array([200.0, 200.0]))
FIRST_WITHOUT = (30.0, 1e3)  # densities of the white derivatives of velocity and angular rate: m^2/s^3, rad^2/s^3
LEAST_DENSITY, LEAST_WALK = 1e-5**2, 1e-4**2  # of an inertial sensor
LEAST = np.array([1e-7**2, 1e-6**2])  # of an optical variance: the digits of a file


def density(one, usual):
    """Spectral density of the white noise of an inertial sensor, by its own samples. one: Integral or None."""
    return usual if one is None else max(white_variance(one.values) * float(np.median(np.diff(one.time_s))), LEAST_DENSITY)


def first_noise(acc, gyro, has_turn):
    acceleration, walk = FIRST_WITHOUT
    walk = walk if has_turn else STILL_RATE**2
    return dataclasses.replace(FIRST, acceleration=density(acc, acceleration), rate=density(gyro, STILL_RATE**2),
                               gyro_walk=FIRST.gyro_walk if gyro else walk)


def learned(make, s, m, time_s):
    """Noise with which hidden poses have the errors that their covariance says, the fusion of the shown poses and its state.

    The inertial sensor's own samples show its white noise, long stretches the random walk of its biases; short stretches the size of the smooth
    optical error, single poses its length: the error of one is as size^2 / length^3.

    make(measurement, noise): a Fusion. s: first state. m, time_s: poses of the first optical system, of at most LONGEST_S.
    """
    kind = kinds(time_s)
    shown, hidden = taken(m, kind == 0), [taken(m, kind == k) for k in (1, 2, 3)]
    fusion = make(shown, None)
    noise, has_acc = fusion.noise, fusion.acc is not None
    s = fusion.fit(s)
    expected = fusion.expected
    white = [white_variance(m.position_m), noise.optical[1] if m.turn is None else white_turn_variance(m.turn)]
    left = np.median(fusion.residual(s, shown)[0].reshape(-1, 2, 3) ** 2, axis=(0, 2)) / 0.455
    noise.optical = np.maximum(white, LEAST)
    noise.smooth = np.maximum(left - white, 0.01 * noise.optical)
    first_smooth = noise.smooth
    for _ in range(PASSES):
        fusion = make(shown, noise)
        fusion.expected = expected
        s = fusion.fit(s, 2)  # the noise alone has changed
        ratio = np.array([ratios(fusion, s, one) if len(one.node) else np.ones(2) for one in hidden])
        alone, smooth, within = np.clip(ratio, 1 / LARGEST_STEP, LARGEST_STEP)
        walk = np.maximum(np.array([noise.acc_walk, noise.gyro_walk]) * within**HASTE, LEAST_WALK)
        noise = Noise(noise.acceleration * (1 if has_acc else within[0]), noise.rate, *walk, noise.optical,
                      np.clip(noise.smooth * smooth, first_smooth / LARGEST_STEP, 100 * first_smooth),
                      np.clip(noise.smooth_per_s * np.cbrt(alone / smooth), *SMOOTH_PER_S))
    return noise, fusion, s
