"""Least squares of an offset and tones of known frequencies in blocks of any length."""

import numpy as np


class ToneFit:
    """IEEE Std 1057, clause 5 (sine fit with three parameters), for several tones. w: radians per sample, (K), that a block of this many
    samples can separate."""

    def __init__(self, w, samples: int):
        phase = np.outer(np.arange(samples), w)
        self._basis = np.empty((samples, 1 + 2 * len(w)))
        self._basis[:, 0] = 1
        self._basis[:, 1::2] = np.cos(phase)
        self._basis[:, 2::2] = np.sin(phase)
        self._solve = np.linalg.solve(self._basis.T @ self._basis, self._basis.T)  # of the normal equations

    def fit(self, values):
        """values: (B, samples, channels) or more samples. Returns amplitudes z (B, channels, K): Re(z exp(i w n)), n from the first sample of the
        block; and the standard deviation of a sample (B, channels)."""
        samples = len(self._basis)
        values = values[:, :samples]
        found = self._solve @ values
        amplitude = (found[:, 1::2] - 1j * found[:, 2::2]).transpose(0, 2, 1)
        residual = values - self._basis @ found
        noise = np.sqrt(np.einsum("bnc,bnc->bc", residual, residual) / max(samples - self._basis.shape[1], 1))
        return amplitude, noise
