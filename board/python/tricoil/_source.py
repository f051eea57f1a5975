"""Poses one by one, from a device, a simulation or a recording."""

import dataclasses
import os
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _tricoil
from ._flags import Flag
from ._model import _three


def _sensor(sensor: int) -> int:
    if not 0 <= sensor <= 3:
        raise ValueError(f"sensor: must be 0 to 3; is {sensor}")
    return sensor


@dataclasses.dataclass(frozen=True, eq=False)
class Pose:
    """One pose.

    time_s: device time of the newest measurement. position_m: NaN, with an infinite covariance, without a sensor. covariance: (6, 6).
    couplings: signal matrix X (3, 3); zero if the device solved it.
    distortion_m: position error (3D, RMS) that metal near the coils suggests; part of the covariance. predicted_error_m: error that
    the motion and the noise predict; NaN while the motion is unknown.
    """

    time_s: float
    sequence: int
    sensor: int
    valid: bool
    flags: Flag
    position_m: NDArray
    quaternion_wxyz: NDArray
    covariance: NDArray
    couplings: NDArray
    distortion_m: float
    snr_db: float
    predicted_error_m: float

    @property
    def position_std_m(self) -> NDArray:
        """Standard deviations along the axes of the source frame, shape (3,)."""
        return np.sqrt(np.diag(self.covariance)[:3])

    @property
    def rotation_std_rad(self) -> NDArray:
        """Standard deviations of a small rotation about the axes of the source frame, shape (3,)."""
        return np.sqrt(np.diag(self.covariance)[3:])

    @classmethod
    def from_row(cls, row: np.void) -> "Pose":
        """From a row of Run.poses."""
        return cls(
            float(row["time_s"]),
            int(row["sequence"]),
            int(row["sensor"]),
            bool(row["valid"]),
            Flag(int(row["flags"])),
            row["position_m"].copy(),
            row["quaternion_wxyz"].copy(),
            row["covariance"].copy(),
            row["couplings"].copy(),
            float(row["distortion_m"]),
            float(row["snr_db"]),
            float(row["predicted_error_m"]),
        )


class Source:
    """Iterator over the poses of a source; also a context manager that closes it. See open()."""

    def __init__(self, name: str | os.PathLike, tracker: str | None = None):
        self._source = _tricoil.Source(os.fspath(name), "" if tracker is None else tracker)

    def poll(self, timeout_s: float = 0.1) -> Pose | None:
        """Next pose, or None if none came within timeout_s. Raises EOFError at the end of a simulation or recording."""
        row = self._source.poll(timeout_s)
        return None if row is None else Pose.from_row(row)

    def __iter__(self) -> "Source":
        return self

    def __next__(self) -> Pose:
        pose = None
        while pose is None:
            try:
                pose = self.poll(1.0)
            except EOFError:
                raise StopIteration from None
        return pose

    @property
    def status(self) -> str:
        """Status in words, for example that the device is not connected."""
        return self._source.status()

    @property
    def dropped(self) -> int:
        """Poses that were dropped because the program did not ask for them in time: 256 are buffered."""
        return self._source.dropped()

    def set_hemisphere(self, towards: Sequence[float], sensor: int = 0) -> None:
        """Direction from the source to the half space of the sensor, source frame."""
        self._source.set_hemisphere(_sensor(sensor), _three("towards", towards))

    def set_tip(self, tip_m: Sequence[float], sensor: int = 0, covariance_m2: ArrayLike | None = None) -> None:
        """Tip of a tool in the sensor frame, m. From now on poses give the position of the tip.

        covariance_m2: of the tip, shape (3, 3), as from pivot(); it is added to that of the position.
        """
        covariance = np.zeros((3, 3)) if covariance_m2 is None else np.asarray(covariance_m2, dtype=float)
        if covariance.shape != (3, 3):
            raise ValueError(f"covariance_m2: has shape {covariance.shape}; (3, 3) is needed")
        self._source.set_tip(_sensor(sensor), _three("tip_m", tip_m), covariance)

    def boresight(self, sensor: int = 0) -> None:
        """From now on the attitude of the last polled pose reads as the unit quaternion. Raises ValueError if that pose is invalid."""
        self._source.boresight(_sensor(sensor))

    def close(self) -> None:
        """Switches the coils off and releases the device. Later calls raise ValueError."""
        self._source.close()

    def __enter__(self) -> "Source":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def open(name: str | os.PathLike, tracker: str | None = None) -> Source:  # noqa: A001: named like its use, tricoil.open()
    """Opens a source of poses and returns a Source.

    name: can:INTERFACE, usb:VENDOR:PRODUCT, serial:PATH, columns:WHERE or couplings:WHERE (text of other hardware), a .toml
    configuration file of `tricoil run --config`, recording:FOLDER, or sim:SCENARIO[,KEY=VALUE...] with the keys mux, rate_hz,
    duration_s, seed, noise, stations (1 to 4 sensors) and realtime (yes or no; default no: as fast as poses are asked for).
    A device takes the keys hemisphere=X/Y/Z, the direction to the sensor's half space in the source frame, and confined: the sensor
    never leaves it (wall, table), so that it is found again after any loss; and wiring=FILE, see read_wiring(). Example: can:can0,hemisphere=1/0/0,confined.
    tracker: direct, previous, scaat or scaat,predict_s=SECONDS (poses ahead of the newest column);
    None: that of the configuration or recording, otherwise direct.

    A device need not be connected yet: iteration waits for it; Source.status gives its state. Raises ValueError for a wrong name
    or configuration, OSError if a coil line or file cannot be opened.
    """
    return Source(name, tracker)
