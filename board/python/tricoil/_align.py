"""Alignment of a tracker's poses with a reference: clock, frames, mounting and scale.

tracker pose(t) = world * reference pose(t + offset + rate (t - middle)) * mount; the tracker's positions are `scale` times as large.
"""

import dataclasses

import numpy as np
from scipy.spatial.transform import Rotation

from ._poses import PoseError
from ._rotation import crosses, rotations

GRID_HZ = 100.0
MOST_CANDIDATES = 6
START_RANGE_S = 2.0  # about a given offset
SAME_CLOCK_RANGE_S = 0.25  # largest latency that is searched
LOWEST_CORRELATION = 0.5
TURNING_RAD_S = 0.1  # RMS; a slower turn does not show the frames


@dataclasses.dataclass
class Alignment:
    """offset_s, rate: of the reference's clock relative to the tracker's. Attitudes are Rotations. mount_m: in the frame of the body whose
    attitude is known (the reference's, or else the sensor's)."""

    offset_s: float
    middle_s: float
    rate: float = 0.0
    world: Rotation = dataclasses.field(default_factory=Rotation.identity)
    world_m: np.ndarray = dataclasses.field(default_factory=lambda: np.zeros(3))
    mount: Rotation = dataclasses.field(default_factory=Rotation.identity)
    mount_m: np.ndarray = dataclasses.field(default_factory=lambda: np.zeros(3))
    scale: float = 1.0
    slot_s: float = 0.0

    def reference_time(self, time_s):
        return time_s + self.offset_s + self.rate * (time_s - self.middle_s)


class Pair:
    """The two recordings, and the pose that the alignment expects of the sensor at a time of the tracker's clock."""

    def __init__(self, tracker_poses, tracker, reference):
        self.poses, self.tracker, self.reference = tracker_poses, tracker, reference
        self.compares_attitude = tracker.has_attitude and reference.has_attitude
        self.has_attitude = tracker.has_attitude or reference.has_attitude

    def expected(self, a: Alignment, time_s):
        """Position (N, 3) and attitude, without scale."""
        tau = a.reference_time(time_s)
        p = self.reference.p(tau)
        if self.reference.has_attitude:
            turn = self.reference.turn(tau)
            return a.world.apply(p + turn.apply(a.mount_m)) + a.world_m, a.world * turn * a.mount
        if self.tracker.has_attitude:
            turn = self.tracker.turn(time_s)
            return a.world.apply(p) + a.world_m + turn.apply(a.mount_m), turn
        return a.world.apply(p) + a.world_m, Rotation.identity(len(time_s))

    def motion(self, a: Alignment, time_s):
        """Velocity (m/s) and angular rate (rad/s) in the source frame."""
        tau = a.reference_time(time_s)
        v = a.world.apply(self.reference.p(tau, 1))
        rate = np.zeros_like(v)
        if self.reference.has_attitude:
            rate = a.world.apply(self.reference.rate(tau))
            return v + np.cross(rate, a.world.apply(self.reference.turn(tau).apply(a.mount_m))), rate
        if self.tracker.has_attitude:
            rate = self.tracker.rate(time_s)
            v = v + np.cross(rate, self.tracker.turn(time_s).apply(a.mount_m))
        return v, rate

    def covered(self, a: Alignment, time_s, before_s=0.0):
        inside = self.reference.covers(a.reference_time(time_s), before_s)
        return inside & self.tracker.covers(time_s, before_s) if self.has_attitude and not self.reference.has_attitude else inside


