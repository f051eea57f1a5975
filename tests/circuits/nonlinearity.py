"""Amplitude error of a carrier due to the integral non-linearity of a converter, before and after a sweep of the drive."""
import math
import random

HALF = 2047.5
LARGEST = 1126  # codes; the largest amplitude that gain ranging permits, 0.55 of full scale
POINTS = 128    # amplitudes of the sweep


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


def rms_errors(most_lsb, noise_lsb, converters=10, seed=3):
    """RMS error over converters and amplitudes, LSB: uncorrected, and corrected by a sweep at POINTS amplitudes."""
    rng = random.Random(seed)
    raw = left = count = 0.0
    for _ in range(converters):
        errors = curve(rng, most_lsb)
        table = [0.0] + [error_lsb(errors, LARGEST * k / POINTS) + rng.gauss(0, noise_lsb) for k in range(1, POINTS + 1)]
        for k in range(101):
            place = POINTS * (k + 0.37) / 102
            index = int(place)
            known = table[index] + (table[index + 1] - table[index]) * (place - index)
            true = error_lsb(errors, LARGEST * place / POINTS)
            raw += true**2
            left += (true - known) ** 2
            count += 1
    return math.sqrt(raw / count), math.sqrt(left / count)
