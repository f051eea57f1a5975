"""Ground truth of a motion: the call and its result. SciPy is imported by the call."""

import dataclasses
import os

from numpy.typing import NDArray

from ._poses import PoseError, Poses


@dataclasses.dataclass(frozen=True)
class Truth:
    """A fused path, in the frame and on the clock of its first stream.

    poses: at its times and, in its gaps, between them; quaternion_wxyz is None if all streams are positions. covariance: (N, 6, 6), position
    (m^2), then small rotation (rad^2), both in that frame. velocity_m_s, rate_rad_s: (N, 3), likewise. is_bridged: (N,), in a gap. streams,
    inertial: as in the result of the command.
    """

    poses: Poses
    covariance: NDArray
    velocity_m_s: NDArray
    rate_rad_s: NDArray
    is_bridged: NDArray
    streams: list
    inertial: dict | None


def truth(files, *, imu=None, joints=None, chain=None, link: str | None = None, lever_m=None, mount_wxyz=None, same_clock: bool = False, **reader) -> Truth:
    """Ground truth: one smoothed path with covariance from optical poses or positions, a robot's joints and an inertial sensor.

    files: names of files of poses, as read_poses() reads them with the options `reader`; the first gives frame, body and clock of the path. imu:
    table of time_s, acc_x_m_s2 to acc_z_m_s2 and gyr_x_rad_s to gyr_z_rad_s, or one of both; may be one of `files`. joints: table of time_s and one
    column a joint (rad, m); chain: its URDF (to `link`; None: the only last one), or a Denavit-Hartenberg table of joint, type, a_m, alpha_rad, d_m,
    theta_rad, convention (standard, modified). lever_m, mount_wxyz: place (m) and attitude of the inertial sensor in the body (v_body = q v_sensor);
    None: estimated. same_clock: its clock is that of the poses; otherwise the offset is estimated.

    Biases are constant but for a random walk; scales and axes of the sensor are estimated, within some percent. The noise is such that poses which
    are hidden from the fusion have the errors that their covariance says. Raises ValueError with the reason if the streams do not fit, OSError if a
    file cannot be read. See Truth for the result.
    """
    from ._command import own_names
    from ._truth_command import truth_of

    try:
        names = [files] if isinstance(files, (str, os.PathLike)) else files
        return truth_of(names, imu, joints, chain, link, lever_m, mount_wxyz, same_clock, **reader)
    except PoseError as error:
        raise ValueError(own_names(str(error), {"--lever": "lever_m", "--mount": "mount_wxyz"})) from None
