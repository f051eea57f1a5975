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
from ._ground_truth import Truth

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


def _bands(x: NDArray, y: NDArray):
    """Medians of x in bins of equal numbers, and the 10th, 50th and 90th percentile of y in each."""
    edges = np.quantile(x, np.linspace(0, 1, BINS + 1))
    part = np.clip(np.searchsorted(edges, x, side="right") - 1, 0, BINS - 1)
    filled = [n for n in range(BINS) if np.any(part == n)]
    return np.array([np.median(x[part == n]) for n in filled]), np.array([np.percentile(y[part == n], (10, 50, 90)) for n in filled]).T


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
        middle, (low, median, high) = _bands(rows[by], error_mm)
        axes.fill_between(middle, low, high, color="0.8", lw=0, label="10 to 90 % of the poses")
        axes.plot(middle, median, "o-", ms=3, lw=1, label="median of the poses")
        axes.set_xlabel(title)
        axes.legend(loc="upper left", ncols=2, fontsize="small")
    for axes in (by_time, *others):
        axes.set_ylabel("error, mm")
        axes.set_ylim(0, 1.25 * axes.get_ylim()[1])  # the legend is above the data
    return figure


def design(result: dict) -> "Figure":
    """Signal to noise and errors of planned coils over range; result: of `tricoil design`."""
    rows = result["ranges"]
    range_m = [row["range_m"] for row in rows]
    figure, (ratio, error) = _figure(2, f"{result['source']['turns']} turns, {result['source']['current_a']:g} A; one frame, {result['mux']}, {result['rate_hz']:g} frames/s")
    ratio.plot(range_m, [row["snr_db"] for row in rows], "o-", ms=3)
    ratio.set_ylabel("signal to noise, dB")
    error.semilogy(range_m, [1e3 * row["position_rms_m"] for row in rows], "o-", ms=3, label="position, mm")
    error.semilogy(range_m, [np.degrees(row["orientation_rms_rad"]) for row in rows], "o-", ms=3, label="angle, deg")
    error.set_ylabel("RMS error")
    error.set_xlabel("range, m")
    error.legend()
    for axes in (ratio, error):
        axes.grid(True, lw=0.3)
    return figure


def verify(result: dict) -> "Figure":
    """Result of tricoil.verify(): measured error (median, 10th to 90th percentile) and prediction by speed, angular rate and range; and how they agree."""
    errors = result["errors"]
    good = ~errors["is_outlier"]
    measured, predicted = (1e3 * errors[name][good] for name in ("measured_m", "predicted_m"))
    sizes = [np.linalg.norm(values, axis=1) for values in (measured, predicted)]
    figure, (by_speed, by_rate, by_range, agreement) = _figure(4, f"measured and predicted error; R2 {result['r2']:.3f}" if result["r2"] is not None else "measured error", shared=False)
    for axes, name, label in ((by_speed, "speed_m_s", "speed, m/s"), (by_rate, "rate_rad_s", "angular rate, rad/s"), (by_range, "range_m", "range, m")):
        middle, bands = _bands(errors[name][good], sizes[0])
        axes.fill_between(middle, bands[0], bands[2], color="0.8", lw=0, label="measured, 10 to 90 %")
        axes.plot(middle, bands[1], "ko", ms=4, label="measured, median")
        axes.plot(middle, _bands(errors[name][good], sizes[1])[1][1], "tab:red", label="predicted from the reference's motion")
        axes.set(xlabel=label, ylabel="error, mm")
        axes.set_ylim(bottom=0)
    by_speed.set_ylim(top=1.3 * by_speed.get_ylim()[1])
    by_speed.legend(loc="upper left", ncols=3, fontsize="small")
    for axis, name in enumerate("xyz"):
        middle, bands = _bands(predicted[:, axis], measured[:, axis])
        agreement.errorbar(middle, bands[1], (bands[1] - bands[0], bands[2] - bands[1]), fmt="o", ms=3, lw=0.8, label=name)
    ends = np.array((predicted.min(), predicted.max()))
    agreement.plot(ends, ends, "k", lw=0.8, label="equal")
    agreement.set(xlabel="predicted error, mm", ylabel="measured, mm")
    agreement.legend(loc="upper left", ncols=4)
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
