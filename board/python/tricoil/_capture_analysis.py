"""Couplings from a capture of raw samples: carriers, reference channel, phases, scatter, presence of a sensor."""

import dataclasses

import numpy as np

from . import _block_flags
from ._capture import Blocks, Capture
from ._dipole_check import sensor_in
from ._tone_fit import ToneFit
from ._wiring import Wiring

COILS = 3
COUPLINGS = 9
NYQUIST_SHARE = 0.9  # highest carrier, of half the sample rate
MIN_PERIODS = 2  # of the smallest difference of frequencies, in a block
DEFAULT_PERIODS = 4
LONGEST_BLOCK = 10_000_000
MOST_OFFSET_PPM = 10_000
MIN_CARRIER_RATIO = 6  # amplitude of a carrier over its standard deviation
MIN_REFERENCE_RATIO = 1.5  # in every block, reference amplitude over that of the largest other channel
STEADY_RATIO = 1.1  # strongest block over weakest, of the reference to coils in turn
UNSTEADY_RATIO = 1.3  # the same, of every sensor channel
MIN_REFERENCE_SHARE = 0.5  # of its mean amplitude; a weaker reference dropped out
WORTH = 0.5  # share of the misfit: a correction that leaves less is told
SEARCHED = 4  # blocks in which the carriers are searched
SETUP_S = 1  # signal that gives frequencies, reference, phases and signs
SETUP_BLOCKS = 12  # of each coil
ROW = np.dtype([("time_s", float), ("x", float, (3, 3)), ("quadrature", float, (3, 3)), ("sigma", float)])


def shortest(value: float) -> str:
    """A number for a message, without .0."""
    return repr(float(value)).removesuffix(".0")


@dataclasses.dataclass
class Repeat:
    """Couplings of a repeat that is not yet complete. Times in samples."""

    begin: float
    end: float = 0.0
    columns: np.ndarray = dataclasses.field(default_factory=lambda: np.zeros((3, 3), complex))
    coils: set = dataclasses.field(default_factory=set)
    variance: float = 0.0  # of a coupling


