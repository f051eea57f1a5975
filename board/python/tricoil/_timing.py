"""Timing of a tracker: when it measures the three columns of a pose, and how it solves them."""

import dataclasses
import difflib

import numpy as np
from numpy.typing import NDArray

from ._poses import PoseError

#: Description and the words of --timing. Makers do not publish the slots of their trackers; the numbers follow from the documented rate.
TIMINGS = {
    "tricoil-tdm": ("tricoil with --mux tdm: 240 frames of three slots", "tdm:3/720,window=1.1111"),
    "tricoil-fdm": ("tricoil with --mux fdm", "fdm:240"),
    "fastrak": ("Polhemus FASTRAK with one sensor, 120 poses/s: three coils in turn", "tdm:3/360"),
    "liberty": ("Polhemus LIBERTY, 240 poses/s: three coils in turn", "tdm:3/720"),
    "viper": ("Polhemus VIPER, 960 poses/s: three coils in turn", "tdm:3/2880"),
    "trakstar": ("NDI trakSTAR, 80 cycles/s: three coils in turn, then a slot without field", "tdm:4/320"),
}
#: Trackers that this model does not describe.
OTHERS = {"aurora": "its field generator has more than three coils"}

COLUMNS = 3
SOLVERS = ("direct", "previous", "previous-frame")
LONGEST_MS = 100  # of a window and of a latency; the path beyond the last pose is known no further
SLOT_TOLERANCE = 0.05  # of a slot: poses come at whole numbers of slots, with the jitter of their time stamps


@dataclasses.dataclass(frozen=True)
class Timing:
    """Times at which a tracker measures.

    text: as given. slots: in a frame; 0: all columns at once (FDM). slot_s: from one slot to the next. order: source coils in the order of
    their slots; the last one is the newest of a pose. window_s: length of a demodulation window. latency_s: from the middle of the newest
    slot to the time stamp. solver: direct (maximum likelihood), previous or previous-frame (the
    paper's previous-measurement technique, with a step after each column or after each frame).
    """

    text: str
    slots: int = 0
    slot_s: float = 0.0
    order: tuple[int, int, int] = (0, 1, 2)
    window_s: float = 0.0
    latency_s: float = 0.0
    solver: str = "direct"

    @property
    def is_sequential(self) -> bool:
        """True if the columns of a pose are measured one after the other."""
        return self.slots > 0

    def describe(self) -> str:
        """The timing in one line, for every output."""
        if not self.is_sequential:
            what = "all coils at once (FDM)"
        else:
            coils = " ".join(f"S{coil + 1}" for coil in self.order)
            what = f"{coils} in turn, {1e3 * self.slot_s:.4g} ms apart, {self.slots} slots a frame"
        return f"{what}; window {1e3 * self.window_s:.4g} ms, latency {1e3 * self.latency_s:.4g} ms, {self.solver} solver"

    def column_age_s(self, time_s: NDArray, phase: int = 0) -> NDArray:
        """Age of each column at the time stamp of each pose, s, shape (N, 3).

        phase: slots from the last one of a frame to that of the first pose; used if there is a pose after each column. Raises PoseError if
        no tracker of this timing can make poses at these times.
        """
        count = len(time_s)
        ages = np.full((count, COLUMNS), self.latency_s)
        if count < 2:
            return ages
        interval_s = float(np.median(np.diff(time_s)))
        if interval_s < (1 - SLOT_TOLERANCE) * self.slot_s:
            raise PoseError(f"timing '{self.text}': a slot of {1e3 * self.slot_s:.4g} ms is longer than the pose interval of "
                            f"{1e3 * interval_s:.4g} ms; give the slots as tdm:SLOTS/RATE, for example tdm:3/720")
        if self.window_s > (1 + SLOT_TOLERANCE) * interval_s:
            raise PoseError(f"timing '{self.text}': a window of {1e3 * self.window_s:.4g} ms is longer than the pose interval of "
                            f"{1e3 * interval_s:.4g} ms; give a shorter one with window=MS")
        if not self.is_sequential:
            return ages
        steps = np.diff(time_s) / self.slot_s
        interval = interval_s / self.slot_s
        newest = np.full(count, COLUMNS - 1)
        if self.has_phases(time_s):
            newest = (COLUMNS - 1 + phase + np.append(0, np.cumsum(np.round(steps).astype(int)))) % COLUMNS
        elif interval < self.slots - SLOT_TOLERANCE:
            raise PoseError(f"timing '{self.text}': a frame of {self.slots} slots, {1e3 * self.slots * self.slot_s:.4g} ms, is longer than the pose interval of "
                            f"{1e3 * interval_s:.4g} ms, which is no whole number of its slots")
        for place, coil in enumerate(self.order):
            ages[:, coil] += (newest - place) % COLUMNS * self.slot_s
        return ages

    def has_phases(self, time_s: NDArray) -> bool:
        """True if poses do not all have the same newest column: the tracker solves after each one."""
        steps = float(np.median(np.diff(time_s))) / self.slot_s
        return self.slots == COLUMNS and abs(steps - round(steps)) < SLOT_TOLERANCE and round(steps) % self.slots != 0


