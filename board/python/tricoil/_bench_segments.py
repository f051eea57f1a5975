"""Parts of a file of poses in which the sensor, or the tip of a pointer, is at rest."""

import dataclasses

import numpy as np
from numpy.typing import NDArray

from ._poses import PoseError, Poses

LEAST_S = 1.0  # of a rest
LEAST_POSES = 10
KINDS = ("rest", "pivot", "hinge", "pendulum")
WINDOW_S = 0.5  # in which a rest may not move
LEAST_M, LARGEST_M = 2e-4, 2e-3  # movement at rest
LEVER_M = 0.1  # arm with which a rotation counts as a movement


@dataclasses.dataclass(frozen=True)
class Segment:
    """Poses begin to end - 1. kind: one of KINDS, or "" if it is still to be found."""

    begin: int
    end: int
    kind: str = ""

    def __len__(self):
        return self.end - self.begin

    @property
    def rows(self):
        return slice(self.begin, self.end)


def matrices(poses: Poses) -> NDArray:
    """Rotation matrices of the attitudes, (N, 3, 3)."""
    from ._rotation import rotations

    return rotations(poses.quaternion_wxyz).as_matrix()


def window_of(poses: Poses) -> int:
    """Poses of WINDOW_S, odd."""
    step = float(np.median(np.diff(poses.time_s)))
    return 2 * max(2, round(WINDOW_S / step / 2)) + 1


def still_radius(track: NDArray) -> float:
    """Movement that is noise, m: from the quietest differences of successive poses."""
    return float(np.clip(8 * np.quantile(np.linalg.norm(np.diff(track, axis=0), axis=1), 0.05), LEAST_M, LARGEST_M))


def rests_of(poses: Poses, track: NDArray, radius: float) -> list[Segment]:
    """Parts in which `track` (N, D), m, stays within `radius` of its median for LEAST_S; without their ends, in which it comes or leaves."""
    from scipy.ndimage import maximum_filter1d, median_filter, minimum_filter1d

    size = window_of(poses)
    if len(poses) < max(LEAST_POSES, size):
        return []
    is_still = np.ones(len(poses), bool)
    for values in median_filter(track, size=(min(5, size), 1)).T:
        is_still &= maximum_filter1d(values, size) - minimum_filter1d(values, size) <= 2 * radius
    is_still[1:] &= np.diff(poses.time_s) < WINDOW_S
    edges = np.flatnonzero(np.diff(np.concatenate(([0], is_still.astype(int), [0]))))
    found: list[Segment] = []
    for begin, end in zip(edges[::2], edges[1::2]):
        here = np.median(track[begin:end], axis=0)
        if found and np.linalg.norm(here - np.median(track[found[-1].rows], axis=0)) < radius and poses.time_s[begin] - poses.time_s[found[-1].end - 1] < 2 * LEAST_S:
            found[-1] = Segment(found[-1].begin, int(end))
        else:
            found.append(Segment(int(begin), int(end)))
    return [one for one in found if len(one) >= LEAST_POSES and poses.time_s[one.end - 1] - poses.time_s[one.begin] >= LEAST_S]


def rests_of_sensor(poses: Poses) -> list[Segment]:
    """Parts in which neither position nor attitude moves."""
    track = poses.position_m
    if poses.quaternion_wxyz is not None:
        turns = LEVER_M * matrices(poses)
        track = np.hstack((track, turns[:, :, 0], turns[:, :, 1]))
    return [dataclasses.replace(one, kind="rest") for one in rests_of(poses, track, still_radius(track))]


def parse(text: str | list | None, poses: Poses) -> list[Segment]:
    """Segments of FROM-TO or FROM-TO:KIND, separated by commas; seconds from the first pose. Raises PoseError."""
    segments = []
    for word in (text.split(",") if isinstance(text, str) else np.atleast_1d([] if text is None else text).tolist()):
        times, _, kind = str(word).strip().partition(":")
        ends = times.split("-")
        try:
            begin_s, end_s = map(float, ends)
        except ValueError:
            raise PoseError(f"--segments must be FROM-TO or FROM-TO:KIND in seconds, for example 0-10:rest,12-30:pivot; is '{word}'") from None
        if kind and kind not in KINDS:
            raise PoseError(f"--segments: unknown kind '{kind}'; it must be {', '.join(KINDS)}")
        begin, end = np.searchsorted(poses.time_s - poses.time_s[0], (begin_s - 1e-9, end_s + 1e-9))
        if end - begin < LEAST_POSES:
            raise PoseError(f"--segments: {word} has {max(0, end - begin)} poses; at least {LEAST_POSES} are needed")
        segments.append(Segment(int(begin), int(end), kind))
    return segments