class Analyser:
    """induced: coils whose voltages grow with the carrier; couplings are divided by the carrier over the mean of the carriers.

    Raises ValueError for carriers that do not suit the rate, the blocks, or each other."""

    def __init__(self, capture: Capture, carrier_hz, rate_hz: float, guard: int, block: int, reference: str | None, wiring: Wiring, induced: bool):
        self.capture, self.guard, self.reference_name, self.wiring = capture, guard, reference, wiring
        self.rate_hz = rate_hz or capture.rate_hz
        needed = 1 if capture.has_states else COILS
        if not (self.rate_hz > 0 and np.isfinite(self.rate_hz)):
            raise ValueError(f"--rate-hz {shortest(rate_hz)}: give the sample rate, more than 0")
        if len(carrier_hz) != needed:
            raise ValueError(f"{capture.path}: {len(carrier_hz)} carriers; with the columns state, repeat and sample the coils are driven in turn, at "
                             "one carrier, otherwise at the same time, at three")
        if induced and capture.has_states:
            raise ValueError("--induced: coils that are driven in turn have one carrier; leave it out")
        self.induced = induced
        self.given_hz = np.array(carrier_hz, float)
        self.w = 2 * np.pi * self.given_hz / self.rate_hz  # of the carriers, radians per sample
        self.block_samples = int(min(self._checked_block(block), LONGEST_BLOCK))
        self.flags = np.zeros(len(_block_flags.NAMES), bool)
        self.phases = np.ones((3, needed), complex)  # unit phasors, by sensor channel and tone
        self.signs = [None] * COILS  # real columns, the last of each coil
        self.sign = 1.0
        self.repeats = {}  # not yet complete
        self.last_x = None
        self.count = 0
        self.sums = {"x": np.zeros((3, 3)), "quadrature": np.zeros((3, 3)), "squares": np.zeros((3, 3)), "variance": 0.0}

    def _checked_block(self, block: int) -> float:
        highest_hz = NYQUIST_SHARE * self.rate_hz / 2
        for hz in self.given_hz:
            if not 0 < hz <= highest_hz:
                raise ValueError(f"--carrier-hz {shortest(hz)}: must be more than 0, and at most {highest_hz:g} Hz, {NYQUIST_SHARE:g} of the Nyquist "
                                 "frequency, or it aliases")
        lines_hz = np.sort(np.concatenate(([0, self.rate_hz / 2], self.given_hz)))
        apart_hz = np.diff(lines_hz).min()

        if not apart_hz > 0:
            raise ValueError("--carrier-hz: two frequencies are equal; coils that are driven at the same time need three")

        def samples_for(periods):
            return float(np.ceil(periods * self.rate_hz / apart_hz))

        samples = float(block) if block else samples_for(DEFAULT_PERIODS)
        if not self.capture.has_states and not samples_for(MIN_PERIODS) <= samples <= LONGEST_BLOCK:
            raise ValueError(f"--carrier-hz: two frequencies are only {apart_hz:g} Hz apart; blocks of {shortest(samples)} samples cannot separate them, "
                             f"{shortest(samples_for(MIN_PERIODS))} or more can")
        return samples

    def window(self, blocks: Blocks):
        return blocks.values[:, self.guard:]

    def _flags_of(self, blocks: Blocks):
        cycles = [max(1, int(w / (2 * np.pi) * self.samples)) for w in self.w]
        return _block_flags.flags_of(self.window(blocks), self.capture.full_scale, _block_flags.natural_run(cycles, self.samples))

    def _set_length(self, blocks: Blocks):
        length = blocks.values.shape[1]
        needed = self.guard + 2 * (2 * len(self.w) + 2)
        if length < needed:
            raise ValueError(f"{self.capture.path}: blocks of {length} samples; with --guard {self.guard} at least {needed} are needed")
        self.samples, self.block_samples = length - self.guard, length

    def _setup_of(self, batches):
        """Blocks of the first second, with twelve of each coil, and the rest of the last batch."""
        parts, total, counts = [], 0, np.zeros(COILS, int)
        for blocks in batches:
            self._set_length(blocks)
            for n, coil in enumerate(blocks.coil):
                counts[slice(None) if coil < 0 else coil] += 1
                if counts.min() >= SETUP_BLOCKS and (total + n + 1) * self.block_samples >= SETUP_S * self.rate_hz:
                    return [*parts, blocks.part(0, n + 1)], blocks.part(n + 1)
            total += len(blocks)
            parts.append(blocks)
        return parts, None

    def _read_setup(self, batches):
        parts, rest = self._setup_of(batches)
        if not parts:
            raise ValueError(f"{self.capture.path}: holds no samples, or fewer than a block of {self.block_samples}; give --block, or carriers farther apart")
        setup = Blocks.joined(parts)
        flags = self._flags_of(setup)
        self.flags |= flags.any(axis=(0, 2))
        is_clipped = flags[:, :2].any(axis=1)
        self.clipped, always = ([name for name, is_so in zip(self.capture.channels, some) if is_so] for some in (is_clipped.any(axis=0), is_clipped.all(axis=0)))
        if always:
            raise ValueError(f"{self.capture.path}: every block of {', '.join(always)} is clipped; reduce the gain")
        return setup, rest

    def _estimate_frequencies(self, blocks: Blocks):
        half = self.samples // 2
        values = self.window(blocks)
        self._search(values[:SEARCHED])
        for _ in range(3):
            fit = ToneFit(self.w, half)
            first, second = fit.fit(values)[0], fit.fit(values[:, half:])[0]
            advance = np.einsum("bck,bck->k", first.conj(), second)  # of the phase, in half a block
            self.w = self.w + np.angle(advance * np.exp(-1j * self.w * half)) / half
        self.carrier_hz = self.w / (2 * np.pi) * self.rate_hz
        self.growth = self.carrier_hz / self.carrier_hz.mean()  # of induced voltages
        self.offset_ppm = 1e6 * (self.carrier_hz / self.given_hz - 1)
        self.fit = ToneFit(self.w, self.samples)

    def _search(self, values):
        """The strongest frequency near each carrier, where the phase over half a block would be ambiguous."""
        length = 2 * self.samples  # bins of half a period a block
        window = np.hanning(self.samples)
        power = sum(abs(np.fft.rfft(window * values[b, :, c], length)) ** 2 for b, c in np.ndindex(len(values), values.shape[2]))
        near = np.diff(np.sort(np.concatenate(([0.0], self.w, [np.pi])))).min() / 2
        for k, w in enumerate(self.w):
            reach = min(1e-6 * MOST_OFFSET_PPM * w, near)
            if reach * self.samples >= np.pi:
                first, last = (int(np.round((w + side * reach) * length / (2 * np.pi))) for side in (-1, 1))
                self.w[k] = 2 * np.pi * (first + int(np.argmax(power[first:last + 1]))) / length

    def _tones_of(self, blocks: Blocks):
        """Amplitudes (B, C, K), of coils at the same time with the phases at the first sample of the capture; and noise (B, C)."""
        amplitude, noise = self.fit.fit(self.window(blocks))
        if not self.capture.has_states:
            phase = np.fmod(np.outer(blocks.begin + self.guard, self.w), 2 * np.pi)
            amplitude = amplitude * np.exp(-1j * phase)[:, None, :]
        return amplitude, noise

    def _check_signal(self, amplitude, noise):
        power = np.sum(abs(amplitude) ** 2, axis=0)
        variance = 1e-300 + np.sum(2 / self.samples * noise**2, axis=0)
        ratio = (power / variance[:, None]).max(axis=0)
        for hz, strength, ppm in zip(self.given_hz, ratio, self.offset_ppm):
            if not strength >= MIN_CARRIER_RATIO**2:
                raise ValueError(f"{self.capture.path}: no channel has a carrier of {hz:g} Hz: silence, or a wrong --carrier-hz or --rate-hz")
            if not abs(ppm) <= MOST_OFFSET_PPM:
                raise ValueError(f"{self.capture.path}: the carrier of {hz:g} Hz is {ppm:.0f} ppm off, more than {MOST_OFFSET_PPM:g}; correct --carrier-hz "
                                 "or --rate-hz")

    def _found_reference(self, amplitude) -> int:
        """The channel that is much larger than the others in every block, or alone the same for all coils."""
        size = abs(amplitude)
        weakest, strongest = size.min(axis=(0, 2)), size.max(axis=(0, 2))
        change = strongest / np.maximum(weakest, 1e-300)
        for c in range(len(weakest)):
            is_steady = self.capture.has_states and change[c] < STEADY_RATIO and np.delete(change, c).min() >= UNSTEADY_RATIO
            if is_steady or weakest[c] >= MIN_REFERENCE_RATIO * np.delete(strongest, c).max():
                return c
        clipped = f"; {', '.join(self.clipped)} is clipped" if self.clipped else ""
        raise ValueError(f"{self.capture.path}: cannot identify the reference channel: no carrier is much larger than the others in every block, or alone "
                         f"equal for all coils{clipped}; name it with --reference")

    def _choose_channels(self, amplitude):
        channels = len(self.capture.channels)
        self.reference = None
        if self.reference_name not in (None, "", "none"):
            self.reference = self.capture.channel_of(self.reference_name)
        elif self.reference_name != "none" and channels > COILS:
            self.reference = self._found_reference(amplitude)
        self.sensors = [c for c in range(channels) if c != self.reference]
        if len(self.sensors) != COILS:
            raise ValueError(f"{self.capture.path}: {len(self.sensors)} sensor channels; three are needed: select them and the reference with --columns and "
                             "--reference")
        # By tone; 1 without a reference.
        self.reference_amplitude = np.ones(len(self.w)) if self.reference is None else abs(amplitude[:, self.reference]).mean(axis=0)

    def _columns_of(self, blocks: Blocks, amplitude):
        """Driven coils (B, J) and their couplings z (B, J, 3), real but for the quadrature: of one coil in turn, of three at the same time."""
        coils = blocks.coil[:, None] if self.capture.has_states else np.tile(np.arange(COILS), (len(blocks), 1))
        z = (amplitude[:, self.sensors] / self.phases).transpose(0, 2, 1)
        if self.reference is None:
            return coils, self._with_signs(coils, z * np.exp(-0.5j * np.angle(np.sum(z * z, axis=2)))[..., None])
        reference = amplitude[:, self.reference]
        share = abs(reference) / self.reference_amplitude
        dropped = np.flatnonzero(~(share >= MIN_REFERENCE_SHARE))
        if len(dropped):
            repeat = blocks.repeat[dropped[0] // share.shape[1]]
            raise ValueError(f"{self.capture.path}: the reference drops out in repeat {repeat}, to {100 * share.flat[dropped[0]]:.1f} % of its mean amplitude")
        return coils, z / reference[..., None]

    def _with_signs(self, coils, z):
        """Without a reference, each column has the sign of the one before."""
        z = z.copy()
        for n, j in np.ndindex(*coils.shape):
            before = self.signs[coils[n, j]]
            if before is not None and z[n, j].real @ before < 0:
                z[n, j] *= -1
            self.signs[coils[n, j]] = z[n, j].real
        return z

    def _find_phases(self, blocks: Blocks, amplitude):
        """The phase of each sensor channel relative to the reference, and the sign of all couplings. The phase of squared couplings does not depend
        on their signs; each channel's phase is within a quarter turn of the common one."""
        if self.reference is not None:
            _, z = self._columns_of(blocks, amplitude)
            squares = np.sum(z * z, axis=0).T  # by channel and tone
            common = np.exp(0.5j * np.angle(squares.sum(axis=0)))
            phases = common * np.exp(0.5j * np.angle(squares / common**2))
            for k in range(1, len(self.w)):  # phases differ little between carriers
                phases[:, k] *= -1 if (common[k] / phases[0, 0]).real < 0 else 1
            self.phases = phases
        coils, z = self._columns_of(blocks, amplitude)
        total = np.column_stack([z.real[coils == j].sum(axis=0) for j in range(COILS)])
        self.signs = [None] * COILS
        self.sign = -1.0 if self.wiring.parity * np.linalg.det(total) < 0 else 1.0

    def _add(self, blocks: Blocks, amplitude, noise):
        """Rows of the repeats that these blocks complete."""
        coils, z = self._columns_of(blocks, amplitude)
        variance = 2 / (self.samples * COUPLINGS) * np.sum(noise[:, self.sensors] ** 2, axis=1)
        share = 1 / self.growth if self.induced else np.ones(len(self.w))
        weights = np.sum((share / self.reference_amplitude) ** 2) * variance
        rows = []
        for n, number in enumerate(blocks.repeat.tolist()):
            begin = float(blocks.begin[n] + self.guard)
            repeat = self.repeats.setdefault(number, Repeat(begin))
            repeat.end = begin + self.samples
            repeat.variance += weights[n]
            for j, coil in enumerate(coils[n]):
                if coil in repeat.coils:
                    raise ValueError(f"{self.capture.path}: repeat {number} holds state S{coil + 1} twice")
                repeat.coils.add(coil)
                repeat.columns[:, coil] = self.sign * share[j if self.induced else 0] * z[n, j]
            if len(repeat.coils) == COILS:
                rows.append(((repeat.begin + repeat.end - 1) / 2 / self.rate_hz, repeat.columns.real, repeat.columns.imag, np.sqrt(repeat.variance)))
                del self.repeats[number]
        rows = np.array(rows, ROW)
        for kind in ("x", "quadrature"):
            rows[kind] = self.wiring.of_coils(rows[kind])
        return self._summed(rows)

    def _summed(self, rows):
        if len(rows):
            x = rows["x"]
            steps = np.diff(x if self.last_x is None else np.concatenate((self.last_x[None], x)), axis=0)
            self.sums["squares"] += np.sum(steps**2, axis=0)
            self.sums["x"] += x.sum(axis=0)
            self.sums["quadrature"] += rows["quadrature"].sum(axis=0)
            self.sums["variance"] += np.sum(rows["sigma"] ** 2)
            self.last_x = x[-1]
            self.count += len(rows)
        return rows

    def rows(self):
        """Rows of complete repeats, as they come: of the first second together, which gives frequencies, reference, phases and signs."""
        batches = self.capture.blocks(self.block_samples)
        setup, rest = self._read_setup(batches)
        self._estimate_frequencies(setup)
        amplitude, noise = self._tones_of(setup)
        self._check_signal(amplitude, noise)
        self._choose_channels(amplitude)
        self._find_phases(setup, amplitude)
        yield self._add(setup, amplitude, noise)
        for blocks in [rest] if rest is not None else []:
            yield self._add_next(blocks)
        for blocks in batches:
            yield self._add_next(blocks)
        if self.repeats and not self.capture.follows:
            raise ValueError(f"{self.capture.path}: repeat {min(self.repeats)} lacks a state; each needs S1, S2 and S3")
        if self.count < 2:
            raise ValueError(f"{self.capture.path}: {self.count} complete repeats; the scatter needs two or more")

    def _add_next(self, blocks):
        if not len(blocks):
            return np.empty(0, ROW)
        self.flags |= self._flags_of(blocks).any(axis=(0, 2))
        return self._add(blocks, *self._tones_of(blocks))

    def _induced_misfit(self, mean, scatter, misfit_share):
        """The misfit with --induced, if that would be much smaller; otherwise None."""
        if self.induced or self.capture.has_states:
            return None
        growth = self.growth[np.argsort(np.abs(self.wiring.source))]  # by source coil, as the columns of the couplings
        other = sensor_in(mean / growth, scatter)["misfit_share"]
        return other if other < WORTH * misfit_share else None

    def result(self) -> dict:
        """After all rows: what tricoil demodulate --json prints."""
        mean = self.sums["x"] / self.count
        scatter = np.sqrt(self.sums["squares"] / (2 * (self.count - 1)))  # of a repeat: slow motion does not count
        sensor = sensor_in(mean, scatter)
        of_coils = self.wiring.sensor_channels
        return {
            "sensor_present": sensor.pop("sensor_present"),
            "verdict": sensor.pop("verdict"),
            "channels": list(self.capture.channels),
            "rate_hz": float(self.rate_hz),
            "block_samples": self.block_samples,
            "carrier_hz": self.carrier_hz.tolist(),
            "carrier_offset_ppm": self.offset_ppm.tolist(),
            "reference_channel": self.reference,
            "reference_amplitude": 0.0 if self.reference is None else float(self.reference_amplitude[0]),
            "sensor_channels": [self.sensors[channel] for channel in of_coils],
            "phase_deg": np.degrees(np.angle(self.phases[of_coils, 0])).tolist(),
            "repeats": self.count,
            "mean": mean.tolist(),
            "scatter": scatter.tolist(),
            "quadrature": (self.sums["quadrature"] / self.count).tolist(),
            "determinant": float(np.linalg.det(mean)),
            "singular_values": sensor["singular_values"],
            "snr_db": sensor["snr_db"],
            "estimated_sigma": float(np.sqrt(self.sums["variance"] / self.count)),
            "misfit_share": sensor["misfit_share"],
            "induced_misfit_share": self._induced_misfit(mean, scatter, sensor["misfit_share"]),
            "flags": [name for name, is_set in zip(_block_flags.NAMES, self.flags) if is_set],
        }
