"""Simulated runs, and recordings."""

import dataclasses
import json
import os
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from . import _tricoil
from ._command import own_names
from ._model import _three
from ._progress import is_wanted


def angle_between(a: NDArray, b: NDArray) -> NDArray:
    """Angle between attitudes, rad. a, b: quaternions, shape (..., 4)."""
    dot = np.abs(np.sum(a * b, axis=-1))
    return 2 * np.arccos(np.clip(dot, 0, 1))


@dataclasses.dataclass(frozen=True, eq=False)
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
    fidelity: str = "samples",
    record: str | os.PathLike | None = None,
    progress: bool | None = None,
) -> Run:
    """Tracks a simulated sensor as `tricoil run` does, and returns a Run.

    scenario: built-in (`tricoil run --list`) or a .toml file. trajectory: file of a recorded path; it replaces the scenario's motion.
    mux: tdm (coils in turn), fdm (all at once) or dual-band (all at once, with a low carrier each). tracker: direct, previous,
    scaat, dual-band, fixed-direct or fixed-previous.
    seed: of motion and noise. rate_hz: column frames per second. faults: texts of `tricoil run --fault`. noise: False for ideal
    converters without mains hum. speed: of the motion. place_m: of a trajectory. hemisphere: direction from the source to the half space of the
    sensor; None: that of the start; zero: unknown; if given, also confined. confined: the sensor never leaves it. deskew: for direct and previous with tdm.
    passes: steps per pose of previous. predict_s: prediction of scaat. fidelity: samples, or columns: couplings with the
    noise of the demodulator without samples; the same errors, and many times faster. record: folder for a recording. progress: live view on
    standard error; None: if it is a terminal. The GIL is released; Ctrl-C ends the run with KeyboardInterrupt.
    """
    options = _tricoil.RunOptions()
    options.scenario = os.fspath(scenario)
    options.mux = mux
    options.tracker = tracker
    if not 0 <= seed < 1 << 64:
        raise ValueError(f"seed: must be 0 to 2^64 - 1; is {seed}")
    options.seed = seed
    options.duration_s = duration_s
    options.rate_hz = rate_hz
    options.faults = [faults] if isinstance(faults, str) else list(faults)
    options.no_noise = not noise
    options.trajectory = "" if trajectory is None else os.fspath(trajectory)
    options.place_m = _three("place_m", place_m)
    options.speed = speed
    if hemisphere is not None:
        options.hemisphere = _three("hemisphere", hemisphere)
    options.confined = confined
    options.no_deskew = not deskew
    options.passes = passes
    options.predict_s = predict_s
    options.fidelity = fidelity
    options.record = "" if record is None else os.fspath(record)
    options.progress = is_wanted(progress)
    try:
        poses, truth, summary = _tricoil.run(options)
    except ValueError as error:
        names = {"--predict": "predict_s", "--duration": "duration_s", "--no-deskew": "deskew=False", "--place": "place_m"}
        raise ValueError(own_names(str(error), names)) from None
    return Run(poses, truth, json.loads(summary))


def load(folder: str | os.PathLike) -> NDArray:
    """Poses of a recording of `tricoil run --record`, as in Run.poses. Covariances and signal matrices are those recorded.

    Ctrl-C raises KeyboardInterrupt.
    """
    return _tricoil.load(os.fspath(folder))
