"""Which point was measured in which hole of a board."""

import itertools

import numpy as np
from numpy.typing import NDArray

from ._board import Board
from ._poses import METRES, PoseError

LARGEST_SHARE = 0.1  # of a distance: error of a tracker that still measures this board
LARGEST_M = 3e-3
MOST_FITS = 20_000
CLEAR = 2.0  # the next best fit must be so many times worse


def rigid(source: NDArray, target: NDArray) -> tuple[NDArray, NDArray]:
    """Rotation matrix and shift that move `source` (N, 3) best onto `target`. Kabsch, Acta Cryst. A 32, 922 (1976)."""
    a, b = source.mean(axis=0), target.mean(axis=0)
    u, _, v = np.linalg.svd((source - a).T @ (target - b))
    turn = (u @ np.diag((1, 1, np.linalg.det(u @ v))) @ v).T
    return turn, b - turn @ a


def left_m(points, holes) -> float:
    """RMS distance of points from their holes after the best rigid motion, m."""
    turn, shift = rigid(holes, points)
    return float(np.sqrt(np.mean(np.sum((points - holes @ turn.T - shift) ** 2, axis=1))))


def distances(points: NDArray) -> NDArray:
    return np.linalg.norm(points[:, None] - points[None], axis=2)


def triangle(points: NDArray) -> list[int]:
    """Three points that are far apart."""
    apart = distances(points)
    first, second = np.unravel_index(np.argmax(apart), apart.shape)
    line = points[second] - points[first]
    heights = np.linalg.norm(np.cross(points - points[first], line), axis=1)
    return [int(first), int(second), int(np.argmax(heights))]


def candidates(points, holes, corners):
    """Holes that three points may be: all of whose distances fit."""
    apart, wanted = distances(holes), distances(points[corners])
    near = [np.abs(apart - wanted[i, j]) < LARGEST_SHARE * wanted[i, j] + LARGEST_M for i, j in ((0, 1), (0, 2), (1, 2))]
    for a, b in np.argwhere(near[0]):
        for c in np.flatnonzero(near[1][a] & near[2][b]):
            if len({a, b, c}) == 3:
                yield [a, b, c]


def assigned(points, holes, corners, start):
    """Hole of each point, from a first fit of three; None if a point is far from every hole."""
    which = np.array(start)
    turn, shift = rigid(holes[which], points[corners])
    for _ in range(3):
        moved = holes @ turn.T + shift
        apart = np.linalg.norm(points[:, None] - moved[None], axis=2)
        which = apart.argmin(axis=1)
        if len(set(which)) < 3:
            return None
        turn, shift = rigid(holes[which], points)
    size = distances(points).max()
    return which if apart.min(axis=1).max() < LARGEST_SHARE * size / 2 + LARGEST_M else None


def refuse_other_unit(points, board):
    """A board in another unit is named. Raises PoseError."""
    ratio = distances(points).max() / max(distances(board.position_m).max(), 1e-12)
    for unit, metres in METRES.items():
        for other, its in METRES.items():
            if unit != other and 0.8 < ratio * metres / its < 1.25 and not 0.5 < ratio < 2:
                raise PoseError(f"{board.name}: the points are {ratio:.3g} times as far apart as the holes; is the board, or the file of poses, in {other} and not {unit}?")


def match(points: NDArray, board: Board, holes: str | list | None = None) -> NDArray:
    """Index of the hole of each point, (P,). holes: their names in the order of the points; otherwise the order of the board is tried, then
    every one. Raises PoseError if none fits, or several do."""
    if holes:
        names = [word.strip() for word in holes.split(",")] if isinstance(holes, str) else list(map(str, holes))
        if len(names) != len(points):
            raise PoseError(f"--holes: {len(names)} names; {len(points)} points were found")
        return board.at(names)
    if len(points) < 4:
        raise PoseError(f"{len(points)} points are too few to find their holes; give --holes, or measure four or more")
    known = board.position_m
    size = distances(points).max()
    spacing = np.min(distances(known)[~np.eye(len(known), dtype=bool)])
    if len(points) == len(known) and left_m(points, known) < min(LARGEST_SHARE / 4 * size, spacing / 4):
        return np.arange(len(known))
    corners = triangle(points)
    fits = {}
    for start in itertools.islice(candidates(points, known, corners), MOST_FITS):
        which = assigned(points, known, corners, start)
        if which is not None:
            fits[tuple(which)] = left_m(points, known[which])
    if not fits:
        refuse_other_unit(points, board)
        mirror = points * (1, 1, -1)
        starts = itertools.islice(candidates(mirror, known, corners), MOST_FITS)
        mirrored = any(assigned(mirror, known, corners, start) is not None for start in starts)
        why = "; they fit its mirror image: the poses are left-handed, or the board is" if mirrored else "; give their names with --holes"
        raise PoseError(f"{board.name}: the points are not at holes of this board{why}")
    order = sorted(fits, key=fits.get)
    if len(order) > 1 and fits[order[1]] < CLEAR * fits[order[0]] + 1e-4:
        raise PoseError(f"{board.name}: the points fit this board in more than one way ({fits[order[0]] * 1e3:.2f} and {fits[order[1]] * 1e3:.2f} mm RMS); give their names with --holes")
    return np.array(order[0])
