"""Least squares of tones of known frequencies and a slow disturbance, in blocks of any length."""

import numpy as np

MOST_ORDER = 7  # of the polynomial: mains hum of 50 Hz with its harmonics to the fifth in a block of 4 ms
CYCLES_PER_ORDER = 2  # of the lowest tone; fewer would let the polynomial take part of the tone


class ToneFit:
    """IEEE Std 1057, clause 5 (sine fit with three parameters), for several tones. w: radians per sample, (K), that a block of this many
    samples can separate. The disturbance (offset, drift, hum) is a polynomial."""

    def __init__(self, w, samples: int):
        phase = np.outer(np.arange(samples), w)
        self._tones = 2 * len(w)
        order = min(MOST_ORDER, int(np.min(w) * samples / (2 * np.pi * CYCLES_PER_ORDER)))
        self._basis = np.empty((samples, self._tones + 1 + order))
        self._basis[:, 0:self._tones:2] = np.cos(phase)
        self._basis[:, 1:self._tones:2] = np.sin(phase)
        self._basis[:, self._tones:] = np.polynomial.legendre.legvander(np.linspace(-1, 1, samples), order)
        self._solve = np.linalg.solve(self._basis.T @ self._basis, self._basis.T)  # of the normal equations

    def fit(self, values):
        """values: (B, samples, channels) or more samples. Returns amplitudes z (B, channels, K): Re(z exp(i w n)), n from the first sample of the
        block; and the standard deviation of a sample (B, channels)."""
        samples = len(self._basis)
        values = values[:, :samples]
        found = self._solve @ values
        amplitude = (found[:, 0:self._tones:2] - 1j * found[:, 1:self._tones:2]).transpose(0, 2, 1)
        residual = values - self._basis @ found
        noise = np.sqrt(np.einsum("bnc,bnc->bc", residual, residual) / max(samples - self._basis.shape[1], 1))
        return amplitude, noise
