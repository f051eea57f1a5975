"""Simulated runs, and recordings."""

import dataclasses
import json
import os
import sys
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from . import _tricoil
from ._command import own_names


def angle_between(a: NDArray, b: NDArray) -> NDArray:
    """Angle between attitudes, rad. a, b: quaternions, shape (..., 4)."""
    dot = np.abs(np.sum(a * b, axis=-1))
    return 2 * np.arccos(np.clip(dot, 0, 1))


@dataclasses.dataclass(frozen=True)
class Run:
    """Result of a simulated run.

    poses: structured array with time_s, sequence, flags, sensor, valid, position_m (3), quaternion_wxyz (4), covariance (6, 6),
    couplings (3, 3), distortion_m, snr_db and predicted_error_m. truth: true poses at the same times: position_m, quaternion_wxyz.
    summary: the dictionary that `tricoil run --json` prints; it leaves out the first half second.
    """

    poses: NDArray
    truth: NDArray
    summary: dict

    def position_errors_m(self) -> NDArray:
        """Distance of each pose from its true position, shape (N,)."""
        return np.linalg.norm(self.poses["position_m"] - self.truth["position_m"], axis=1)

    def orientation_errors_rad(self) -> NDArray:
        """Angle of each pose from its true attitude, shape (N,)."""
        return angle_between(self.poses["quaternion_wxyz"], self.truth["quaternion_wxyz"])

    def rms_mm(self, after_s: float = 0.5) -> float:
        """RMS position error of the valid poses after the given time, mm; NaN if there are none."""
        errors = self.position_errors_m()[self.poses["valid"] & (self.poses["time_s"] >= after_s)]
        return 1e3 * float(np.sqrt(np.mean(errors**2))) if len(errors) else float("nan")


def run(
    scenario: str | os.PathLike = "hand",
    *,
    mux: str = "fdm",
    tracker: str = "direct",
    seed: int = 1,
    duration_s: float | None = None,
    rate_hz: float = 240.0,
    faults: str | Sequence[str] = (),
    noise: bool = True,
    trajectory: str | os.PathLike | None = None,
    place_m: Sequence[float] = (0.9, 0, 0),
    speed: float = 1.0,
    hemisphere: Sequence[float] | None = None,
    confined: bool = False,
    deskew: bool = True,
    passes: int = 1,
    predict_s: float = 0.0,
    record: str | os.PathLike | None = None,
    progress: bool | None = None,
) -> Run:
    """Tracks a simulated sensor, sample by sample, as `tricoil run` does, and returns a Run.

    scenario: built-in (`tricoil run --list`) or a .toml file. trajectory: file of a recorded path; it replaces the scenario's motion.
    mux: tdm (coils in turn) or fdm (all at once). tracker: direct, previous, previous-angles, scaat, fixed-direct or fixed-previous.
    faults: texts of `tricoil run --fault`. record: folder for a recording. progress: show it on a terminal; None: if there is one.
    The GIL is released; Ctrl-C ends the run with KeyboardInterrupt.
    """
    options = _tricoil.RunOptions()
    options.scenario = os.fspath(scenario)
    options.mux = mux
    options.tracker = tracker
    options.seed = seed
    options.duration_s = duration_s
    options.rate_hz = rate_hz
    options.faults = [faults] if isinstance(faults, str) else list(faults)
    options.noise = noise
    options.trajectory = "" if trajectory is None else os.fspath(trajectory)
    options.place_m = place_m
    options.speed = speed
    if hemisphere is not None:
        options.hemisphere = hemisphere
    options.confined = confined
    options.deskew = deskew
    options.passes = passes
    options.predict_s = predict_s
    options.record = "" if record is None else os.fspath(record)
    options.progress = sys.stderr.isatty() if progress is None else progress
    try:
        poses, truth, summary = _tricoil.run(options)
    except ValueError as error:
        raise ValueError(own_names(str(error))) from None
    return Run(poses, truth, json.loads(summary))


def load(folder: str | os.PathLike) -> NDArray:
    """Poses of a recording of `tricoil run --record`, as in Run.poses. Covariances and signal matrices are those recorded."""
    return _tricoil.load(os.fspath(folder))
