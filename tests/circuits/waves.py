"""Amplitudes of carriers in sampled waveforms."""
import cmath
import math


class Wave:
    """Waveform from one column of rows with equal time steps; linear interpolation between samples."""

    def __init__(self, rows, column):
        self.step = rows[1][0] - rows[0][0]
        self.start = rows[0][0]
        self.values = [row[column] for row in rows]

    def at(self, time):
        place = (time - self.start) / self.step
        index = int(place)
        part = place - index
        return self.values[index] * (1 - part) + self.values[index + 1] * part

    def carrier(self, hz, start, cycles):
        """Complex amplitude over whole cycles."""
        count = 500 * cycles
        total = 0j
        for k in range(count):
            time = start + cycles / hz * (k + 0.5) / count
            total += self.at(time) * cmath.exp(-2j * math.pi * hz * time)
        return 2 * total / count

    def unsettled(self, hz, start, settled):
        """Largest difference, relative to the amplitude, between the cycle at `start` and the settled cycle at about `settled`."""
        period = 1 / hz
        shift = round((settled - start) / period) * period
        points = [period * k / 250 for k in range(250)]
        return max(abs(self.at(start + t) - self.at(start + shift + t)) for t in points) / abs(self.carrier(hz, start + shift, 1))

    def extremes(self):
        return min(self.values), max(self.values)
