"""Fusion of optical poses with an inertial sensor: the most probable path and its covariance, all samples at once.

The motion model is that of core/tracking/scaat/propagate.hpp: constant velocity with white acceleration around a mean, which the accelerometer
measures here, and likewise the angular rate. Gauss-Newton on all states is the Rauch-Tung-Striebel smoother, iterated (Bell 1994, SIAM Journal on
Optimization 4(3)); it also estimates constants: gravity, mounting and clock offset. The normal matrix is block tridiagonal, bordered by the constants.
"""

import dataclasses

import numpy as np
from numpy.linalg import LinAlgError
from scipy.linalg.lapack import dpotrf, dtrtri
from scipy.spatial.transform import Rotation

from ._rotation import crosses

# States of a node. The error of the optical system has a smooth part, with its rate, besides the white one: its software filters and interpolates.
POSITION, VELOCITY, TURN, ACC_BIAS, GYRO_BIAS = (slice(n, n + 3) for n in range(0, 15, 3))
SMOOTH, SMOOTH_RATE = slice(15, 21), slice(21, 27)
STATES = 27
MOTION, ERROR = slice(0, 15), slice(15, STATES)  # no equation of motion has states of both
SEEN = np.r_[0:3, 6:9, 15:21]  # states by which the predicted poses change: position, turn and smooth error
BY_CONSTANTS = slice(0, 9)  # states whose equations of motion have constants
PARTNER = np.concatenate([np.arange(3, 6), np.arange(3), np.arange(6, 15), np.arange(21, 27), np.arange(15, 21)])  # derivative or integral
# Constants: gravity (optical frame), origin of the body in the sensor's frame, small rotation of the body in it, clock offset, and scales and angles
# between the axes of accelerometer and gyroscope: rows of the matrices that correct their values, less 1.
GRAVITY, LEVER, MOUNT, OFFSET, ACC_AXES, GYRO_AXES = slice(0, 3), slice(3, 6), slice(6, 9), 9, slice(10, 19), slice(19, 28)
CONSTANTS = 28
BIAS_M_S2, BIAS_RAD_S = 0.3, 0.1  # standard deviations before any measurement
RATE_RAD_S = 100.0
EARTH_M_S2, EARTH_DEVIATION_M_S2 = 9.806, 0.03  # from the equator to the poles 9.780 to 9.832, and the scale of an accelerometer
# Squared error of a mean over an interval, over the squared second difference of the samples: a shock may fall between two accelerations; rates are smooth.
ACC_MISSED, GYRO_MISSED = 1.0, 1 / 16
SHOCK = 25.0  # squared second difference over the usual one, which is noise and smooth motion
PRIOR = np.array([1.0] * 9 + [0.1] + [0.01] * 18)
STILL = 1e-9  # standard deviation of a constant that is not estimated
STILL_RATE = 1e-3  # of a state that is not: large enough for the condition of the matrix, small beside what is measured


def transposed(m):
    return m.transpose(0, 2, 1)


def rows_of(m):
    """(N, K, L) as (N K, L)."""
    return m.reshape(m.shape[0] * m.shape[1], m.shape[2])


def cross_turn(turn, vector):
    return turn.apply(np.broadcast_to(vector, (len(turn), 3)))


@dataclasses.dataclass
class Noise:
    """Spectral densities and variances; `optical` and `smooth`: position (m^2), rotation (rad^2).

    `smooth_per_s`: sqrt(3) / length of the Matern 3/2 process of the smooth error, position and rotation.
    """

    acceleration: float  # m^2/s^3
    rate: float  # rad^2/s
    acc_walk: float  # m^2/s^5
    gyro_walk: float  # rad^2/s^3
    optical: np.ndarray
    smooth: np.ndarray
    smooth_per_s: np.ndarray


