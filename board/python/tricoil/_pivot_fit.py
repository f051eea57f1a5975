"""Tip of a pointer that turned about its resting tip: weighted least squares in closed form, repeated with the weights and without the
outliers of the previous result.

The residual of a pose is r = p + R t - c, with the tip t (sensor frame) and the pivot c (source frame). A rotation error e moves the tip
by e x R t, so each weight depends on the tip. Errors of the attitudes would also shorten the tip; the equations are corrected for this.
"""

import numpy as np

MIN_POSES = 10
MIN_TILT_RAD = 0.07  # 4 deg
MIN_TILT_TO_NOISE = 2  # of the attitudes
MAX_RESIDUAL_SIGMAS = 5  # a larger residual is not caused by noise
MAX_RESIDUAL_M = 3e-4  # play of a tip in its hole; a smaller residual is accepted
MAX_UNSTATED_RESIDUAL_M = 5e-3  # the same, of poses without standard deviations
SMALLEST_SIGMA_M = 1e-6  # makes the covariance of noise-free poses regular
OUTLIER_SQUARE = 16.27  # chi-square with 3 degrees of freedom, 99.9 %
MEDIAN_SQUARE = 2.366  # its median
TRIALS = 300  # with half of the poses wrong, one trial in 16 has only good poses
POSES_PER_TRIAL = 4
SCORED_POSES = 300
PASSES = 30
CONVERGED_M = 1e-10
BLOCKS = 20
# Errors that all poses share do not average out. In simulated motion (scenario pointer) they move the tip by 1 to 2 um, which is
# its standard deviation for about this number of poses.
MOST_INDEPENDENT_POSES = 1000
MANY_OUTLIERS = 0.2  # share of the poses
LARGE_RESIDUAL = 2  # in standard deviations


def design(rotation):
    """Derivative of the residuals by tip and pivot, (N, 3, 6)."""
    return np.concatenate((rotation, np.broadcast_to(-np.eye(3), rotation.shape)), axis=2)


def skew(v):
    """Cross product matrices, (N, 3, 3)."""
    result = np.zeros((len(v), 3, 3))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        result[:, i, j], result[:, j, i] = -v[:, k], v[:, k]
    return result


def turns(rotation_rad):
    """Rotation matrices of rotation vectors (N, 3), by Rodrigues' formula."""
    angle = np.linalg.norm(rotation_rad, axis=1)[:, None, None]
    cross = skew(rotation_rad)
    return np.eye(3) + np.sinc(angle / np.pi) * cross + np.sinc(angle / (2 * np.pi)) ** 2 / 2 * (cross @ cross)


def matrices(wxyz):
    """Rotation matrices of unit quaternions (N, 4)."""
    cross = skew(wxyz[:, 1:])
    return np.eye(3) + 2 * wxyz[:, :1, None] * cross + 2 * (cross @ cross)


def inverses(m):
    """Inverse matrices of symmetric ones, (N, 3, 3), by cofactors."""
    a, b, c, d, e, f = m[:, 0, 0], m[:, 0, 1], m[:, 0, 2], m[:, 1, 1], m[:, 1, 2], m[:, 2, 2]
    first, second, third = d * f - e * e, c * e - b * f, b * e - c * d
    rows = (first, second, third, second, a * f - c * c, b * c - a * e, third, b * c - a * e, a * d - b * b)
    return (np.stack(rows, axis=1) / (a * first + b * second + c * third)[:, None]).reshape(-1, 3, 3)


def weights(rotation, covariance, tip_m):
    """Inverse covariances of the residuals, whose error is J (position error, rotation error); (N, 3, 3)."""
    jacobian = np.concatenate((np.broadcast_to(np.eye(3), rotation.shape), -skew(rotation @ tip_m)), axis=2)
    return inverses(jacobian @ covariance @ jacobian.transpose(0, 2, 1) + SMALLEST_SIGMA_M**2 * np.eye(3))


def applied(matrices, vectors):
    return np.einsum("nij,nj->ni", matrices, vectors)


