"""Ground truth: one path through streams of poses and an inertial sensor."""

import dataclasses

import numpy as np
from scipy.linalg import LinAlgError
from scipy.spatial.transform import Rotation, Slerp

from . import _fusion, _fusion_noise, _inertial, _match
from ._fusion import ACC_AXES, CONSTANTS, GRAVITY, GYRO_AXES, LEVER, MOUNT, OFFSET, PRIOR, STILL, Fusion, Integral, Measurement
from ._ground_truth import Truth
from ._poses import Poses, PoseError
from ._rotation import rotations, wxyz

FEWEST = 20
LONGEST_GAP_S = 1.0  # a longer gap is not bridged: the path before it and the one after it are fused apart
MOST_ACC_BIAS_M_S2, MOST_GYRO_BIAS_RAD_S = 2.0, 0.3  # ten times those of a usual sensor
PIECE, OVERLAP = 6000, 600  # nodes
OFFSET_S = 0.02  # deviation of the first clock offset
MERGED_S = 2e-5  # the equations of nodes that are closer are ill-conditioned


def turn_of(poses):
    return None if poses.quaternion_wxyz is None else rotations(poses.quaternion_wxyz)


def nodes_of(time_s, step_s):
    """All the times, and more in the gaps between them, so that no step is much longer than step_s."""
    parts = [time_s]
    gap = np.diff(time_s)
    for k in np.flatnonzero((gap > 1.5 * step_s) & (gap <= LONGEST_GAP_S)):
        count = int(np.rint(gap[k] / step_s))
        parts.append(time_s[k] + gap[k] * np.arange(1, count) / count)
    return np.sort(np.concatenate(parts))


def aligned(first: Poses, other: Poses):
    """The other stream in the frame, on the clock and at the body of the first one, and what was found."""
    pair, _, fit = _match.fitted(first, other, None, False, "--same-clock")
    a = fit.alignment
    time_s = a.middle_s + (other.time_s - a.middle_s - a.offset_s) / (1 + a.rate)
    turn, body = turn_of(other), turn_of(first)
    position, q = a.world.apply(other.position_m), None
    inside = np.ones(len(time_s), bool)
    if turn is not None:
        position = position + a.world.apply(turn.apply(a.mount_m))
        if body is not None:
            q = wxyz(a.world * turn * a.mount)
    elif body is not None:
        inside = (time_s >= first.time_s[0]) & (time_s <= first.time_s[-1])
        position[inside] += Slerp(first.time_s, body)(time_s[inside]).apply(a.mount_m)
    moved = Poses(time_s[inside], (a.scale * (position + a.world_m))[inside], None if q is None else q[inside], other.name, other.notes)
    return moved, {"clock_offset_s": float(a.offset_s), "clock_rate_ppm": float(1e6 * a.rate), "difference_m": float(fit.sigma_m), "scale_factor": float(a.scale)}


def merged_times(time_s, known_s):
    """Times closer than MERGED_S to a known one are that one."""
    n = np.clip(np.searchsorted(known_s, time_s), 1, len(known_s) - 1)
    near = np.where(time_s - known_s[n - 1] < known_s[n] - time_s, known_s[n - 1], known_s[n])
    return np.where(np.abs(time_s - near) < MERGED_S, near, time_s)


def without_ends(poses, begin, end, why):
    """The poses within the interval; a note counts the others."""
    keep = (poses.time_s >= begin) & (poses.time_s <= end)
    if keep.sum() < FEWEST:
        raise PoseError(f"{poses.name}: {keep.sum()} poses {why}; at least {FEWEST} are needed")
    if keep.all():
        return poses
    return dataclasses.replace(poses, time_s=poses.time_s[keep], position_m=poses.position_m[keep],
                               quaternion_wxyz=None if poses.quaternion_wxyz is None else poses.quaternion_wxyz[keep], deviation=None,
                               notes=(*poses.notes, f"{np.sum(~keep)} poses are not {why}"))


def parts_of(time_s):
    """The times between gaps of more than LONGEST_GAP_S."""
    return np.split(time_s, np.flatnonzero(np.diff(time_s) > LONGEST_GAP_S) + 1)


