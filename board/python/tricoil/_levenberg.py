"""Least squares by Levenberg and Marquardt, with unknowns that all poses share and unknowns of single poses."""

import dataclasses

import numpy as np
from numpy.typing import NDArray

MOST_STEPS = 100
COST_TOLERANCE, STEP_TOLERANCE, GRADIENT_TOLERANCE = 1e-6, 1e-9, 1e-10
LEAST_DECREASE = 1e-3  # of the cost, relative to that of the linearised model
LEAST_RADIUS = 1e-32


@dataclasses.dataclass
class Blocks:
    """Linearised residuals of poses (N, K), their derivatives by shared (N, K, S) and own unknowns (N, K, O), and residuals of no pose (L,), (L, S)."""

    residual: NDArray
    shared: NDArray
    own: NDArray
    extra: NDArray
    by_shared: NDArray


def _loss(residual, scale):
    """Loss of each pose, and its weight. scale: of Cauchy's loss; None: squares."""
    squares = np.sum(residual**2, axis=1)
    return (squares, np.ones_like(squares)) if scale is None else (scale**2 * np.log1p(squares / scale**2), 1 / (1 + squares / scale**2))


def _cost(residual, extra, scale):
    return 0.5 * (np.sum(_loss(residual, scale)[0]) + np.sum(extra**2))


def _damping(diagonal):
    """Of normalised columns, so that a column without effect stays in place."""
    norm = 1 + np.sqrt(diagonal)
    return np.clip(diagonal / norm**2, 1e-6, 1e32) * norm**2


class _Normal:
    """Normal equations, in which the own unknowns of each pose are eliminated."""

    def __init__(self, blocks: Blocks, scale):
        root = np.sqrt(_loss(blocks.residual, scale)[1])
        r, shared, own = root[:, None] * blocks.residual, root[:, None, None] * blocks.shared, root[:, None, None] * blocks.own
        flat = shared.reshape(r.size, shared.shape[2])
        self.of_shared = flat.T @ flat + blocks.by_shared.T @ blocks.by_shared
        self.of_own = np.swapaxes(own, 1, 2) @ own
        self.across = np.swapaxes(shared, 1, 2) @ own
        self.by_shared = flat.T @ r.ravel() + blocks.by_shared.T @ blocks.extra
        self.by_own = np.einsum("nki,nk->ni", own, r)

    def gradient(self) -> float:
        return max(np.max(np.abs(g), initial=0) for g in (self.by_shared, self.by_own))

    def step(self, radius: float):
        """Steps of the shared (S,) and the own unknowns (N, O), and the decrease of the linearised cost."""
        eye = np.eye(self.of_own.shape[1])
        own = self.of_own + eye * (_damping(np.diagonal(self.of_own, axis1=1, axis2=2)) / radius)[:, None]
        shared = self.of_shared + np.diag(_damping(np.diag(self.of_shared)) / radius)
        eliminated = self.across @ np.linalg.inv(own)
        left = shared - np.sum(eliminated @ np.swapaxes(self.across, 1, 2), axis=0)
        of_shared = -np.linalg.solve(left, self.by_shared - np.einsum("nij,nj->i", eliminated, self.by_own))
        rest = self.by_own + np.einsum("nij,i->nj", self.across, of_shared)
        of_own = -np.linalg.solve(own, rest[..., None])[..., 0]
        curved = of_shared @ self.of_shared @ of_shared + np.einsum("ni,nij,nj->", of_own, self.of_own, of_own)
        curved += 2 * np.einsum("i,nij,nj->", of_shared, self.across, of_own)
        return of_shared, of_own, -(self.by_shared @ of_shared + np.sum(self.by_own * of_own)) - 0.5 * curved


def minimise(start, residuals, linearise, moved, scale: float | None = None):
    """The unknowns with the least sum of the squares, or of Cauchy's loss of the squared residual of each pose, with this scale.

    residuals(unknowns): (N, K) and (L,). linearise(unknowns): Blocks. moved(unknowns, shared step, own steps): the next unknowns. The strategy of the trust
    region and its tolerance of the cost are those of Ceres, with which the coils are fitted. Raises ValueError without convergence.
    """
    at, cost = start, _cost(*residuals(start), scale)
    if not np.isfinite(cost):
        raise ValueError("the fit of the surroundings does not converge: the residuals are not finite")
    radius, shrink, normal = 1e4, 2.0, None
    for _ in range(MOST_STEPS):
        normal = normal or _Normal(linearise(at), scale)
        if normal.gradient() <= GRADIENT_TOLERANCE:
            break
        shared, own, expected = normal.step(radius)
        next_at = moved(at, shared, own)
        next_cost = _cost(*residuals(next_at), scale)
        if np.sqrt(np.sum(shared**2) + np.sum(own**2)) <= STEP_TOLERANCE:
            break
        ratio = (cost - next_cost) / expected if expected > 0 and np.isfinite(next_cost) else -1
        if ratio > LEAST_DECREASE:
            change, at, cost, normal = cost - next_cost, next_at, next_cost, None
            radius, shrink = min(radius / max(1 / 3, 1 - (2 * ratio - 1) ** 3), 1e16), 2.0
            if abs(change) <= COST_TOLERANCE * (cost + change):
                break
        else:
            radius, shrink = radius / shrink, 2 * shrink
            if radius < LEAST_RADIUS:
                break
    return at