def correlation(a, a_known, b, b_known):
    """Normalised cross-correlation at every lag, with the number of samples that overlap; lag n: a[i] with b[i + n - len(a) + 1]."""
    a, b = np.where(a_known, a - a[a_known].mean(), 0), np.where(b_known, b - b[b_known].mean(), 0)
    ka, kb = a_known.astype(float)[::-1], b_known.astype(float)
    ra = a[::-1]
    size = 1 << (len(a) + len(b) - 2).bit_length()
    of_a, of_b = ([np.fft.rfft(one, size) for one in of] for of in ((ka, ra, ra * ra), (kb, b, b * b)))

    def convolved(m, k):
        return np.fft.irfft(of_a[m] * of_b[k], size)[: len(a) + len(b) - 1]

    n = np.rint(convolved(0, 0))
    some = np.maximum(n, 1)
    sa, sb = convolved(1, 0) / some, convolved(0, 1) / some
    va, vb = convolved(2, 0) / some - sa**2, convolved(0, 2) / some - sb**2
    cover = convolved(1, 1) / some - sa * sb
    tiny = 1e-6 * max(np.var(a), 1e-30) * max(np.var(b), 1e-30)
    return np.where(va * vb > tiny, cover / np.sqrt(np.maximum(va * vb, tiny)), 0), n


def speeds(path, times):
    """Speed and angular speed on a grid, and where they are known. The angular speed is None without attitude."""
    known = path.covers(times)
    inside = np.clip(times, path.time_s[0], path.time_s[-1])
    turning = np.linalg.norm(path.rate(inside), axis=1) if path.has_attitude else None
    return np.linalg.norm(path.p(inside, 1), axis=1), turning, known


def candidates(pair, start_s, range_s):
    """Clock offsets at which the speeds of both recordings agree, best first, each with its correlation."""
    step = 1 / GRID_HZ
    t = np.arange(pair.tracker.time_s[0], pair.tracker.time_s[-1], step)
    u = np.arange(pair.reference.time_s[0], pair.reference.time_s[-1], step)
    speed_t, turning_t, known_t = speeds(pair.tracker, t)
    speed_u, turning_u, known_u = speeds(pair.reference, u)
    if min(known_t.sum(), known_u.sum()) < 20:
        raise PoseError("there are too few poses between gaps to compare the motions")
    kinds = [(speed_t, speed_u)]
    if turning_t is not None and turning_u is not None:
        kinds.append((turning_t, turning_u))
    found = []
    for a, b in kinds:
        r, n = correlation(a, known_t, b, known_u)
        offsets = u[0] - t[0] + (np.arange(len(r)) - len(t) + 1) * step
        allowed = n >= max(1.0 * GRID_HZ, 0.15 * n.max())
        if start_s is not None:
            allowed &= abs(offsets - start_s) <= range_s
        score = np.where(allowed, r * np.sqrt(np.minimum(1, n / (0.5 * n.max()))), -1)
        peaks = 1 + np.flatnonzero((score[1:-1] >= score[:-2]) & (score[1:-1] > score[2:]) & (score[1:-1] > 0))
        best = sorted(peaks, key=lambda k: -score[k])[:MOST_CANDIDATES]
        found += [(float(r[k]), float(peak(offsets, r, k))) for k in best]
    found.sort(reverse=True)
    return [one for n, one in enumerate(found) if all(abs(one[1] - other) > 0.02 for _, other in found[:n])]


def peak(x, y, k):
    """Place of the maximum at sample k, by a parabola."""
    if 0 < k < len(y) - 1 and (bend := y[k - 1] - 2 * y[k] + y[k + 1]) < 0:
        return x[k] + (x[1] - x[0]) * 0.5 * (y[k - 1] - y[k + 1]) / bend
    return x[k]


def proper(h):
    """Rotation that is nearest to the matrix h, sum of a b^T (Kabsch), and its singular values."""
    u, s, v = np.linalg.svd(h)
    return Rotation.from_matrix(u @ np.diag([1, 1, np.linalg.det(u @ v)]) @ v), s


