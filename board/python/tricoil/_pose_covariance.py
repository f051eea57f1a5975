"""Covariance of corrected poses, from the noise of the columns."""

import numpy as np

from ._column_series import series_of
from ._frame_solver import matrices
from ._pose_path import Curve
from ._timing import COLUMNS

GRID = 45  # poses of a stretch on which the weights of the splines are computed; they decay by a factor of two each pose


def weight_products(time_s, column_time_s, timing):
    """Products of the weights with which the splines take the noise of the columns of two coils to each time stamp, (N, 3, 3).

    Noise of the columns of one pose is correlated, since a pose shows six of nine numbers. If each column is in several poses, it is taken as
    independent.
    """
    count = min(len(time_s), GRID)
    half = count // 2
    if timing.has_phases(time_s):
        series = series_of(column_time_s[:count], np.zeros((count, 1, COLUMNS)), timing.slot_s)
        weights = [Curve(one.time_s, np.eye(len(one.time_s)))(time_s[:count]) for one in series]
        products = np.stack([np.sum(one**2, axis=1)[:, None] * np.eye(COLUMNS)[coil] for coil, one in enumerate(weights)], axis=1)
    else:
        weights = np.stack([Curve(column_time_s[:count, coil], np.eye(count))(time_s[:count]) for coil in range(COLUMNS)], axis=1)
        products = np.einsum("njk,nlk->njl", weights, weights)
    n = np.arange(len(time_s))
    inside = half + (n - half) % COLUMNS  # the same newest column
    return products[np.where(n < half, n, np.where(n >= len(time_s) - half, n - len(time_s) + count, inside))]


def derivatives(pose):
    """Derivatives of the nine couplings by position and rotation, (N, 9, 6), by central differences."""
    from scipy.spatial.transform import Rotation

    from ._rotation import rotations, wxyz

    step = 1e-5
    turn = rotations(pose[1])
    result = np.empty((len(pose[0]), 9, 6))
    for axis in range(3):
        shift = step * np.eye(3)[axis]
        for column, (first, second) in ((axis, ((pose[0] + shift, pose[1]), (pose[0] - shift, pose[1]))),
                                        (axis + 3, [(pose[0], wxyz(Rotation.from_rotvec(sign * shift) * turn)) for sign in (1, -1)])):
            result[:, :, column] = (matrices(first) - matrices(second)).reshape(-1, 9) / (2 * step)
    return result


def covariance_of(pose, sigma, products):
    """Covariance of poses from columns whose noise lies in the six visible directions, moved by the splines; (N, 6, 6)."""
    by_pose = derivatives(pose)
    gain = np.linalg.pinv(by_pose)  # of the maximum-likelihood solver: (6, 9)
    visible = by_pose @ gain
    each = [gain.reshape(-1, 6, 3, 3)[:, :, :, coil] @ visible.reshape(-1, 3, 3, 9)[:, :, coil] for coil in range(COLUMNS)]
    total = sum(products[:, j, k, None, None] * (each[j] @ each[k].transpose(0, 2, 1)) for j in range(COLUMNS) for k in range(COLUMNS))
    return sigma[:, None, None] ** 2 * total
