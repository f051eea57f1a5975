"""Amplitude error of a carrier due to the integral non-linearity of a converter, before and after `tricoil calibrate converters`."""
import math
import random

import geometry

HALF = 2047.5
LARGEST = 1126  # codes; the largest amplitude that gain ranging permits, 0.55 of full scale
RESTS = 108     # amplitudes of one converter in 36 rests
JUMPS, JUMP_CODES = 14, 128     # of the model of the calibration
UNEXPLAINED_LSB = 0.03          # what the jumps cannot explain, as the calibration expects


def curve(rng, most_lsb):
    """Integral non-linearity of a successive-approximation converter: its capacitors differ by random shares, in proportion to
    1/sqrt(size). Scaled so that the largest error is `most_lsb`."""
    off = [rng.gauss(0, 1) * math.sqrt(2**b) for b in range(12)]
    gain = sum(off) / 4095
    errors = [sum(off[b] for b in range(12) if code >> b & 1) - gain * code for code in range(4096)]
    scale = most_lsb / max(abs(e) for e in errors)
    return [scale * e for e in errors]


def error_lsb(errors, amplitude):
    """Fundamental of the error for a sine of this amplitude (codes) about the middle of the range."""
    total = 0.0
    for k in range(180):
        sine = math.sin(2 * math.pi * (k + 0.5) / 360 - math.pi / 2)
        code = HALF + amplitude * sine
        index = int(code)
        part = code - index
        total += (errors[index] * (1 - part) + errors[index + 1] * part) * sine
    return total / 90


def response(n, amplitude):
    """Amplitude error for a jump of 1 at +-n JUMP_CODES together (core/signal/converter_errors.hpp)."""
    level = n * JUMP_CODES
    return 2 / math.pi * math.sqrt(1 - (level / amplitude) ** 2) if amplitude > level else 0.0


def fitted(amplitudes, errors, noise_lsb):
    """Least squares: a gain, which the calibration of the coils explains, and the jumps, with their expected sizes as prior."""
    def row(amplitude):
        return [amplitude / LARGEST, *(response(n, amplitude) for n in range(JUMPS))]

    expected = [1.0]
    for n in range(JUMPS):
        bit = 11 if n == 0 else ((n & -n).bit_length() - 1) + 7
        expected.append((1 if n == 0 else 2) * 0.6 * math.sqrt(2.0 ** (bit - 11)))
    rows = [row(a) for a in amplitudes]
    normal = [[sum(r[i] * r[j] for r in rows) / noise_lsb**2 + (i == j) / expected[i] ** 2 for j in range(JUMPS + 1)]
              for i in range(JUMPS + 1)]
    right = [sum(r[i] * e for r, e in zip(rows, errors)) / noise_lsb**2 for i in range(JUMPS + 1)]
    solution = geometry.solve(normal, right)
    return lambda amplitude: sum(x * v for x, v in zip(solution, row(amplitude)))


def rms_errors(most_lsb, noise_lsb, converters=10, seed=3):
    """RMS error over converters and amplitudes, LSB: without the best gain, which the calibration of the coils removes; and with
    the jumps removed that follow from RESTS amplitudes."""
    rng = random.Random(seed)
    raw = left = count = 0.0
    for _ in range(converters):
        errors = curve(rng, most_lsb)
        seen = [LARGEST * (k + rng.random()) / RESTS for k in range(RESTS)]
        measured = [error_lsb(errors, a) + rng.gauss(0, noise_lsb) for a in seen]
        known = fitted(seen, measured, max(noise_lsb, UNEXPLAINED_LSB))
        others = [LARGEST * (k + 0.37) / 100 for k in range(100)]
        true = [error_lsb(errors, a) for a in others]
        gain = sum(a * e for a, e in zip(others, true)) / sum(a * a for a in others)
        raw += sum((e - gain * a) ** 2 for a, e in zip(others, true))
        left += sum((e - known(a)) ** 2 for a, e in zip(others, true))
        count += len(others)
    return math.sqrt(raw / count), math.sqrt(left / count)
