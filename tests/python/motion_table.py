"""Motion error from poses alone, on all recorded hands: a line for each path, then the worst of each column against its limit.

usage: motion_table.py [EVERY]     EVERY: each such path. Needs TRICOIL_DATA_DIR, the folder of hand-motion/. Exit status 1: a limit is exceeded,
77: no data. mm RMS, without poses beside gaps: given naive TDM poses, corrected without noise, given and corrected with noise, the deskewed direct
tracker that had the columns, smoothed, the smoother that had the columns; errors over stated deviations; prediction minus true motion error.
"""

import os
import pathlib
import sys

import numpy as np
import tricoil
from motion_cases import FRAME, deskewed_rms_m, errors_m, naive_run, rms, simulated, smoothed_rms_m

LEAST_INSIDE = 10  # poses of a path
TIMING = "tdm:3/720"
#: Name, limits, and the share of the paths that may exceed them. A smoother follows the start of a motion late, and then states too little.
LIMITS = {
    "gain": (50, np.inf, 0),
    "corrected / deskewed": (0, 1, 0),
    "smoothed / had": (0, 1.5, 0),
    "corrected / given": (0, 1.02, 0),
    "stated": (0.8, 1.3, 0.02),
    "stated, smoothed": (0.8, 1.3, 0.05),
    "stated, predicted": (0.7, 1.4, 0.03),
}


def stated(case, poses):
    """RMS error over the RMS of the stated deviation."""
    variance = np.trace(poses.covariance[case.inside, :3, :3], axis1=1, axis2=2)
    return rms(errors_m(case, poses)) / float(np.sqrt(np.mean(variance)))


def measure(path, step):
    """(values in mm, values for LIMITS) of a path; None if it has too few poses."""
    quiet, case = (simulated(path, True, step=step, noise=noise) for noise in (False, True))
    if min(np.sum(quiet.inside), np.sum(case.inside)) < LEAST_INSIDE:
        return None
    clean, result = tricoil.motion_error(quiet.poses, TIMING), tricoil.motion_error(case.poses, TIMING)
    given, corrected, smoothed = rms(errors_m(case)), rms(errors_m(case, result.corrected)), rms(errors_m(case, result.smoothed))
    deskewed, at_deskewed = deskewed_rms_m(case, result.corrected, path, True)
    had = smoothed_rms_m(case)
    left = (result.rows["total"][:, :3] - (case.without_noise_truth - case.without_noise_poses))[case.inside]
    predicted = rms(left) / rms(result.rows["total_deviation"][case.inside, :3])
    clean_mm = [rms(errors_m(quiet)), rms(errors_m(quiet, clean.corrected))]
    values = [*clean_mm, given, corrected, deskewed, smoothed, had, rms(left)]
    limits = (clean_mm[0] / clean_mm[1], at_deskewed / deskewed, smoothed / had, corrected / given, stated(case, result.corrected),
              stated(case, result.smoothed), predicted)
    return [1e3 * value for value in values], dict(zip(LIMITS, limits))


def show(step, paths):
    print(f"{720 / step:.0f} poses/s: given, corrected | given, corrected, deskewed, smoothed, smoother that had the columns, prediction's error, mm")
    rows = []
    for path in paths:
        for cached in (simulated, naive_run):
            cached.cache_clear()
        found = measure(str(path), step)
        if found is None:
            print(f"{path.stem:<20} too few poses")
            continue
        values, limits = found
        rows.append(limits)
        print(f"{path.stem:<20} {values[0]:7.3f} {values[1]:7.4f} | " + " ".join(f"{value:7.3f}" for value in values[2:]) + " | "
              + " ".join(f"{value:8.2f}" for value in limits.values()), flush=True)
    failed = False
    for name, (least, most, share) in LIMITS.items():
        column = np.array([limits[name] for limits in rows])
        outside, permitted = int(np.sum((column < least) | (column > most))), int(np.ceil(share * len(column)))
        failed |= outside > permitted
        print(f"  {name:<22} {column.min():8.2f} to {column.max():8.2f}, median {np.median(column):7.2f}; limits {least:g} to {most:g}, "
              f"outside {outside} of {len(column)} paths, permitted {permitted}{'  FAILED' if outside > permitted else ''}")
    return failed


def main():
    folder = pathlib.Path(os.environ.get("TRICOIL_DATA_DIR", "")) / "hand-motion"
    paths = sorted(folder.glob("*.traj"))[:: int(sys.argv[1]) if len(sys.argv) > 1 else 1]
    if not paths or "TRICOIL_DATA_DIR" not in os.environ:
        print("no recorded hands: TRICOIL_DATA_DIR names the folder of hand-motion/")
        return 77
    return int(any([show(step, paths) for step in (FRAME, 2 * FRAME)]))


if __name__ == "__main__":
    sys.exit(main())