class Integral:
    """Mean over an interval of samples that are connected by straight lines."""

    def __init__(self, time_s, values):
        self.time_s, self.values = time_s, values
        self.total = np.vstack((np.zeros(3), np.cumsum(0.5 * (values[1:] + values[:-1]) * np.diff(time_s)[:, None], axis=0)))
        squares = np.mean(np.diff(values, 2, axis=0) ** 2, axis=1)
        self.bent = np.pad(np.where(squares > SHOCK * np.median(squares), squares, 0.0), 1, mode="edge")

    def __call__(self, time_s):
        """Integral from the first sample, (N, 3); beyond the ends the end values continue."""
        n = np.clip(np.searchsorted(self.time_s, time_s, side="right") - 1, 0, len(self.time_s) - 2)
        h = time_s - self.time_s[n]
        inside = np.clip(h, 0, self.time_s[n + 1] - self.time_s[n])
        slope = (self.values[n + 1] - self.values[n]) / (self.time_s[n + 1] - self.time_s[n])[:, None]
        beyond = np.where((h < 0)[:, None], self.values[0], self.values[-1])
        return self.total[n] + inside[:, None] * (self.values[n] + slope * inside[:, None] / 2) + (h - inside)[:, None] * beyond

    def mean(self, time_s):
        return np.diff(self(time_s), axis=0) / np.diff(time_s)[:, None]

    def density(self, time_s):
        """Mean squared second difference of the samples of one axis in shocks, times the interval, between the times, (N - 1,)."""
        return np.interp((time_s[1:] + time_s[:-1]) / 2, self.time_s, self.bent) * np.diff(time_s)


@dataclasses.dataclass
class Measurement:
    """Poses at nodes: index of the node, position, attitude (None: positions only), factor on the variance of the optical noise (position, rotation)."""

    node: np.ndarray
    position_m: np.ndarray
    turn: Rotation | None
    factor: np.ndarray
    has_smooth_error: bool = True


@dataclasses.dataclass
class State:
    """Path of the inertial sensor at the nodes, and the constants."""

    p: np.ndarray
    v: np.ndarray
    turn: Rotation
    acc_bias: np.ndarray
    gyro_bias: np.ndarray
    smooth: np.ndarray
    smooth_rate: np.ndarray
    gravity: np.ndarray
    lever: np.ndarray
    mount: Rotation
    offset_s: float
    acc_axes: np.ndarray = dataclasses.field(default_factory=lambda: np.zeros((3, 3)))
    gyro_axes: np.ndarray = dataclasses.field(default_factory=lambda: np.zeros((3, 3)))

    def moved(self, x, c):
        """The state after a step of the states (N, 27) and the constants (28,)."""
        return State(self.p + x[:, POSITION], self.v + x[:, VELOCITY], Rotation.from_rotvec(x[:, TURN]) * self.turn, self.acc_bias + x[:, ACC_BIAS],
                     self.gyro_bias + x[:, GYRO_BIAS], self.smooth + x[:, SMOOTH], self.smooth_rate + x[:, SMOOTH_RATE], self.gravity + c[GRAVITY],
                     self.lever + c[LEVER], Rotation.from_rotvec(c[MOUNT]) * self.mount, self.offset_s + c[OFFSET],
                     self.acc_axes + c[ACC_AXES].reshape(3, 3), self.gyro_axes + c[GYRO_AXES].reshape(3, 3))

    def constants_from(self, other):
        """Difference of the constants, (28,)."""
        return np.concatenate((self.gravity - other.gravity, self.lever - other.lever, (self.mount * other.mount.inv()).as_rotvec(),
                               [self.offset_s - other.offset_s], (self.acc_axes - other.acc_axes).ravel(), (self.gyro_axes - other.gyro_axes).ravel()))


