"""`tricoil couplings`: poses from recorded couplings of two bands, with the effect of metal removed."""

import difflib
import os
import re

import numpy as np

from ._band_checks import check_bands, median
from ._band_files import read_bands, read_coils
from ._dual_rate import DualRateParams, dual_rate
from ._output_file import OutputFile, refuse_input_as_output

COLUMNS = "time_us,x_m,y_m,z_m,qw,qx,qy,qz,std_x_m,std_y_m,std_z_m,std_rx_rad,std_ry_rad,std_rz_rad,valid,distortion_mm,low_band\n"
ROW = ",".join(["%.0f", *["%.7f"] * 3, *["%.8f"] * 4, *["%.4e"] * 6, "%d,%.4f,%d\n"])
ROWS_AT_ONCE = 4096
MOST_RATIO = 100_000
MOST_SCALAR = 20
CLOSEST_TO_MINUS_ONE = 0.05  # at -1 metal has no effect on the high band, and no bias can be estimated
TRACKERS = ("scaat", "direct")


def _number(name, value):
    try:
        return float(value)
    except (TypeError, ValueError):
        raise ValueError(f"--{name}: {value} is not a number") from None


def _ratio(value):
    text = str(value)
    if not re.fullmatch("0*[0-9]{1,6}", text, re.ASCII) or not 2 <= int(text) <= MOST_RATIO:
        raise ValueError(f"--ratio: {text} is not a whole number from 2 to {MOST_RATIO}")
    return int(text)


def _direction(value):
    numbers = value.split(",") if isinstance(value, str) else np.ravel(value)
    direction = np.array([_number("hemisphere", one) for one in numbers])
    if direction.shape != (3,) or not np.isfinite(direction).all() or not direction.any():
        raise ValueError("--hemisphere must be a direction: three finite numbers, not all zero")
    return direction


def _params(ratio, scalar, tracker, rate_hz, hemisphere):
    params = {"rows_per_line": _ratio(ratio), "filter": tracker == "scaat"}
    rate_hz = _number("rate-hz", rate_hz)
    if not 1 <= rate_hz <= 1e6:
        raise ValueError("--rate-hz must be from 1 to 1000000")
    if tracker not in TRACKERS:
        near = difflib.get_close_matches(str(tracker), TRACKERS, 1)
        hint = f"did you mean '{near[0]}'? " if near else ""
        raise ValueError(f"unknown --tracker '{tracker}'; {hint}choices: {', '.join(TRACKERS)}")
    if scalar is not None:
        params["scalar"] = _number("scalar", scalar)
        if not (abs(params["scalar"]) <= MOST_SCALAR and abs(1 + params["scalar"]) >= CLOSEST_TO_MINUS_ONE):
            raise ValueError(f"--scalar must be from -{MOST_SCALAR} to {MOST_SCALAR}, and not within {CLOSEST_TO_MINUS_ONE} of -1")
    if hemisphere is not None:
        params["hemisphere"] = _direction(hemisphere)
    return DualRateParams(row_period_s=1 / rate_hz, **params)


def _csv(poses, first, params):
    """One row for each high-band line, from line `first` on. low_band is 1 at rows that have the time of a low-band line."""
    n = first + np.arange(len(poses.is_valid))
    sigmas = np.repeat(np.stack((poses.position_sigma_m, poses.rotation_sigma_rad), axis=1), 3, axis=1)
    values = np.column_stack((1e6 * (n * params.row_period_s), poses.position_m, poses.quaternion_wxyz, sigmas, poses.is_valid, 1e3 * poses.distortion_m,
                              n % params.rows_per_line == 0))
    return "".join(ROW % tuple(row) for row in values.tolist())


def run(high, low, ratio, calibration, out, scalar=None, tracker="scaat", rate_hz=1500, hemisphere=None) -> dict:
    """Result, as `--json` prints it. Raises ValueError; OSError if a disk fails. Writes `out`, or leaves no file."""
    params = _params(ratio, scalar, tracker, rate_hz, hemisphere)
    high, low, calibration, out = map(os.fspath, (high, low, calibration, out))
    refuse_input_as_output({"--out": out}, [high, low, calibration])
    coils = read_coils(calibration)
    bands = read_bands(high, low, params.rows_per_line)
    check_bands((high, low), coils, bands, params.rows_per_line, params.hemisphere)
    with OutputFile(out) as file:
        poses, low_lines, found = dual_rate(*coils, *bands, params)
        file.write(COLUMNS)
        for first in range(0, len(bands[0]), ROWS_AT_ONCE):
            file.write(_csv(poses[first:first + ROWS_AT_ONCE], first, params))
        file.commit()
    valid = poses[poses.is_valid]
    return {"rows": len(bands[0]), "rows_valid": len(valid.is_valid), "low_lines": low_lines, "scalar": found.value, "scalar_sigma": found.sigma,
            "scalar_given": scalar is not None, "distortion_median_mm": 1e3 * median(valid.distortion_m),
            "distortion_max_mm": 1e3 * float(valid.distortion_m.max(initial=0)), "position_sigma_median_m": median(valid.position_sigma_m),
            "tracker": tracker, "out": out}


def text(r: dict) -> str:
    """The result as lines."""
    found = "(given)" if r["scalar_given"] else f"(estimated, sigma {r['scalar_sigma']:.4f})"
    return (f"poses        {r['rows']} rows, {r['rows_valid']} valid, {r['low_lines']} low-band lines: {r['out']}\n"
            f"scalar       {r['scalar']:.4f} {found}\n"
            f"distortion   median {r['distortion_median_mm']:.3f} mm, max {r['distortion_max_mm']:.3f} mm of the high band alone\n"
            f"sigma        median {1e3 * r['position_sigma_median_m']:.3f} mm per axis\n")
