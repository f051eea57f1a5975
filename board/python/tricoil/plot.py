"""Drawings of runs and of the error model. Needs matplotlib.

>>> import tricoil.plot
>>> tricoil.plot.run(tricoil.run("hand", tracker="scaat")).savefig("hand.png")
"""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ._flags import Flag
from ._motion_error import MotionError
from ._run import Run
from ._truth import Truth

MOST_POINTS = 4000  # of a curve
BINS = 15  # with equal numbers of poses

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def _figure(rows: int, title: str, shared: bool = True):
    from matplotlib.figure import Figure  # not pyplot: no window, no global state

    figure = Figure(figsize=(9, 2.4 * rows), layout="constrained")
    figure.suptitle(title)
    return figure, figure.subplots(rows, 1, sharex=shared, squeeze=False)[:, 0]


def _shade_invalid(axes, poses: NDArray) -> None:
    """Grey bands where poses are invalid."""
    invalid = np.concatenate(([False], ~poses["valid"], [False])).astype(int)
    begins, ends = np.flatnonzero(np.diff(invalid) == 1), np.flatnonzero(np.diff(invalid) == -1) - 1
    for begin, end in zip(begins, ends):
        axes.axvspan(poses["time_s"][begin], poses["time_s"][end], color="0.85", lw=0)


def run(result: Run) -> "Figure":
    """Position, position error with its standard deviation, and flags over time. Grey: invalid poses."""
    poses, valid = result.poses, result.poses["valid"]
    if not len(poses):
        raise ValueError("the run has no poses")
    summary = result.summary
    figure, (path, error, flags) = _figure(3, f"{summary['scenario']}, {summary['tracker']}")
    for axis, name in enumerate("xyz"):
        path.plot(poses["time_s"], np.where(valid, poses["position_m"][:, axis], np.nan), label=name)
        path.plot(poses["time_s"], result.truth["position_m"][:, axis], "k:", lw=0.8, label="true" if axis == 2 else None)
    path.set_ylabel("position, m")
    deviation = np.sqrt(np.trace(poses["covariance"][:, :3, :3], axis1=1, axis2=2))
    error.semilogy(poses["time_s"], 1e3 * np.where(valid, result.position_errors_m(), np.nan), lw=0.8, label="error")
    error.semilogy(poses["time_s"], 1e3 * np.where(valid, deviation, np.nan), lw=0.8, label="standard deviation")
    error.set_ylabel("position error, mm")
    seen = [flag for flag in Flag if np.any(poses["flags"] & flag)]
    for row, flag in enumerate(seen):
        times = poses["time_s"][(poses["flags"] & flag) != 0]
        flags.plot(times, np.full(len(times), row), "|", markersize=8)
    flags.set_yticks(range(len(seen)), [str(flag) for flag in seen])
    flags.set_ylim(-0.5, max(len(seen), 1) - 0.5)
    flags.set_xlabel("time, s")
    for axes in (path, error, flags):
        _shade_invalid(axes, poses)
    path.legend(loc="upper right", ncols=4)
    error.legend(loc="upper right", ncols=2)
    return figure


def motion(updates: NDArray, title: str = "") -> "Figure":
    """Measured and predicted errors of range, azimuth and elevation, from tricoil.motion()."""
    figure, rows = _figure(3, title)
    for axes, name, label in zip(rows, ("e_rho_m", "e_alpha_rad", "e_beta_rad"), ("range, m", "azimuth, rad", "elevation, rad")):
        axes.plot(updates["time_s"], updates[name][:, 0], label="measured")
        axes.plot(updates["time_s"], updates[name][:, 1], "k:", label="predicted")
        axes.set_ylabel(f"error of {label}")
    rows[0].legend(loc="upper right", ncols=2)
    rows[-1].set_xlabel("time, s")
    return figure


def motion_error(result: MotionError) -> "Figure":
    """Predicted motion error by speed, angular rate and range, with bands from the 10th to the 90th percentile, and over time with its deviation."""
    from ._motion_command import TITLES

    rows = result.rows[result.rows["is_predicted"]]
    error_mm = 1e3 * np.linalg.norm(rows["total"][:, :3], axis=1)
    deviation_mm = 1e3 * np.linalg.norm(rows["total_deviation"][:, :3], axis=1)
    figure, (by_time, *others) = _figure(4, f"motion error of {result.corrected.name}, predicted for {result.timing.text}", shared=False)
    every = max(1, len(rows) // MOST_POINTS)
    shown = slice(None, None, every)
    by_time.fill_between(rows["time_s"][shown], (error_mm - deviation_mm).clip(0)[shown], (error_mm + deviation_mm)[shown], color="0.8", lw=0, label="deviation")
    by_time.plot(rows["time_s"][shown], error_mm[shown], lw=0.8, label="position error")
    by_time.set_xlabel("time, s")
    by_time.legend(loc="upper right", ncols=2)
    for axes, (by, title) in zip(others, TITLES.items()):
        edges = np.quantile(rows[by], np.linspace(0, 1, BINS + 1))
        part = np.clip(np.searchsorted(edges, rows[by], side="right") - 1, 0, BINS - 1)
        filled = [n for n in range(BINS) if np.any(part == n)]
        middle = [np.median(rows[by][part == n]) for n in filled]
        low, median, high = np.array([np.percentile(error_mm[part == n], (10, 50, 90)) for n in filled]).T
        axes.fill_between(middle, low, high, color="0.8", lw=0)
        axes.plot(middle, median, "o-", ms=3, lw=1)
        axes.set_xlabel(title)
    for axes in (by_time, *others):
        axes.set_ylabel("error, mm")
        axes.set_ylim(bottom=0)
    return figure


def truth(result: Truth) -> "Figure":
    """Position and its standard deviation over time. Grey: bridged gaps."""
    time_s, position = result.poses.time_s, result.poses.position_m
    figure, (path, deviation) = _figure(2, result.poses.name)
    edges = np.flatnonzero(np.diff(np.concatenate(([False], result.is_bridged, [False])).astype(int)))
    for begin, end in zip(edges[::2], edges[1::2] - 1):
        for axes in (path, deviation):
            axes.axvspan(time_s[begin], time_s[end], color="0.85", lw=0)
    rows = slice(None, None, max(1, len(time_s) // MOST_POINTS))
    variance = np.diagonal(result.covariance, axis1=1, axis2=2)
    for axis, name in enumerate("xyz"):
        path.plot(time_s[rows], position[rows, axis], lw=0.8, label=name)
    path.set_ylabel("position, m")
    path.legend(loc="upper right", fontsize="small")
    deviation.semilogy(time_s[rows], 1e3 * np.sqrt(variance[rows, :3].sum(axis=1)), lw=0.8)
    deviation.set_ylabel("deviation (3D), mm")
    deviation.set_xlabel("time, s")
    return figure
