"""Virtual dipoles of metal that is at rest relative to the source, fitted to couplings at known places."""

import dataclasses

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.distance import cdist
from scipy.spatial.transform import Rotation

from ._induced import LENGTH_M, NUMBERS, Coils, rows_of
from ._levenberg import Blocks, minimise
from ._rotation import crosses

LEAST_PLACES = 18  # 3 x 3 x 2 nodes
SAME_PLACE_M = 1e-3  # places nearer to each other than this are one
LEAST_SPREAD = 0.05  # of the places along their shortest axis, relative to the longest
CLEARANCE = 0.2  # of a dipole from source and poses, relative to the range of the nearest pose
WORTHWHILE = 0.9  # a dipole must reduce the standard deviation of the residuals to this share
MOST_DIPOLES = 4  # field::kMaxInducedDipoles
STEPS = 4  # of the search grid over the distance of the farthest pose; the grid extends so far beyond all poses
CHUNK = 1 << 12  # places of the search grid times poses that are tried at once
RIDGE = 1e-9  # relative; keeps the normal matrix definite where a part of the polarisability has no effect
LEVER_M, MISFIT_SHARE = 0.1, 0.5  # weights of a rotation of 1 rad, and of the part that no pose explains, as in the fit of coils
LOSS_MEDIANS = 4  # scale of the robust loss, in medians of the residuals
DEVIATION_PER_MEDIAN = 1.4826  # of a normal distribution
LARGEST_DEVIATION = 0.15  # of quadratures: noise, or metal without a quadrature of its own


@dataclasses.dataclass
class Placed:
    """Couplings at places of a stage or a grid, (N, ...), and what is known of their poses.

    A sensor is at frame + F (place + R mount) and has the attitude F R M. frame, mount: start values of F or M (3, 3) and of their translation (3,).
    Unless fixtures_known, both are estimated. Unless attitudes_known (grid), every R is, and M is fixed.
    """

    place_m: NDArray
    rotation: NDArray
    x: NDArray
    quadrature: NDArray  # zero: unknown
    frame: tuple = (np.eye(3), np.zeros(3))
    mount: tuple = (np.eye(3), np.zeros(3))
    fixtures_known: bool = True
    attitudes_known: bool = True


@dataclasses.dataclass
class Fit:
    dipoles: NDArray  # (D, 12): position (m) and polarisability (m^3, row by row)
    frame: tuple  # rotation and translation, stage or grid to source
    mount: tuple  # sensor to mount
    position_m: NDArray  # of the poses
    residual_before_m: float  # RMS of the weighted residuals of a pose without dipoles, with the same unknowns
    residual_m: float  # with them
    quadrature: NDArray  # dipoles of the quadratures; none if unknown or too small
    quadrature_deviation: float  # of the ratio of their couplings to the measured ones


