"""Quaternions of the package, (N, 4) with w first, and SciPy's rotations."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation


def rotations(quaternion_wxyz) -> Rotation:
    return Rotation.from_quat(np.asarray(quaternion_wxyz)[:, [1, 2, 3, 0]])


def wxyz(turn: Rotation) -> NDArray:
    return np.ascontiguousarray(turn.as_quat()[:, [3, 0, 1, 2]])


def with_x_along(x: NDArray) -> Rotation:
    """Rotations that turn the axis x to unit vectors (M, 3)."""
    y = np.cross(x, np.eye(3)[np.argmin(np.abs(x), axis=1)])
    y /= np.linalg.norm(y, axis=1, keepdims=True)
    return Rotation.from_matrix(np.stack((x, y, np.cross(x, y)), axis=2))


def crosses(v: NDArray) -> NDArray:
    """Matrices [v]x of vectors (N, 3)."""
    out = np.zeros((len(v), 3, 3))
    out[:, 0, 1], out[:, 0, 2], out[:, 1, 0] = -v[:, 2], v[:, 1], v[:, 2]
    out[:, 1, 2], out[:, 2, 0], out[:, 2, 1] = -v[:, 0], -v[:, 1], v[:, 0]
    return out