class Poses:
    """Positions (N, 3), m; rotation matrices (N, 3, 3), sensor to source frame; covariances (N, 6, 6); square roots of the covariances, and the
    rotations by their columns (N, 6, 3, 3)."""

    def __init__(self, position_m, rotation, covariance, root=None, turned=None):
        self.position_m, self.rotation, self.covariance = position_m, rotation, covariance
        if root is None:
            values, vectors = np.linalg.eigh(covariance)
            root = vectors * np.sqrt(np.maximum(values, 0))[:, None, :]
            turned = turns(root[:, 3:].transpose(0, 2, 1).reshape(-1, 3)).reshape(-1, 6, 3, 3)
        self.root, self.turned = root, turned

    def __getitem__(self, chosen):
        return Poses(self.position_m[chosen], self.rotation[chosen], self.covariance[chosen], self.root[chosen], self.turned[chosen])

    def residuals(self, x):
        return self.position_m + self.rotation @ x[:3] - x[3:]

    def weights(self, tip_m):
        return weights(self.rotation, self.covariance, tip_m)


def mean_gradient(poses, tip_m):
    """Sum of the means of A^T W r at the true solution, exact to second order in the poses' errors. It is not zero, because the attitude
    in A and W has the error that is also in r."""
    mean = np.zeros(6)
    for n in range(12):
        turned = poses.turned[:, n % 6]
        wrong = (turned if n < 6 else turned.transpose(0, 2, 1)) @ poses.rotation
        residual = (1 if n < 6 else -1) * poses.root[:, :3, n % 6] + (wrong - poses.rotation) @ tip_m
        weighted = applied(weights(wrong, poses.covariance, tip_m), residual)
        mean += np.concatenate((np.einsum("nij,ni->j", wrong, weighted), -np.sum(weighted, axis=0))) / 2
    return mean