def upper_median(values) -> float:
    """The upper one of two middle values, as in the program."""
    return float(np.sort(values)[len(values) // 2])


def check_places(place_m: NDArray) -> None:
    places = []
    for place in place_m:
        if not places or np.min(np.linalg.norm(np.array(places) - place, axis=1)) >= SAME_PLACE_M:
            places.append(place)
    if len(places) < LEAST_PLACES:
        raise ValueError(f"the poses are at {len(places)} places; surroundings need {LEAST_PLACES}, for example a grid of 3 x 3 x 2 nodes")
    extent = np.linalg.svd(places - np.mean(places, axis=0), compute_uv=False)
    if extent[2] < LEAST_SPREAD * extent[0]:
        raise ValueError("the poses lie in one plane or on one line; surroundings need a grid of several levels")


def _exp(vectors):
    return Rotation.from_rotvec(vectors).as_matrix()


def left_jacobian(vectors: NDArray) -> NDArray:
    """J(w) (..., 3, 3) with exp(w + dw) = exp(J(w) dw) exp(w) to first order."""
    w = np.atleast_2d(vectors)
    square = np.sum(w**2, axis=1)[:, None, None]
    small = square < 1e-8
    angle = np.sqrt(np.where(small, 1, square))
    first = np.where(small, 0.5 - square / 24, (1 - np.cos(angle)) / angle**2)
    second = np.where(small, 1 / 6 - square / 120, (angle - np.sin(angle)) / angle**3)
    cross = crosses(w)
    return (np.eye(3) + first * cross + second * (cross @ cross)).reshape(*np.shape(vectors), 3)


@dataclasses.dataclass
class Unknowns:
    """frame, mount: translation (units of LENGTH_M) and rotation vector from the start. turns: (N, 3) rotation vectors. dipoles: (D, 9)."""

    frame: NDArray
    mount: NDArray
    turns: NDArray
    dipoles: NDArray


class Search:
    """Unknowns of the fit, and fits with a growing number of dipoles.

    model(position_m, attitude, dipoles): couplings (N, 9) in column order and their derivatives by pose (N, 9, 6).
    relative: residuals are relative to the quadrature of their pose, not metres.
    """

    def __init__(self, model, coils: Coils, data: Placed, relative: bool = False):
        self.model, self.coils, self.data, self.relative = model, coils, data, relative
        count = len(data.place_m)
        self.measured = np.swapaxes(data.x, 1, 2).reshape(count, 9)
        blocks = [np.concatenate((translation / LENGTH_M, np.zeros(3))) for _, translation in (data.frame, data.mount)]
        self.at = Unknowns(*blocks, np.zeros((count, 3)), np.zeros((0, NUMBERS)))
        self.shared = 0 if data.fixtures_known else 12 if data.attitudes_known else 9
        self.own = 0 if data.attitudes_known else 3

    def poses(self, at: Unknowns | None = None):
        """Positions (N, 3) and attitudes (N, 3, 3), rotations of the frame (3, 3) and of the mount on the stage (N, 3, 3)."""
        at, data = at or self.at, self.data
        of_frame = _exp(at.frame[3:]) @ data.frame[0]
        turned = _exp(at.turns) @ data.rotation
        position_m = LENGTH_M * at.frame[:3] + (data.place_m + LENGTH_M * turned @ at.mount[:3]) @ of_frame.T
        return position_m, of_frame @ turned @ _exp(at.mount[3:]) @ data.mount[0], of_frame, turned

    def clearance_m(self) -> float:
        return CLEARANCE * np.min(np.linalg.norm(self.poses()[0], axis=1))

    def weights(self) -> NDArray:
        """(N, 9, 9): couplings as the position and rotation errors that they cause, and the part that no pose explains with a share. The present ones."""
        if self.relative:
            return np.eye(9) / np.linalg.norm(self.data.quadrature, axis=(1, 2))[:, None, None]
        position_m, attitude, *_ = self.poses()
        strength = np.linalg.norm(self.measured, axis=1) / np.sqrt(1.5)
        metres = np.linalg.norm(position_m, axis=1) / (3 * strength)
        jacobian = self.model(position_m, attitude, rows_of(self.at.dipoles))[1] / np.repeat([1, LEVER_M], 3)
        pseudo = np.linalg.solve(np.swapaxes(jacobian, 1, 2) @ jacobian, np.swapaxes(jacobian, 1, 2))
        square = np.swapaxes(pseudo, 1, 2) @ pseudo
        square += ((MISFIT_SHARE * metres) ** 2)[:, None, None] * (np.eye(9) - jacobian @ pseudo)
        values, vectors = np.linalg.eigh((square + np.swapaxes(square, 1, 2)) / 2)
        return vectors * np.sqrt(np.maximum(values, 0))[:, None] @ np.swapaxes(vectors, 1, 2)

    def residuals(self, weights: NDArray, at: Unknowns | None = None) -> NDArray:
        """Model minus measured, weighted, (N, 9)."""
        at = at or self.at
        position_m, attitude, *_ = self.poses(at)
        model = self.model(position_m, attitude, rows_of(at.dipoles))[0]
        return np.einsum("nij,nj->ni", weights, model - self.measured)

    def linearised(self, weights: NDArray, at: Unknowns | None = None):
        """Residuals (N, 9), and their derivatives by frame and mount (N, 9, 0, 9 or 12), dipoles (N, 9, 9 D), and own turn (N, 9, 0 or 3)."""
        at, data = at or self.at, self.data
        position_m, attitude, of_frame, turned = self.poses(at)
        x, jacobian = self.model(position_m, attitude, rows_of(at.dipoles))
        by_position, by_rotation = jacobian[..., :3], jacobian[..., 3:]
        arm = LENGTH_M * turned @ at.mount[:3]
        # A rotation w of the frame moves the sensor by w x a = -skew(a) w; a: vector from the centre of rotation to the sensor.
        of_arm = by_rotation - by_position @ crosses((data.place_m + arm) @ of_frame.T)
        of_mount = np.concatenate((LENGTH_M * by_position @ of_frame @ turned, by_rotation @ of_frame @ turned @ left_jacobian(at.mount[3:])), axis=2)
        rigid = np.concatenate((LENGTH_M * by_position, of_arm @ left_jacobian(at.frame[3:]), of_mount), axis=2)[..., :self.shared]
        turn = (by_rotation @ of_frame - by_position @ of_frame @ crosses(arm)) @ left_jacobian(at.turns) if self.own else np.zeros((*x.shape, 0))
        dipoles = self.coils.derivatives(at.dipoles, position_m, attitude)
        return np.einsum("nij,nj->ni", weights, x - self.measured), weights @ rigid, weights @ dipoles, weights @ turn

    def solve(self, scale: float | None = None) -> None:
        """Least squares from the present values, with their weights. scale: of a robust loss (Cauchy) on the residual of a pose."""
        if not self.shared + self.own + self.at.dipoles.size:
            return
        weights, clear = self.weights(), _Clearance(self.clearance_m() / 2, self.poses()[0])

        def blocks(at):
            residual, rigid, dipoles, turn = self.linearised(weights, at)
            extra, by_dipoles = clear(at.dipoles)
            by_shared = np.hstack((np.zeros((len(extra), self.shared)), by_dipoles))
            return Blocks(residual, np.concatenate((rigid, dipoles), axis=2), turn, extra, by_shared)

        def cost(at):
            return self.residuals(weights, at), clear(at.dipoles)[0]

        self.at = minimise(self.at, cost, blocks, self.moved, scale)

    def moved(self, at: Unknowns, shared: NDArray, own: NDArray) -> Unknowns:
        rigid, dipoles = shared[:self.shared], shared[self.shared:]
        rigid = np.concatenate((rigid, np.zeros(12 - self.shared)))
        return Unknowns(at.frame + rigid[:6], at.mount + rigid[6:], at.turns + own if self.own else at.turns, at.dipoles + dipoles.reshape(-1, NUMBERS))

    def norms_m(self) -> NDArray:
        return np.linalg.norm(self.residuals(self.weights()), axis=1)

    def rms_m(self) -> float:
        return float(np.sqrt(np.mean(self.norms_m() ** 2)))

    def deviation_m(self) -> float:
        """Standard deviation of a residual, corrected for the number of unknowns."""
        norms = self.norms_m()
        return float(np.sqrt(np.sum(norms**2) / ((9 - self.own) * len(norms) - self.shared - self.at.dipoles.size)))

    def best_dipole(self) -> NDArray:
        """The best of a grid of places around source and poses, none nearer than the clearance to them, with the polarisability that least squares gives there."""
        position_m, attitude, *_ = self.poses()
        weights = self.weights()
        residual, nuisance, _, own = self.linearised(weights)  # the fit of all dipoles follows
        if self.own:  # what the pose's own unknowns can explain goes
            rest = np.eye(9) - own @ np.linalg.solve(np.swapaxes(own, 1, 2) @ own, np.swapaxes(own, 1, 2))
            residual, weights, nuisance = np.einsum("nij,nj->ni", rest, residual), rest @ weights, rest @ nuisance
        places = _search_grid(position_m, self.clearance_m())
        size = max(CHUNK // len(position_m), 1)
        trials = [self._tried(part, position_m, attitude, weights, residual, nuisance) for part in np.split(places, range(size, len(places), size))]
        explained, polarisability = (np.concatenate(parts) for parts in zip(*trials))
        best = np.argmax(explained)
        return np.concatenate((places[best] / LENGTH_M, polarisability[best]))

    def _tried(self, places, position_m, attitude, weights, residual, nuisance):
        """Decrease of the sum of squares (P,), and polarisability (P, 6): normal equations with the shared unknowns."""
        by_pole = (weights @ self.coils.by_polarisability(places, position_m, attitude)).reshape(len(places), -1, 6)
        shared = nuisance.reshape(residual.size, nuisance.shape[2])
        rest = residual.ravel()
        across = np.swapaxes(by_pole, 1, 2) @ shared
        inner = np.broadcast_to(shared.T @ shared, (len(places), shared.shape[1], shared.shape[1]))
        normal = np.block([[np.swapaxes(by_pole, 1, 2) @ by_pole, across], [np.swapaxes(across, 1, 2), inner]])
        right = -np.hstack((rest @ by_pole, np.broadcast_to(rest @ shared, (len(places), shared.shape[1]))))
        # Parameters of very different effect: scaled to a unit diagonal.
        scale = 1 / np.sqrt(np.diagonal(normal, axis1=1, axis2=2) + np.finfo(float).tiny)
        normal = scale[:, :, None] * normal * scale[:, None] + RIDGE * np.eye(normal.shape[1])
        right = scale * right
        solution = np.einsum("pij,pj->pi", np.linalg.pinv(normal, rcond=1e-10, hermitian=True), right)
        return np.sum(right * solution, axis=1), (scale * solution)[:, :6]

    def run(self) -> None:
        """Adds dipoles while the standard deviation of the residuals falls by a tenth or more. Raises ValueError if none does."""
        self.solve()
        self.residual_before_m = self.rms_m()
        deviation = self.deviation_m()
        while len(self.at.dipoles) < MOST_DIPOLES:
            before = self.at
            self.at = dataclasses.replace(before, dipoles=np.vstack((before.dipoles, self.best_dipole())))
            for _ in range(2):  # the second with the weights at the new solution
                self.solve()
            if not self.deviation_m() < WORTHWHILE * deviation:
                self.at = before
                break
            deviation = self.deviation_m()
        if not len(self.at.dipoles):
            raise ValueError(f"no metal found: dipoles explain the couplings no better than the coils alone ({1e3 * self.residual_before_m:.3f} mm RMS); use "
                             "the calibration without surroundings")
        self.solve(max(LOSS_MEDIANS * upper_median(self.norms_m()), 1e-9))


class _Clearance:
    """Keeps dipoles at a distance from poses and source: the residual is the missing distance, m."""

    def __init__(self, least_m: float, position_m: NDArray):
        self.least_m, self.away_m = least_m, np.vstack((np.zeros(3), position_m))

    def __call__(self, dipoles: NDArray):
        """Residuals (K,) that are not zero, and their derivatives (K, 9 D)."""
        off = LENGTH_M * dipoles[:, None, :3] - self.away_m
        distance_m = np.linalg.norm(off, axis=2)
        which, near = np.nonzero((distance_m < self.least_m) & (distance_m > 0))
        derivative = np.zeros((len(which), len(dipoles), NUMBERS))
        derivative[np.arange(len(which)), which, :3] = -LENGTH_M * off[which, near] / distance_m[which, near][:, None]
        return self.least_m - distance_m[which, near], derivative.reshape(len(which), dipoles.size)


def _search_grid(position_m, clearance_m):
    """Places (P, 3)."""
    least, most = np.minimum(position_m.min(axis=0), 0), np.maximum(position_m.max(axis=0), 0)
    reach_m = np.max(np.linalg.norm(position_m, axis=1))
    step_m = reach_m / STEPS
    counts = np.ceil((most - least) / step_m + 2 * STEPS).astype(int) + 1
    places = least - reach_m + step_m * np.stack(np.meshgrid(*map(np.arange, counts), indexing="ij"), axis=-1).reshape(-1, 3)
    taken = np.vstack((np.zeros(3), position_m))
    return places[np.min(cdist(places, taken), axis=1) >= clearance_m]


def _quadratures(model, coils, data, position_m, attitude, dipoles):
    """Dipoles of the quadratures and the deviation of their couplings, each pose relative to its own. None if they are unknown or too small."""
    none = np.zeros((0, 12)), 0.0
    if not np.all(np.any(data.quadrature, axis=(1, 2))):
        return none
    alone = model(position_m, attitude, np.zeros((0, 12)))[0]
    x = np.swapaxes(alone.reshape(-1, 3, 3), 1, 2) + data.quadrature
    search = Search(model, coils, Placed(position_m, attitude, x, data.quadrature), relative=True)
    places = np.hstack((dipoles[:, :3], np.zeros((len(dipoles), NUMBERS - 3))))
    search.at = dataclasses.replace(search.at, dipoles=places)
    try:
        search.solve()
    except ValueError:
        return none
    found = rows_of(search.at.dipoles)
    induced = model(position_m, attitude, found)[0] - alone
    measured = np.swapaxes(data.quadrature, 1, 2).reshape(-1, 9)
    off = np.abs(np.sum(induced * measured, axis=1) / np.sum(induced**2, axis=1) - 1)
    deviation = DEVIATION_PER_MEDIAN * upper_median(off)
    return (found, deviation) if deviation < LARGEST_DEVIATION else none


def fit_surroundings(model, coils: Coils, data: Placed) -> Fit:
    """Adds dipoles one by one, each where it explains most of the residual, and fits all of them together. Dipoles stay away from source and poses. The
    dipoles of the quadratures start at the same places. model: see Search. Raises ValueError for fewer than 18 places, places in one plane, couplings
    that dipoles do not explain better than the coils alone, and no convergence."""
    check_places(data.place_m)
    search = Search(model, coils, data)
    search.run()
    position_m, attitude, *_ = search.poses()
    rigid = [(_exp(block[3:]) @ start[0], LENGTH_M * block[:3]) for block, start in ((search.at.frame, data.frame), (search.at.mount, data.mount))]
    return Fit(rows_of(search.at.dipoles), *rigid, position_m, search.residual_before_m, search.rms_m(),
               *_quadratures(model, coils, data, position_m, attitude, search.at.dipoles))