class Fuser:
    """Streams on one clock, and the fusion of parts of them."""

    def __init__(self, streams, inertial, lever_m, mount, same_clock):
        self.streams, self.inertial = streams, inertial
        self.first, self.turn = streams[0], turn_of(streams[0])
        self.step_s = float(np.median(np.diff(self.first.time_s)))
        self.acc = self.gyro = None
        self.known_lever_m, self.mount, self.offset_s = lever_m, Rotation.identity() if mount is None else mount.inv(), 0.0
        self.deviations = np.full(CONSTANTS, STILL)
        if inertial is not None:
            self.take_inertial(mount, same_clock)

    def take_inertial(self, mount, same_clock):
        inertial, first = self.inertial, self.first
        if self.turn is None:
            raise PoseError(f"{first.name}: has positions only; an inertial sensor is fused with poses, so give a file with attitudes first")
        offset_s, share = (0.0, None)
        self.deviations = PRIOR.copy()
        if inertial.gyro is not None:
            offset_s, share = _inertial.clock_offset(inertial, first.time_s, self.turn, 0.0 if same_clock else None)
            if share is not None:
                found = _inertial.first_mount(inertial, first, self.turn, 0.0 if same_clock else offset_s, share)
                self.mount = self.mount if mount is not None else found
            elif mount is None or not same_clock:
                raise PoseError(f"{first.name}: turns too little to show attitude and clock of the inertial sensor; give --mount and --same-clock, or leave out --imu")
        elif mount is None or not same_clock:
            raise PoseError(f"{inertial.name}: has no gyroscope, so give its attitude in the body with --mount QW,QX,QY,QZ, and --same-clock")
        self.offset_s = 0.0 if same_clock else offset_s
        begin, end = inertial.time_s[0] - self.offset_s, inertial.time_s[-1] - self.offset_s
        if min(end, first.time_s[-1]) - max(begin, first.time_s[0]) < 1:
            raise PoseError(f"{inertial.name}: does not overlap {first.name}: it is from {begin:.3f} to {end:.3f} s after the first pose, the poses end at "
                            f"{first.time_s[-1]:.3f} s")
        self.first = self.streams[0] = without_ends(first, begin, end, "within the time of the inertial sensor")
        self.turn = turn_of(self.first)
        if inertial.acc is not None:
            _inertial.check_accelerations(inertial, self.first, self.turn, self.mount, self.offset_s)
        self.step_s = min(self.step_s, float(np.median(np.diff(inertial.time_s))))
        self.acc = None if inertial.acc is None else Integral(inertial.time_s, inertial.acc)
        self.gyro = None if inertial.gyro is None else Integral(inertial.time_s, inertial.gyro)
        self.deviations[OFFSET] = STILL if same_clock else OFFSET_S
        if mount is not None:
            self.deviations[MOUNT] = STILL
        if self.known_lever_m is not None or self.acc is None:
            self.deviations[LEVER] = STILL
        if self.acc is None:
            self.deviations[GRAVITY] = self.deviations[ACC_AXES] = STILL
        if self.gyro is None:
            self.deviations[GYRO_AXES] = STILL

    def nodes(self, begin, end):
        inside = [one.time_s[(one.time_s >= begin) & (one.time_s <= end)] for one in self.streams]
        return nodes_of(np.unique(np.concatenate(inside)), self.step_s)

    def measurement(self, nodes_s, stream, factor=1.0):
        poses = self.streams[stream]
        inside = (poses.time_s >= nodes_s[0]) & (poses.time_s <= nodes_s[-1])
        turn = turn_of(poses)
        return Measurement(np.searchsorted(nodes_s, poses.time_s[inside]), poses.position_m[inside], None if turn is None else turn[inside],
                           np.broadcast_to(factor, (inside.sum(), 2)), stream == 0)

    def first_state(self, nodes_s):
        poses = self.first
        s = _inertial.first_state(nodes_s, poses, self.turn, self.acc, self.gyro, self.mount, self.offset_s)
        if self.known_lever_m is not None:
            s = dataclasses.replace(s, lever=-self.mount.apply(self.known_lever_m))
        return s

    def busiest(self):
        """Begin of the LONGEST_S with most motion."""
        time_s = self.first.time_s
        step = np.linalg.norm(np.diff(self.first.position_m, axis=0), axis=1)
        if self.turn is not None:
            step = step + 0.2 * (self.turn[:-1].inv() * self.turn[1:]).magnitude()
        step[np.diff(time_s) > LONGEST_GAP_S] = 0
        total = np.append(0, np.cumsum(step))
        end = np.searchsorted(time_s, time_s + _fusion_noise.LONGEST_S, side="right") - 1
        last = max(0, int(np.searchsorted(time_s, time_s[-1] - _fusion_noise.LONGEST_S)))
        return time_s[int(np.argmax((total[end] - total)[:last + 1]))]

    def learn(self):
        """Noise and constants, from the part with most motion."""
        begin = self.busiest()
        window = self.first.time_s[(self.first.time_s >= begin) & (self.first.time_s <= begin + _fusion_noise.LONGEST_S)]
        nodes_s = nodes_of(max(parts_of(window), key=len), self.step_s)
        m = self.measurement(nodes_s, 0)
        start = _fusion_noise.first_noise(self.acc, self.gyro, self.turn is not None)
        self.noise, fusion, self.constants = _fusion_noise.learned(
            lambda shown, noise: Fusion(nodes_s, self.acc, self.gyro, [shown], noise or start, self.deviations), self.first_state(nodes_s), m, nodes_s[m.node])
        self.mount, self.offset_s = self.constants.mount, self.constants.offset_s
        learned = 3 * np.sqrt(np.diag(fusion.constant_covariance))
        self.deviations[fusion.estimated] = np.minimum(self.deviations[fusion.estimated], np.maximum(learned, STILL))
        own = self.noise.optical
        self.factors = [np.ones(2)]
        for poses in self.streams[1:]:
            turn = turn_of(poses)
            white = [_fusion_noise.white_variance(poses.position_m), own[1] if turn is None else _fusion_noise.white_turn_variance(turn)]
            self.factors.append(np.maximum(white, _fusion_noise.LEAST) / own)

    def piece(self, nodes_s):
        """Fusion and state of some nodes."""
        measurements = [self.measurement(nodes_s, n, factor) for n, factor in enumerate(self.factors)]
        fusion = Fusion(nodes_s, self.acc, self.gyro, [m for m in measurements if len(m.node)], self.noise, self.deviations)
        c = self.constants
        s = dataclasses.replace(self.first_state(nodes_s), gravity=c.gravity, lever=c.lever, acc_axes=c.acc_axes, gyro_axes=c.gyro_axes)
        return fusion, fusion.fit(s)

    def path(self):
        """Rows of the whole path: time, position, quaternion, covariance, velocity, rate."""
        rows, self.left_out = [], 0
        for nodes_s in parts_of(self.nodes(self.first.time_s[0], self.first.time_s[-1])):
            if len(nodes_s) < FEWEST:
                self.left_out += len(nodes_s)
                continue
            for begin in range(0, len(nodes_s), PIECE):
                first, last = max(0, begin - OVERLAP), min(len(nodes_s), begin + PIECE + OVERLAP)
                fusion, s = self.piece(nodes_s[first:last])
                self.check_biases(s)
                rows.append(self.rows(fusion, s, np.arange(begin, min(begin + PIECE, len(nodes_s))) - first))
                self.result = s
        if not rows:
            raise PoseError(f"{self.first.name}: no {FEWEST} poses without a gap of {LONGEST_GAP_S:g} s")
        return [np.concatenate(one) for one in zip(*rows)]

    def check_biases(self, s):
        for sensor, bias, most, unit in ((self.acc, s.acc_bias, MOST_ACC_BIAS_M_S2, "m/s2"), (self.gyro, s.gyro_bias, MOST_GYRO_BIAS_RAD_S, "rad/s")):
            largest = 0 if sensor is None else np.median(np.abs(bias), axis=0).max()
            if largest > most:
                raise PoseError(f"{self.inertial.name}: would need a bias of {largest:.2g} {unit}; are its clock and attitude right, and is it on the same body?")

    def rows(self, fusion, s, keep):
        every = Measurement(keep, None, None, None)
        position, turn, by_state, by_constant = fusion.optical(s, every)
        rate = s.turn[keep].apply(fusion.rate(s)[keep])
        velocity = s.v[keep] + np.cross(rate, _fusion.cross_turn(s.turn[keep], s.lever))
        return fusion.time_s[keep], position, wxyz(turn), fusion.covariance(keep, by_state, by_constant), velocity, rate


