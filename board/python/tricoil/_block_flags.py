"""Defects of blocks of samples: saturation, clipping, a stuck converter, an offset. As core/signal/block_health.hpp."""

import numpy as np

NAMES = ("saturated", "clipped", "stuck", "dc_offset")
RANGE = 1_000_000  # codes of full scale
NEAR_PEAK_TURNS_Q32 = 193_502_938  # acos(0.99) / pi of a turn: time of a cosine within 1 % of its peak
NEAR_PEAK_DIVISOR = 200  # 1 % of half the peak-to-peak value
CLEAR_SWING = 2000  # codes; below it, quantisation causes flat tops
MIN_FLAT_TOPS = 3  # fewer may occur by chance
OFFSET_DIVISOR = 4
REFERENCE = 3  # channel that may be constant


def natural_run(cycles, samples: int) -> int:
    """Longest run of samples that a cosine of the slowest carrier spends within 1 % of its peak, plus one. cycles: in the block."""
    return (NEAR_PEAK_TURNS_Q32 * samples // max(1, min(cycles)) >> 32) + 2


def _has_flat_tops(codes, low, high, run):
    """codes: (B, n, C); low, high: (B, C). More than `run` successive samples near a peak, at least three times."""
    swing = high - low
    margin = swing // NEAR_PEAK_DIVISOR
    side = (codes >= (high - margin)[:, None]).astype(np.int8) - (codes <= (low + margin)[:, None])
    stays = (side[:, 1:] == side[:, :-1]) & (side[:, 1:] != 0)  # the run goes on
    if stays.shape[1] < run:
        return np.zeros(swing.shape, bool)
    # A flat top begins where `run` successive samples continue a run, and the one before them does not.
    total = np.zeros((len(stays), stays.shape[1] + 1, stays.shape[2]), np.int32)
    np.cumsum(stays, axis=1, out=total[:, 1:])
    whole = total[:, run:] - total[:, :-run] == run
    begins = whole.copy()
    begins[:, 1:] &= ~whole[:, :-1]
    return (begins.sum(axis=1) >= MIN_FLAT_TOPS) & (swing >= CLEAR_SWING)


def flags_of(values, full_scale: float, run: int):
    """Flags of each block and channel, (B, 4, C), in the order of NAMES. values: (B, n, C); full_scale: largest value, 0: unknown; run: natural_run()."""
    is_known = full_scale > 0
    scale = full_scale if is_known else np.maximum(abs(values).max(axis=(1, 2)), 1e-300)[:, None, None]
    codes = (RANGE * np.clip(values / scale, -2.0, 2.0)).astype(np.int32)
    low, high, total = codes.min(axis=1), codes.max(axis=1), codes.sum(axis=1, dtype=np.int64)
    stuck = low == high
    stuck[:, REFERENCE:] = False
    saturated = is_known & ((high >= RANGE) | (low <= -RANGE))
    offset = is_known & (OFFSET_DIVISOR * abs(total) > values.shape[1] * RANGE)
    return np.stack((saturated, _has_flat_tops(codes, low, high, run), stuck, offset), axis=1)