def _number(text, value, what, least, most):
    try:
        number = float(value)
    except ValueError:
        number = np.nan
    if not least <= number <= most:
        raise PoseError(f"timing '{text}': {what} must be a number of {least:g} to {most:g}; is '{value}'")
    return number


def _options(timing, words):
    """Applies order=231, window=MS, latency=MS, solver=previous."""
    for word in words:
        name, _, value = word.partition("=")
        if name == "order":
            if sorted(value) != list("123"):
                raise PoseError(f"timing '{timing.text}': order must name each coil once, the newest last, for example order=231; is '{value}'")
            timing = dataclasses.replace(timing, order=tuple(int(digit) - 1 for digit in value))
        elif name in ("window", "latency"):
            timing = dataclasses.replace(timing, **{name + "_s": 1e-3 * _number(timing.text, value, name + " in ms", 0, LONGEST_MS)})
        elif name == "solver":
            if value not in SOLVERS:
                raise PoseError(f"timing '{timing.text}': solver must be {', '.join(SOLVERS)}; is '{value}'")
            if value != "direct" and not timing.is_sequential:
                raise PoseError(f"timing '{timing.text}': solver={value} is for tdm")
            timing = dataclasses.replace(timing, solver=value)
        else:
            raise PoseError(f"timing '{timing.text}': unknown option '{word}'; give order=, window=, latency= or solver=")
    return timing


def parse_timing(text: str) -> Timing:
    """Timing of a text: tdm:SLOTS/RATE, fdm or fdm:RATE, or a name of TIMINGS, each with options such as ,order=231,latency=4.

    Raises PoseError.
    """
    base, *words = text.strip().lower().split(",")
    if base in OTHERS:
        raise PoseError(f"timing '{base}': {OTHERS[base]}; this model has three coils at one place")
    if base in TIMINGS:
        given, *named = TIMINGS[base][1].split(",")
        words = named + words
    else:
        given = base
    kind, _, numbers = given.partition(":")
    if kind == "fdm":
        window_s = 1 / _number(text, numbers, "the rate of FDM", 1, 1e5) if numbers else 0.0
        return _options(Timing(text, window_s=window_s), words)
    if kind != "tdm":
        near = difflib.get_close_matches(base, [*TIMINGS, "tdm:3/720", "fdm"], 1)
        hint = f"; did you mean '{near[0]}'" if near else ""
        raise PoseError(f"unknown timing '{base}'{hint}; give tdm:SLOTS/RATE, for example tdm:3/720, fdm, {', '.join(TIMINGS)} or fit")
    slots, _, rate = numbers.partition("/")
    if not (slots.isascii() and slots.isdigit()) or not COLUMNS <= int(slots) <= 16:
        raise PoseError(f"timing '{text}': give tdm:SLOTS/RATE with 3 to 16 slots a frame and RATE slots a second, for example tdm:3/720")
    slot_s = 1 / _number(text, rate, "the rate of slots", 1, 1e5)
    return _options(Timing(text, slots=int(slots), slot_s=slot_s, window_s=slot_s), words)
