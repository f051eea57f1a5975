"""Naive TDM poses of simulated hands, and the errors of trackers that had their columns."""

import dataclasses
import functools

import numpy as np
import tricoil
from tricoil import _tricoil

FRAME = 3  # slots: one pose of each frame
SLOT_S = 1 / 720
MARGIN = 15  # poses beside an end or a gap that are left out
DURATION_S = 4


@dataclasses.dataclass(frozen=True)
class Case:
    """Every `step`-th pose, with the true positions; without_noise_*: of the same run without noise. inside: away from ends and gaps."""

    run: tricoil.Run
    step: int
    rows: np.ndarray
    poses: np.ndarray
    truth: np.ndarray
    without_noise_poses: np.ndarray
    without_noise_truth: np.ndarray
    inside: np.ndarray


def towards(position_m, truth_m):
    """Positions in the hemisphere of the true ones: a tracker may have changed it."""
    return np.where(np.sum(position_m * truth_m, axis=1)[:, None] < 0, -position_m, position_m)


@functools.cache
def naive_run(motion, is_file, noise, tracker, deskew=False):
    where = {"trajectory": motion} if is_file else {"scenario": motion, "duration_s": DURATION_S}
    return tricoil.run(mux="tdm", tracker=tracker, deskew=deskew, noise=noise, fidelity="columns", **where)


@functools.cache
def simulated(motion="hand", is_file=False, *, step, first=0, tracker="direct", noise=True):
    run, quiet = naive_run(motion, is_file, noise, tracker), naive_run(motion, is_file, False, tracker)
    rows = np.arange(first, min(len(run.poses), len(quiet.poses)), step)
    rows = rows[run.poses["valid"][rows]]
    truth = run.truth["position_m"][rows]
    poses = run.poses[rows].copy()
    poses["position_m"] = towards(poses["position_m"], truth)
    inside = np.ones(len(rows), bool)
    interval_s = np.diff(poses["time_s"])
    for gap in (-1, *np.flatnonzero(interval_s > 1.5 * step * SLOT_S), len(rows) - 1):
        inside[max(0, gap + 1 - MARGIN):gap + 1 + MARGIN] = False
    return Case(run, step, rows, poses, truth, towards(quiet.poses["position_m"][rows], quiet.truth["position_m"][rows]),
                quiet.truth["position_m"][rows], inside)


def rms(vectors):
    return float(np.sqrt(np.mean(np.sum(vectors**2, axis=1))))


def errors_m(case, poses=None):
    """Position errors of the poses of the case away from gaps, or of others at their times."""
    position_m = case.poses["position_m"] if poses is None else poses.position_m
    return (position_m - case.truth)[case.inside]


def deskewed_rms_m(case, corrected, motion="hand", is_file=False):
    """RMS errors of the direct tracker that deskews its columns, and of the corrected poses, where the tracker says that its pose is valid."""
    run = naive_run(motion, is_file, True, "direct", True)
    both = case.inside & run.poses["valid"][case.rows]
    deskewed_m = towards(run.poses["position_m"][case.rows], case.truth)
    return tuple(rms((position_m - case.truth)[both]) for position_m in (deskewed_m, corrected.position_m))


def smoothed_rms_m(case):
    """RMS error of the product's smoother on the columns of the poses."""
    poses, count = case.run.poses, len(case.run.poses)
    newest = (poses["sequence"].astype(int) + 2) % 3
    used = np.isin((np.arange(count) - case.rows[0]) % case.step, np.arange(-2, 1) % case.step) if case.step > FRAME else np.ones(count, bool)
    start = case.run.truth["position_m"][0] / np.linalg.norm(case.run.truth["position_m"][0])
    tracker = _tricoil.Tracker("scaat", tricoil.COUPLING_CONSTANT, start.tolist(), False, 2.5 * SLOT_S, 0.0, "")
    sigma = np.full((count, 3), case.run.summary["assumed"]["coupling_sigma"])
    columns = poses["couplings"][np.arange(count), :, newest]
    rows = tracker.smooth(poses["time_s"][used], newest[used].astype(np.int32), columns[used], sigma[used])
    at = np.stack([np.interp(case.poses["time_s"], rows["time_s"], axis) for axis in rows["position_m"].T], axis=1)
    return rms((towards(at, case.truth) - case.truth)[case.inside])
