"""What `tricoil generator solve` says of poses of coils and of bodies: how many were solved, and their errors against the truth."""

import numpy as np

from ._single_coil import ENDS

WRONG_M = 0.02  # a pose farther from the truth is wrong, and not counted in the RMS


def summary(rows) -> dict:
    """Rows by their ends, and the stated deviation of the good ones."""
    counts = {end: int((rows["end"] == n).sum()) for n, end in enumerate(ENDS)}
    covariance = rows["covariance"][rows["end"] == 0]
    deviation_m = float(np.sqrt(np.mean(np.trace(covariance[:, :3, :3], axis1=1, axis2=2)))) if len(covariance) else None
    return {"poses": len(rows), "solved": counts.pop("converged"), **counts, "position_std_m": deviation_m}


def compared(rows, position_m, angle_rad, angle: str, nees) -> dict:
    """Errors of good poses against the truth. angle_rad: (M,), of the axis or the attitude, whose RMS has the key `angle`. nees(which): (N,) of the rows
    that a mask chooses, per degree of freedom."""
    is_good, error = rows["end"] == 0, np.linalg.norm(rows["position_m"] - position_m, axis=1)
    right = is_good & (error < WRONG_M)
    result = {"wrong": int((is_good & ~right).sum())}
    names = ("position_rms_m", "position_median_m", "position_max_m", angle, "nees")
    if not right.any():
        return result | dict.fromkeys(names)
    values = (np.sqrt(np.mean(error[right] ** 2)), np.median(error[right]), error[right].max(), np.degrees(np.sqrt(np.mean(angle_rad[right] ** 2))), nees(right).mean())
    return result | dict(zip(names, map(float, values)))


def result_lines(r: dict, first: str, angle: str) -> list[str]:
    """The result as lines, with this first one."""
    found = [first, *(f"  {r[name]} {name.replace('_', ' ')}" for name in ENDS[1:] if r[name])]
    if r["position_std_m"] is not None:
        found.append(f"  standard deviation {1e3 * r['position_std_m']:.3f} mm RMS (3D)")
    return [*found, *compared_lines(r["truth"], angle)]


def compared_lines(t: dict | None, angle: str) -> list[str]:
    """The line of compared(), if there is one."""
    if t and t["position_rms_m"] is not None:
        return [f"  against the truth: {1e3 * t['position_rms_m']:.3f} mm RMS (3D), median {1e3 * t['position_median_m']:.3f}, maximum {1e3 * t['position_max_m']:.3f} mm; "
                     f"{t[angle]:.3f} deg; {t['wrong']} wrong; NEES {t['nees']:.2f}"]
    return []