def fused(streams, inertial=None, lever_m=None, mount=None, same_clock=False) -> Truth:
    """One path through streams of poses or positions, of which the first gives frame, body and clock, and an inertial sensor. Raises PoseError."""
    first = streams[0]
    if len(first) < FEWEST:
        raise PoseError(f"{first.name}: {len(first)} pose{'s' if len(first) != 1 else ''}; at least {FEWEST} are needed")
    origin_s = first.time_s[0]  # Unix times lose digits
    first = dataclasses.replace(first, time_s=first.time_s - origin_s)
    if inertial is not None:
        shift = origin_s if same_clock or abs(inertial.time_s[0] - origin_s) < 1e6 else inertial.time_s[0]
        inertial = _inertial.Inertial(inertial.time_s - shift, inertial.acc, inertial.gyro, inertial.name, inertial.notes)
    moved, found = [first], [{"file": first.name, "poses": len(first)}]
    for other in streams[1:]:
        one, facts = aligned(first, dataclasses.replace(other, time_s=other.time_s - other.time_s[0]))
        facts["clock_offset_s"] += float(other.time_s[0] - origin_s)
        known_s = np.unique(np.concatenate([each.time_s for each in moved]))
        moved.append(dataclasses.replace(one, time_s=merged_times(one.time_s, known_s)))
        found.append({"file": other.name, "poses": len(one), **facts})
    fuser = Fuser(moved, inertial, lever_m, mount, same_clock)
    try:
        fuser.learn()
        time_s, position, q, covariance, velocity, rate = fuser.path()
    except LinAlgError as error:
        raise PoseError(f"{first.name}: no path fits the measurements ({error}); are all of the same body?") from None
    s, noise = fuser.result, fuser.noise
    for one, poses in zip(found, fuser.streams):
        one["poses"] = len(poses)
    found[0].update(noise_m=float(np.sqrt(noise.optical[0])), noise_rad=None if fuser.turn is None else float(np.sqrt(noise.optical[1])),
                    smooth_error_m=float(np.sqrt(noise.smooth[0])), smooth_error_rad=None if fuser.turn is None else float(np.sqrt(noise.smooth[1])))
    facts = None
    if inertial is not None:
        arm = -s.mount.inv().apply(s.lever)
        x, y, z, w = s.mount.inv().as_quat()
        facts = {"file": inertial.name, "clock_offset_s": float(s.offset_s + shift - origin_s), "mount_wxyz": [float(v) for v in (w, x, y, z)],
                 "lever_m": arm.tolist(), "gravity_m_s2": float(np.linalg.norm(s.gravity)) if fuser.acc else None,
                 "gravity_direction": (s.gravity / np.linalg.norm(s.gravity)).tolist() if fuser.acc else None,
                 "acc_bias_m_s2": s.acc_bias.mean(axis=0).tolist() if fuser.acc else None, "gyro_bias_rad_s": s.gyro_bias.mean(axis=0).tolist() if fuser.gyro else None,
                 "acc_noise": float(np.sqrt(noise.acceleration)) if fuser.acc else None, "gyro_noise": float(np.sqrt(noise.rate)) if fuser.gyro else None}
    is_bridged = ~np.isin(time_s, np.concatenate([one.time_s for one in fuser.streams]))
    alone = (f"{first.name}: {fuser.left_out} poses between long gaps are left out",) if fuser.left_out else ()
    notes = alone + tuple(f"{one.name}: {note}" for one in (*fuser.streams, *([inertial] if inertial else [])) for note in one.notes)
    poses = Poses(time_s + origin_s, position, None if fuser.turn is None else q, first.name, notes)
    return Truth(poses, covariance, velocity, rate, is_bridged, found, facts)
