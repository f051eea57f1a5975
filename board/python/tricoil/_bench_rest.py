"""Jitter and drift of a sensor at rest."""

import numpy as np

from ._bench_segments import Segment, matrices
from ._poses import Poses

BLOCKS = 10


def slope(time_s, values):
    """Drift (D,) and its standard deviation (D,) in values a second: a line through the means of blocks, whose scatter holds slow noise too."""
    blocks = np.array_split(np.arange(len(time_s)), min(BLOCKS, len(time_s) // 2))
    t = np.array([time_s[block].mean() for block in blocks])
    means = np.array([values[block].mean(axis=0) for block in blocks])
    t = t - t.mean()
    rate = t @ means / (t @ t)
    left = means - means.mean(axis=0) - t[:, None] * rate
    return rate, np.sqrt((left**2).sum(axis=0) / (len(t) - 2) / (t @ t))


def rest(poses: Poses, segment: Segment) -> dict:
    """Mean position, jitter without the drift, and drift. Lengths in m, angles in rad, times in s from the first pose."""
    from scipy.spatial.transform import Rotation

    time_s, position_m = poses.time_s[segment.rows], poses.position_m[segment.rows]
    mean_m = position_m.mean(axis=0)
    drift, deviation = slope(time_s, position_m)
    jitter = position_m - mean_m - (time_s - time_s.mean())[:, None] * drift
    result = {
        "from_s": float(time_s[0] - poses.time_s[0]),
        "to_s": float(time_s[-1] - poses.time_s[0]),
        "poses": len(time_s),
        "range_m": float(np.linalg.norm(mean_m)),
        "position_m": mean_m.tolist(),
        "jitter_m": jitter.std(axis=0, ddof=2).tolist(),
        "jitter_rms_m": float(np.sqrt((jitter**2).sum() / (len(jitter) - 2))),
        "peak_m": float(np.linalg.norm(jitter, axis=1).max()),
        "drift_m_per_s": float(np.linalg.norm(drift)),
        "drift_std_m_per_s": float(np.linalg.norm(deviation)),
    }
    if poses.quaternion_wxyz is not None:
        turns = Rotation.from_matrix(matrices(poses)[segment.rows])
        vectors = (turns * turns.mean().inv()).as_rotvec()
        angle_drift, angle_deviation = slope(time_s, vectors)
        vectors = vectors - (time_s - time_s.mean())[:, None] * angle_drift
        result["jitter_rms_rad"] = float(np.sqrt((vectors**2).sum() / (len(vectors) - 2)))
        result["drift_rad_per_s"] = float(np.linalg.norm(angle_drift))
        result["drift_std_rad_per_s"] = float(np.linalg.norm(angle_deviation))
    return result