def robust_start(poses):
    """Least median of squares: solutions of a few poses each, of which the one with the smallest median residual is kept."""
    count = len(poses.position_m)
    trials = np.random.default_rng(1).integers(count, size=(TRIALS, POSES_PER_TRIAL))
    rows = design(poses.rotation)[trials].reshape(TRIALS, -1, 6)
    sides = -poses.position_m[trials].reshape(TRIALS, -1)
    solutions = applied(np.linalg.pinv(rows, rcond=1e-8), sides)
    scored = poses[:: -(-count // SCORED_POSES)]
    arms_m = (scored.rotation.reshape(-1, 3) @ solutions[:, :3].T).reshape(-1, 3, TRIALS)
    residuals = scored.position_m[:, :, None] + arms_m - solutions[:, 3:].T
    return solutions[int(np.argmin(np.median(np.sum(residuals**2, axis=1), axis=0)))]


def fit_tip(poses):
    """Solution x (tip, pivot), its normal matrix, the poses that were used, and the robust scale of the residuals relative to the poses'
    covariances."""
    x = robust_start(poses)
    for _ in range(PASSES):
        before = x
        residuals = poses.residuals(x)
        squares = np.einsum("ni,nij,nj->n", residuals, poses.weights(x[:3]), residuals)
        variance = np.median(squares) / MEDIAN_SQUARE
        used = poses[squares <= OUTLIER_SQUARE * max(1, variance)]
        rows = design(used.rotation)
        weighted = rows.transpose(0, 2, 1) @ used.weights(x[:3])
        normal = np.sum(weighted @ rows, axis=0)
        side = mean_gradient(used, x[:3]) - np.einsum("nij,nj->i", weighted, used.position_m)
        x = np.linalg.lstsq(normal, side, rcond=None)[0]
        if np.linalg.norm(x - before) < CONVERGED_M:
            break
    return x, normal, used, np.sqrt(variance)


def check_motion(poses, name):
    """RMS tilt of the sensor axis that tilts least, rad, without the errors of the attitudes."""
    turn = poses.rotation
    in_sensor = turn.transpose(0, 2, 1) @ poses.covariance[:, 3:, 3:] @ turn
    noise = np.mean(np.trace(in_sensor, axis1=1, axis2=2)[:, None, None] * np.eye(3) - in_sensor, axis=0)
    mean = np.mean(turn, axis=0)
    values, axes = np.linalg.eigh(np.eye(3) - mean.T @ mean - noise)
    rms_rad = np.sqrt(np.maximum(values, 0))
    axis = axes[:, 0]
    least_rad = max(MIN_TILT_RAD, MIN_TILT_TO_NOISE * np.sqrt(axis @ noise @ axis))
    if rms_rad[1] < least_rad:
        raise ValueError(f"{name}: the poses turn by only {np.degrees(rms_rad[1]):.1f} deg RMS, which does not determine the tip; tilt the pointer "
                         "to all sides by 30 deg or more, with its tip at rest")
    if rms_rad[0] < least_rad:
        shown = ", ".join(f"{component:.2f}" for component in axis)
        raise ValueError(f"{name}: the poses turn about one axis only ({shown} in the sensor frame, tilted by {np.degrees(rms_rad[0]):.1f} deg "
                         "RMS), which does not determine the tip; tilt the pointer to all sides by 30 deg or more")
    return rms_rad[0]


def covariance_inflation(poses, x, normal):
    """Ratio of the covariance of the result to the inverse normal matrix, from the sums of the scores over blocks of successive poses. 1 for
    independent residuals of the expected size; sums are larger if residuals are larger or correlated within a block."""
    inverse = np.linalg.inv(normal)
    rows = design(poses.rotation)
    weighted = rows.transpose(0, 2, 1) @ poses.weights(x[:3])
    scores = applied(weighted, poses.residuals(x))
    measured, expected = 0.0, 6.0
    for block in np.array_split(np.arange(len(rows)), min(BLOCKS, len(rows))):
        score = np.sum(scores[block], axis=0)
        share = np.sum(weighted[block] @ rows[block], axis=0) @ inverse
        measured += score @ inverse @ score
        expected -= np.trace(share @ share)
    return max(1.0, measured / expected, len(rows) / MOST_INDEPENDENT_POSES)


def warnings_of(count, outliers, residual_sigmas):
    warnings = []
    if outliers > MANY_OUTLIERS * count:
        warnings.append(f"{outliers} of {count} poses are outliers; was the tip at rest?")
    if residual_sigmas > LARGE_RESIDUAL:
        warnings.append(f"the residual is {residual_sigmas:.1f} times the standard deviations of the poses: a tip that moves, or metal")
    return warnings


def calibrate(position_m, quaternion_wxyz, covariance, name) -> dict:
    """Tip and pivot of poses in order of time: arrays (N, 3), (N, 4), (N, 6, 6). Equal poses give equal results. Covariances that are all zero
    are taken from the residuals. Raises ValueError, naming the poses, if the motion does not determine the tip: fewer than 10 poses, rotation about one axis, too little rotation, or a tip that moves."""
    count = len(position_m)
    if count < MIN_POSES:
        raise ValueError(f"{name}: {count} valid poses; at least {MIN_POSES} are needed, with the pointer tilted to all sides")
    wxyz = quaternion_wxyz / np.linalg.norm(quaternion_wxyz, axis=1)[:, None]
    poses = Poses(position_m, matrices(wxyz), covariance)
    x, normal, used, scale = fit_tip(poses)
    is_stated = np.any(covariance)
    if not is_stated:
        from_residuals = np.diag([(scale * SMALLEST_SIGMA_M) ** 2] * 3 + [0] * 3)
        x, normal, used, scale = fit_tip(Poses(position_m, poses.rotation, np.tile(from_residuals, (count, 1, 1))))
    tilt_rad = check_motion(used, name)
    residuals = used.residuals(x)
    rms_m = np.sqrt(np.mean(np.sum(residuals**2, axis=1)))
    sigmas = np.sqrt(np.einsum("ni,nij,nj", residuals, used.weights(x[:3]), residuals) / (3 * len(residuals) - 6))
    if scale > MAX_RESIDUAL_SIGMAS and rms_m > MAX_RESIDUAL_M:
        raise ValueError(f"{name}: the tip is not at rest: residual {1e3 * rms_m:.2f} mm RMS, {scale:.0f} times the standard deviations of the "
                         "poses; hold the tip in a small hole, far from metal, and turn more slowly")
    if not is_stated and rms_m > MAX_UNSTATED_RESIDUAL_M:
        raise ValueError(f"{name}: the tip is not at rest: residual {1e3 * rms_m:.2f} mm RMS; hold the tip in a small hole")
    inflation = covariance_inflation(used, x, normal)
    covariance_m2 = inflation * np.linalg.inv(normal)
    deviation_m = np.sqrt(np.diag(covariance_m2))
    outliers = count - len(residuals)
    return {
        "outliers": outliers,
        "tip_m": x[:3].tolist(),
        "tip_std_m": deviation_m[:3].tolist(),
        "tip_covariance_m2": covariance_m2[:3, :3].tolist(),
        "pivot_m": x[3:].tolist(),
        "pivot_std_m": deviation_m[3:].tolist(),
        "residual_rms_m": float(rms_m),
        "residual_sigmas": float(sigmas),
        "covariance_inflation": float(inflation),
        "tilt_deg": float(np.degrees(tilt_rad)),
        "warnings": warnings_of(count, outliers, sigmas),
    }