def with_lever(p, q, body):
    """Matrix A, offset and lever m of p = A q + offset + body m, by least squares, and the share of the motion that they explain."""
    n = len(p)
    columns = np.zeros((n, 3, 15))
    for axis in range(3):
        columns[:, axis, 3 * axis:3 * axis + 3] = q
    columns[:, :, 9:12] = np.eye(3)
    columns[:, :, 12:] = body
    matrix, right = columns.reshape(3 * n, 15), p.ravel()
    normal = matrix.T @ matrix
    x = np.linalg.lstsq(normal + 1e-6 * np.trace(normal) / 15 * np.eye(15) * (np.arange(15) >= 12), matrix.T @ right, rcond=1e-10)[0]
    left = np.sum((right - matrix @ x) ** 2)
    return x[:9].reshape(3, 3), x[9:12], x[12:], 1 - left / max(np.sum((p - p.mean(axis=0)) ** 2), 1e-12)


def lever_candidates(pair, start_s, range_s):
    """As candidates(), for a reference without attitude on a lever: its speed is another than the sensor's, a fit with a lever is not."""
    t = np.arange(pair.tracker.time_s[0], pair.tracker.time_s[-1], 0.04)
    t = t[pair.tracker.covers(t)]
    t = t[:: max(1, len(t) // 400)]
    p, body = pair.tracker.p(t), pair.tracker.turn(t).as_matrix()
    first, last = pair.reference.time_s[0] - t[-1], pair.reference.time_s[-1] - t[0]
    if start_s is not None:
        first, last = max(first, start_s - range_s), min(last, start_s + range_s)
    offsets = np.linspace(first, last, min(6000, max(3, int((last - first) / 0.03))))
    shares = np.zeros(len(offsets))
    for n, offset in enumerate(offsets):
        known = pair.reference.covers(t + offset)
        if known.sum() > max(40, 0.2 * len(t)):
            shares[n] = with_lever(p[known], pair.reference.p(t[known] + offset), body[known])[3]
    best = np.argsort(-shares)[:3]
    return [(float(np.sqrt(max(shares[k], 0))), float(peak(offsets, shares, k))) for k in best]


def first_frames(pair, offset_s, rows):
    """Frames and mount at this offset, without a search: relative turns and displacements do not depend on the mount of the body."""
    middle = 0.5 * (pair.poses.time_s[0] + pair.poses.time_s[-1])
    a = Alignment(offset_s, middle)
    t = pair.poses.time_s[rows]
    step = 0.15
    both = pair.covered(a, t) & pair.covered(a, t + step) & pair.tracker.covers(t) & pair.tracker.covers(t + step)
    t = t[both]
    if len(t) < 20:
        return None
    tau = a.reference_time(t)
    p, later = pair.tracker.p(t), pair.tracker.p(t + step)
    q, q_later = pair.reference.p(tau), pair.reference.p(tau + step)
    moved, moved_reference = later - p, q_later - q
    h = moved.T @ moved_reference / max(np.mean(np.sum(moved_reference**2, axis=1)), 1e-8)
    if pair.compares_attitude:
        turn_t, turn_r = pair.tracker.turn(t), pair.reference.turn(tau)
        turned = (pair.tracker.turn(t + step) * turn_t.inv()).as_rotvec()
        turned_reference = (pair.reference.turn(tau + step) * turn_r.inv()).as_rotvec()
        square = np.mean(np.sum(turned_reference**2, axis=1))
        if square > (TURNING_RAD_S * step) ** 2:
            by_turns = turned.T @ turned_reference / square
            weak = np.linalg.svd(by_turns, compute_uv=False)[1] < 0.02 * len(t)
            h = by_turns + (0.3 if weak else 0.001) * h
    a.world = proper(h)[0]
    if pair.tracker.has_attitude and not pair.reference.has_attitude:
        a.world = proper(with_lever(p, q, pair.tracker.turn(t).as_matrix())[0])[0]
    for _ in range(1 if pair.reference.has_attitude else 4):
        body = turn_of(pair, a, t, tau)
        # p - world q = world_m + (turn of the body, source frame) mount_m
        columns = np.concatenate([np.broadcast_to(np.eye(3), (len(t), 3, 3)), body], axis=2) if body is not None else np.broadcast_to(np.eye(3), (len(t), 3, 3))
        matrix = columns.reshape(3 * len(t), -1)
        right = (p - a.world.apply(q)).ravel()
        damping = 1e-3 * np.sqrt(len(t)) * np.diag([0.0] * 3 + [1.0] * (matrix.shape[1] - 3))
        x = np.linalg.lstsq(np.vstack((matrix, damping)), np.append(right, np.zeros(matrix.shape[1])), rcond=None)[0]
        a.world_m = x[:3]
        a.mount_m = x[3:] if body is not None else np.zeros(3)
        if body is None or pair.reference.has_attitude:
            break
        free = p - np.einsum("nij,j->ni", body, a.mount_m)
        a.world = proper((free - free.mean(axis=0)).T @ (q - q.mean(axis=0)))[0]
    if pair.compares_attitude:
        a.mount = ((a.world * turn_r).inv() * turn_t).mean()
    return a


def turn_of(pair, a, t, tau):
    """Matrices that convert mount_m to the source frame; None if no attitude is known."""
    if pair.reference.has_attitude:
        return (a.world * pair.reference.turn(tau)).as_matrix()
    return pair.tracker.turn(t).as_matrix() if pair.tracker.has_attitude else None


def residuals(pair, a, rows, error_m, error_turn, pose=None):
    """Measured minus expected: positions (N, 3) and rotation vectors (N, 3) or None. error_m, error_turn: predicted motion error. pose: that is
    expected, if it is known already."""
    p, turn = pose or pair.expected(a, pair.poses.time_s[rows])
    r = pair.poses.position_m[rows] - a.scale * p - error_m
    if not pair.compares_attitude:
        return r, None
    measured = rotations(pair.poses.quaternion_wxyz[rows])
    return r, (measured * (error_turn * turn).inv()).as_rotvec()


# Unknowns of one step, in this order.
OFFSET, RATE, WORLD, WORLD_M, MOUNT_M, SCALE, MOUNT = 0, 1, slice(2, 5), slice(5, 8), slice(8, 11), 11, slice(12, 15)
UNKNOWNS = 15


def jacobian(pair, a, rows, pose=None):
    """Derivatives of the expected position and attitude, (N, 3, 15) and (N, 3, 15) or None. pose: as in residuals()."""
    t = pair.poses.time_s[rows]
    tau = a.reference_time(t)
    p, _ = pose or pair.expected(a, t)
    v, rate = pair.motion(a, t)
    if not pair.reference.has_attitude:
        v = a.world.apply(pair.reference.p(tau, 1))
    of_p = np.zeros((len(t), 3, UNKNOWNS))
    late = t - a.middle_s
    of_p[:, :, OFFSET], of_p[:, :, RATE] = v, v * late[:, None]
    body = turn_of(pair, a, t, tau)
    turned = p - a.world_m
    if body is not None:
        of_p[:, :, MOUNT_M] = body
        if not pair.reference.has_attitude:
            turned = turned - body @ a.mount_m
    of_p[:, :, WORLD] = -crosses(turned)
    of_p[:, :, WORLD_M] = np.eye(3)
    of_p[:, :, SCALE] = p
    of_p[:, :, :SCALE] *= a.scale
    if not pair.compares_attitude:
        return of_p, None
    of_turn = np.zeros_like(of_p)
    of_turn[:, :, OFFSET], of_turn[:, :, RATE] = rate, rate * late[:, None]
    of_turn[:, :, WORLD] = np.eye(3)
    of_turn[:, :, MOUNT] = body
    return of_p, of_turn


def moved(a, x):
    """The alignment after a step of the unknowns."""
    return dataclasses.replace(
        a, offset_s=a.offset_s + x[OFFSET], rate=a.rate + x[RATE], world=Rotation.from_rotvec(x[WORLD]) * a.world, world_m=a.world_m + x[WORLD_M],
        mount=Rotation.from_rotvec(x[MOUNT]) * a.mount, mount_m=a.mount_m + x[MOUNT_M], scale=a.scale + x[SCALE])