class Fusion:
    """One path through measurements at nodes.

    time_s: (N,) of the nodes, optical clock. acc, gyro: Integral over the sensor's clock, or None without that sensor: then the velocity or the
    angular rate has a white derivative. constants: their standard deviations before these measurements, (28,).
    """

    def __init__(self, time_s, acc, gyro, measurements, noise, constants):
        self.time_s, self.dt = time_s, np.diff(time_s)
        self.acc, self.gyro, self.measurements, self.noise = acc, gyro, measurements, noise
        has_turn = any(m.turn is not None for m in measurements)
        turning = RATE_RAD_S if has_turn else STILL_RATE
        deviations = ((TURN, 10.0 if has_turn else STILL_RATE), (ACC_BIAS, BIAS_M_S2 if acc else STILL_RATE), (GYRO_BIAS, BIAS_RAD_S if gyro else turning))
        self.start = np.full(STATES, 1e3)  # standard deviations of the first node
        for part, deviation in deviations:
            self.start[part] = deviation
        self.start[SMOOTH] = np.repeat(np.sqrt(noise.smooth), 3)
        self.start[SMOOTH_RATE] = np.repeat(noise.smooth_per_s, 3) * self.start[SMOOTH]
        self.prior = np.asarray(constants)
        self.estimated = np.flatnonzero(self.prior > STILL)  # constants; the others stay as they are
        self.expected = None  # constants before these measurements: those of the first step
        self.blocks = None

    def means(self, offset_s):
        """Mean specific force and angular rate over the intervals between the nodes."""
        zero = np.zeros((len(self.dt), 3))
        return [zero if one is None else one.mean(self.time_s + offset_s) for one in (self.acc, self.gyro)]

    def optical(self, s, m):
        """Predicted pose of the body at the nodes of a measurement, and its derivatives."""
        turn = s.turn[m.node]
        arm = cross_turn(turn, s.lever)
        by_state, by_constant = np.zeros((len(m.node), 6, STATES)), np.zeros((len(m.node), 6, CONSTANTS))
        by_state[:, :3, POSITION], by_state[:, 3:, TURN] = np.eye(3), np.eye(3)
        by_state[:, :3, TURN] = -crosses(arm)
        by_constant[:, :3, LEVER] = by_constant[:, 3:, MOUNT] = turn.as_matrix()
        rate = turn.apply(self.rate(s)[m.node])
        by_constant[:, :3, OFFSET], by_constant[:, 3:, OFFSET] = s.v[m.node] + np.cross(rate, arm), rate
        p, turn = s.p[m.node] + arm, turn * s.mount
        if m.has_smooth_error:
            by_state[:, :, SMOOTH] = np.eye(6)
            p, turn = p + s.smooth[m.node, :3], Rotation.from_rotvec(s.smooth[m.node, 3:]) * turn
        return p, turn, by_state, by_constant

    def rate(self, s):
        """Angular rate at the nodes, sensor's frame."""
        between = self.means(s.offset_s)[1] @ (np.eye(3) + s.gyro_axes).T - s.gyro_bias[:-1]
        return np.vstack((between[:1], (between[1:] + between[:-1]) / 2, between[-1:]))

    def motion(self, s):
        """Residuals of the motion model between the nodes, and their derivatives by the first node and the constants; by the second one: 1."""
        n, dt = len(self.dt), self.dt[:, None]
        measured_force, measured_rate = self.means(s.offset_s)
        force, rate = measured_force @ (np.eye(3) + s.acc_axes).T, measured_rate @ (np.eye(3) + s.gyro_axes).T - s.gyro_bias[:-1]
        middle = s.turn[:-1] * Rotation.from_rotvec(rate * dt / 2)
        pull = middle.apply(force - s.acc_bias[:-1])
        a = pull + s.gravity
        per_s = np.repeat(self.noise.smooth_per_s, 3)
        kept = np.exp(-per_s * dt)
        smooth = ((1 + per_s * dt) * kept, dt * kept), (-(per_s**2) * dt * kept, (1 - per_s * dt) * kept)
        r, first, constant = np.zeros((n, STATES)), np.zeros((n, STATES, STATES)), np.zeros((n, STATES, CONSTANTS))
        r[:, POSITION] = s.p[1:] - s.p[:-1] - s.v[:-1] * dt - a * dt**2 / 2
        r[:, VELOCITY] = s.v[1:] - s.v[:-1] - a * dt
        r[:, TURN] = (s.turn[1:] * (s.turn[:-1] * Rotation.from_rotvec(rate * dt)).inv()).as_rotvec()
        r[:, ACC_BIAS], r[:, GYRO_BIAS] = np.diff(s.acc_bias, axis=0), np.diff(s.gyro_bias, axis=0)
        for part, (a_e, a_v) in zip((SMOOTH, SMOOTH_RATE), smooth):
            value = s.smooth if part is SMOOTH else s.smooth_rate
            r[:, part] = value[1:] - a_e * s.smooth[:-1] - a_v * s.smooth_rate[:-1]
            first[:, part, SMOOTH], first[:, part, SMOOTH_RATE] = -a_e[:, None, :] * np.eye(6), -a_v[:, None, :] * np.eye(6)
        first[:, :15, :15] = -np.eye(15)
        h, one, sensor = dt[:, :, None], np.eye(3), middle.as_matrix()
        by_acc, by_gyro = (np.einsum("nij,nk->nijk", sensor, value).reshape(n, 3, 9) for value in (measured_force, measured_rate))
        first[:, POSITION, VELOCITY] = -h * one
        for part, factor in ((POSITION, h**2 / 2), (VELOCITY, h)):
            first[:, part, TURN], first[:, part, ACC_BIAS], constant[:, part, GRAVITY] = factor * crosses(pull), factor * sensor, -factor * one
            constant[:, part, ACC_AXES] = -factor * by_acc
        first[:, TURN, GYRO_BIAS], constant[:, TURN, GYRO_AXES] = h * sensor, -h * by_gyro
        return r, first, constant

    def information(self, offset_s):
        """Inverse covariance of the residuals: its diagonal, and its entries between a state and its derivative, (N - 1, 27) each."""
        dt, q = self.dt, self.noise
        own, with_partner = np.zeros((2, len(dt), STATES))

        def pair(rows, rates, p, pv, v):  # inverse of [p, pv; pv, v]
            determinant = p * v - pv**2
            for part, entry in ((rows, v), (rates, p)):
                own[:, part], with_partner[:, part] = (entry / determinant)[:, None], (-pv / determinant)[:, None]

        times = self.time_s + offset_s
        missed = [0 if one is None else share * one.density(times) for one, share in ((self.acc, ACC_MISSED), (self.gyro, GYRO_MISSED))]
        pair(POSITION, VELOCITY, *((q.acceleration + missed[0]) * moment for moment in (dt**3 / 3, dt**2 / 2, dt)))
        # Of the stationary covariance diag(1, l^2): P - F P F^T. A series where it cancels.
        for k, per_s in enumerate(q.smooth_per_s):
            x = per_s * dt
            kept = np.exp(-2 * x)
            position = np.where(x < 0.02, 4 / 3 * x**3 - 2 * x**4, 1 - kept * ((1 + x) ** 2 + x**2))
            rows, rates = (slice(part.start + 3 * k, part.start + 3 * k + 3) for part in (SMOOTH, SMOOTH_RATE))
            pair(rows, rates, *(q.smooth[k] * moment for moment in (position, per_s * 2 * x**2 * kept, per_s**2 * (1 - kept * ((1 - x) ** 2 + x**2)))))
        for part, density in ((TURN, q.rate + missed[1]), (ACC_BIAS, q.acc_walk if self.acc else STILL_RATE**2), (GYRO_BIAS, q.gyro_walk)):
            own[:, part] = 1 / (density * dt)[:, None]
        return own, with_partner

    def residual(self, s, m):
        """Predicted minus measured, (M, 6), its derivatives and the standard deviation of the white noise."""
        p, turn, by_state, by_constant = self.optical(s, m)
        deviation = np.repeat(np.sqrt(self.noise.optical * m.factor), 3, axis=1)
        turned = np.zeros_like(p) if m.turn is None else (turn * m.turn.inv()).as_rotvec()
        if m.turn is None:
            by_state[:, 3:], by_constant[:, 3:] = 0, 0
        return np.hstack((p - m.position_m, turned)), by_state, by_constant, deviation

    def step(self, s):
        """The state after a Gauss-Newton step, and the largest changes of position and attitude."""
        n = len(self.time_s)
        r, first, constant = self.motion(s)
        own, with_partner = self.information(s.offset_s)

        def weighted(values, part):
            return own[:, part, None] * values + with_partner[:, part, None] * np.take(values, PARTNER[part] - part.start, axis=1)

        diagonal, right, border, below = np.zeros((n, STATES, STATES)), np.zeros((n, STATES)), np.zeros((n, STATES, len(self.estimated))), np.zeros_like(first)
        for part in (MOTION, ERROR):
            own_first = first[:, part, part]
            below[:, part, part] = weighted(own_first, part)
            diagonal[:-1, part, part] += transposed(own_first) @ below[:, part, part]
        w_r, constant = weighted(r[:, :, None], slice(0, STATES)), constant[:, BY_CONSTANTS, self.estimated]
        w_constant = weighted(constant, BY_CONSTANTS)
        states = np.arange(STATES)
        diagonal[1:, states, states] += own
        diagonal[1:, states, PARTNER] += with_partner
        right[:-1] += (transposed(first) @ w_r)[:, :, 0]
        right[1:] += w_r[:, :, 0]
        border[:-1, MOTION] += transposed(first[:, BY_CONSTANTS, MOTION]) @ w_constant
        border[1:, BY_CONSTANTS] += w_constant
        width = len(self.estimated)
        flat = rows_of(constant)
        corner, of_constant = flat.T @ rows_of(w_constant), flat.T @ w_r[:, BY_CONSTANTS].ravel()
        for m in self.measurements:
            e, by_state, by_constant, deviation = self.residual(s, m)
            e, by_state, by_constant = e / deviation, by_state[:, :, SEEN] / deviation[:, :, None], by_constant[:, :, self.estimated] / deviation[:, :, None]
            first_of_node = np.flatnonzero(np.diff(m.node, prepend=-1))
            values = transposed(by_state) @ np.concatenate((by_state, e[:, :, None], by_constant), axis=2)
            if len(first_of_node) < len(values):
                values = np.add.reduceat(values, first_of_node)
            node, one = m.node[first_of_node, None], len(SEEN)
            diagonal[node[:, :, None], SEEN[:, None], SEEN] += values[:, :, :one]
            right[node, SEEN] += values[:, :, one]
            border[node, SEEN] += values[:, :, one + 1:]
            flat = rows_of(by_constant)
            corner, of_constant = corner + flat.T @ flat, of_constant + flat.T @ e.ravel()
        inverse = 1 / self.start**2
        diagonal[0] += np.diag(inverse)
        right[0] += inverse * np.concatenate((np.zeros(9), s.acc_bias[0], s.gyro_bias[0], s.smooth[0], s.smooth_rate[0]))
        prior = self.prior[self.estimated]
        corner[np.diag_indices(width)] += 1 / prior**2
        self.expected = s if self.expected is None else self.expected
        of_constant += s.constants_from(self.expected)[self.estimated] / prior**2
        size = np.linalg.norm(s.gravity)
        if size > 0 and 0 in self.estimated:
            along = s.gravity / size  # the first constants
            corner[GRAVITY, GRAVITY] += np.outer(along, along) / EARTH_DEVIATION_M_S2**2
            of_constant[GRAVITY] += along * (size - EARTH_M_S2) / EARTH_DEVIATION_M_S2**2
        self.diagonal, self.below = diagonal, below
        x, estimated = self.solved(right, border, corner, of_constant)
        c = np.zeros(CONSTANTS)
        c[self.estimated] = estimated
        return s.moved(x, c), float(np.abs(x[:, POSITION]).max()), float(np.abs(x[:, TURN]).max())

    def solved(self, right, border, corner, of_constant):
        """Cholesky factors by blocks, node after node; all right sides at once."""
        inverse = np.empty_like(self.diagonal)  # of the factors
        forward = np.concatenate((right[:, :, None], border, np.pad(transposed(self.below), ((0, 1), (0, 0), (0, 0)))), axis=2)
        width = len(corner)
        sides, block = slice(0, 1 + width), self.diagonal[0]
        for k in range(len(forward)):
            if k > 0:
                known = forward[k - 1, :, sides.stop:].T @ forward[k - 1]
                forward[k, :, sides] -= known[:, sides]
                block = self.diagonal[k] - known[:, sides.stop:]
            factor, fault = dpotrf(block, lower=True)
            if fault:
                raise LinAlgError("the equations do not determine the path")
            inverse[k] = dtrtri(factor, lower=True)[0]
            forward[k] = inverse[k] @ forward[k]
        self.gain = transposed(inverse[:-1]) @ forward[:-1, :, sides.stop:]
        both = transposed(inverse) @ forward[:, :, sides]
        for k in range(len(both) - 2, -1, -1):
            both[k] -= self.gain[k] @ both[k + 1]
        self.inverse = inverse
        flat, solution = rows_of(border), rows_of(both)
        self.constant_covariance = np.linalg.inv(corner - flat.T @ solution[:, 1:])
        c = -self.constant_covariance @ (of_constant - flat.T @ solution[:, 0])
        self.by_constant = both[:, :, 1:]  # minus the derivative of the states
        return -both[:, :, 0] - self.by_constant @ c, c

    def fit(self, s, steps=8, position_m=1e-5, turn_rad=1e-5):
        """The most probable state. Raises LinAlgError if there is none."""
        for _ in range(steps):
            s, moved_m, turned = self.step(s)
            if not np.isfinite(moved_m + turned):
                raise LinAlgError("the steps diverge")
            if moved_m < position_m and turned < turn_rad:
                break
        self.blocks = None
        return s

    def state_covariance(self):
        """Diagonal blocks of the inverse of the normal matrix, without the constants' share."""
        if self.blocks is None:
            blocks = transposed(self.inverse) @ self.inverse
            for k in range(len(blocks) - 2, -1, -1):
                blocks[k] += self.gain[k] @ blocks[k + 1] @ self.gain[k].T
            self.blocks = blocks
        return self.blocks

    def covariance(self, node, by_state, by_constant):
        """Covariance of what has these derivatives."""
        whole = by_constant[:, :, self.estimated] - by_state @ self.by_constant[node]
        return by_state @ self.state_covariance()[node] @ transposed(by_state) + whole @ self.constant_covariance @ transposed(whole)
