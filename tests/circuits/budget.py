"""Position error of one frame by analog cause."""
import csv
import functools
import math
import os

from geometry import Sensitivity
from nonlinearity import rms_errors
from spice import CIRCUITS

MU0 = 4e-7 * math.pi
HALF_SUPPLY_V = 1.65
LSB_V = 3.3 / 4096
COMFORTABLE_V = 0.55 * HALF_SUPPLY_V  # board/app/gain_ranging.hpp
CONVERSIONS_HZ = 170e6 / 296

# The chip: assumptions close to the typical figures of DS12288
ADC_SNR_DB = 66
OPAMP_EN = 100e-9
OPAMP_GBW = 13e6
ADC_INL_LSB = 1.0       # largest integral non-linearity of a converter
REST_S = 0.25           # measurement time of a rest of the calibration

# Drift: temperature change since calibration, uniform within +-5 K, 2.9 K RMS
DRIFT_K = 5 / math.sqrt(3)
SENSE_PER_K = 15e-6     # each sense resistor
GAIN_PER_K = 14e-6      # each preamplifier: two ratios of 10 ppm/K resistors
EXPANSION_PER_K = 14e-6  # formers of glass-fibre epoxy, diameter
CABLE_PER_K = 1e-3      # capacitance of the sensor's cable
COPPER_PER_K = 3.9e-3
GAIN_STEP = 0.77e-3     # error of one gain step as measured at boot: RMS of 12 simulated converters (circuits/README.md)
PICK_UP_H = 1e-9        # ground shared by a source coil's current and the output of the first stage: 1 mm of wire
FIRST_STAGE = 31        # gain
PICK_UP_LEFT = 0.005    # share that a calibration leaves: its standard deviation in tests/calibration/pick_up_test.cpp is 0.3 %
USED_STEPS = 6          # between 0.3 and 1.2 m, the ranges of the calibration


def modes():
    with open(os.path.join(CIRCUITS, "modes.csv")) as file:
        return list(csv.DictReader(file))


HIGH_SHARE, LOW_SHARE = 0.8, 0.29  # two bands: high carriers relative to those of FDM 240; low carriers relative to full drive
LOW_HZ = 500  # at which the netlist of the preamplifier is run for the low band
NOISES = 4  # number of noise causes, the first ones of of_frame


def load_of(mode):
    """Weakest carrier, window, share of the full drive and crest factor of the sum of a mode."""
    first, last = float(mode["f1_hz"]), float(mode["f3_hz"])
    if mode["multiplexing"] == "tdm":
        return round(first), float(mode["window_s"]), 1.0, 1.0
    share = HIGH_SHARE if mode["multiplexing"] == "dual-band" else 1.0
    return round(last), float(mode["window_s"]), 0.65 * share * first / last, math.sqrt(3)


class Chain:
    """Signal chain from the source to the converter. results: of the netlists; moment: of a source coil at full drive, A m^2;
    area: turns times area of a sensor coil, m^2."""

    def __init__(self, results, moment, area):
        self.moment = moment
        self.area = area
        self.gain = {f: results[f"preamplifier.gain_{f}"] for f in (LOW_HZ, 7658, 9572, 10769, 13401)}
        self.noise = {f: results[f"preamplifier.noise_{f}"] for f in self.gain}
        self.current_a = results["drive.full_s2_a"]
        self.reference_v = results["reference.full_drive_v"]
        self.avdd_v = results["reference.avdd_v"]
        adc_rms = HALF_SUPPLY_V / math.sqrt(2) / 10 ** (ADC_SNR_DB / 20)
        self.adc = adc_rms / math.sqrt(CONVERSIONS_HZ / 2)

    def field_t(self, range_m):
        return MU0 * self.moment / (2 * math.pi * range_m**3)

    def coil_v(self, range_m, hz):
        return 2 * math.pi * hz * self.field_t(range_m) * self.area

    def pick_up(self, range_m, hz):
        """Before calibration, relative to the largest coupling."""
        return 2 * math.pi * hz * PICK_UP_H * self.current_a / (FIRST_STAGE * self.coil_v(range_m, hz))

    def nearest_m(self, hz):
        """Range, m, at which the signal at full drive and gain 1 uses the intended part of the converter's range."""
        return (self.coil_v(1, hz) * self.gain[hz] / COMFORTABLE_V) ** (1 / 3)

    def ranging(self, range_m, hz, share=1.0, crest=1.0):
        """Drive (a power of 1/2) and gain for a range, and the voltage at the converter."""
        volts = self.coil_v(range_m, hz) * self.gain[hz] * share
        drive, gain = 1.0, 1
        while volts * drive * crest > COMFORTABLE_V:
            drive /= 2
        while gain < 64 and volts * drive * gain * 2 * crest <= COMFORTABLE_V:
            gain *= 2
        return drive, gain, volts * drive * gain

    def densities(self, hz, gain):
        """Noise densities at the converter, V/sqrt(Hz): coil and preamplifier; op-amp of the chip with aliases; converter."""
        reach = math.pi / 2 * OPAMP_GBW / gain
        folded = math.sqrt(max(1.0, reach / (CONVERSIONS_HZ / 2)))
        return self.noise[hz] * self.gain[hz] * gain, OPAMP_EN * gain * folded, self.adc

    def relative_noise(self, range_m, hz, window_s, share=1.0, crest=1.0):
        """Noise relative to the largest coupling: preamplifier, op-amp, converter, reference."""
        drive, gain, volts = self.ranging(range_m, hz, share, crest)
        own = [d / math.sqrt(window_s) / volts for d in self.densities(hz, gain)]
        return [*own, self.adc / math.sqrt(window_s) / (self.reference_v * share * drive)]

    def snr_db(self, range_m, hz, window_s, share=1.0, crest=1.0):
        return -20 * math.log10(math.hypot(*self.relative_noise(range_m, hz, window_s, share, crest)))

    def low_snr_db(self, range_m, mode):
        """Of the weakest low carrier in two bands. The high carriers decide drive and gain."""
        high_hz, window_s, share, crest = load_of(mode)
        low_hz = float(mode["low1_hz"])
        drive, gain, _ = self.ranging(range_m, high_hz, share, crest)
        preamplifier = self.gain[LOW_HZ]
        volts = self.coil_v(range_m, low_hz) * preamplifier * LOW_SHARE * drive * gain
        own = [d / math.sqrt(window_s) / volts for d in self.densities(LOW_HZ, gain)]
        return -20 * math.log10(math.hypot(*own, self.adc / math.sqrt(window_s) / (self.reference_v * LOW_SHARE * drive)))


@functools.cache
def _sensitivity():
    return Sensitivity()


def of_frame(chain, range_m, mode, coil):
    """3D RMS position error of one TDM frame by cause, mm: (cause, calibrated with calibrate converters, calibrated without). The rests of
    the calibration cover all ranges."""
    s = _sensitivity()
    hz, window = round(float(mode["f1_hz"])), float(mode["window_s"])
    mm = 1e3 * range_m
    pre, opamp, adc, reference = chain.relative_noise(range_m, hz, window)
    drive, _, volts = chain.ranging(range_m, hz)
    amplitude = volts / LSB_V
    noise_lsb = math.hypot(pre, opamp, adc) * amplitude * math.sqrt(window / (REST_S / 3 * 0.8))
    raw, left = rms_errors(ADC_INL_LSB, noise_lsb)
    reference_lsb = chain.reference_v / LSB_V
    # the converter's codes are relative to AVDD, the signal rests at half of it; proportional to the drive, like the signal
    crosstalk = 0.5 * chain.avdd_v * drive / volts
    resonance = (hz * 2 * math.pi) ** 2 * coil["lcoil"] * coil["ccable"]
    expansion = 2 * EXPANSION_PER_K * DRIFT_K
    # errors of the steps add up from one to the next; the calibration of the coils contains their mean
    gain_steps = GAIN_STEP * math.sqrt((USED_STEPS**2 - 1) / (6 * USED_STEPS))
    causes = [
        ("noise: coil and preamplifier", s.coupling * pre, None),
        ("noise: op-amp of the chip", s.coupling * opamp, None),
        ("noise: converter", s.coupling * adc, None),
        ("noise: reference", s.column * reference, None),
        ("non-linearity of the sensors' converters", s.coupling * left / amplitude, s.coupling * raw / amplitude),
        # its amplitude is constant at full drive; with less drive its error is part of the gain step
        ("non-linearity of the reference's converter", 0, s.common * raw / reference_lsb / drive if drive < 1 else 0),
        ("gain steps", s.row * left / amplitude, s.row * gain_steps),
        ("crosstalk: reference amplifier through AVDD", s.coupling * crosstalk, None),
        ("pick-up of 1 nH after its calibration", s.coupling * PICK_UP_LEFT * chain.pick_up(range_m, hz), None),
        ("drift: sense resistors", s.column * SENSE_PER_K * DRIFT_K, None),
        ("drift: preamplifiers' gain", s.row * GAIN_PER_K * DRIFT_K, None),
        ("drift: size of the coils", s.common * 2 * expansion, None),
        ("drift: sensor coil's copper against its damping resistor", s.common * COPPER_PER_K * DRIFT_K * coil["rcoil"] / coil["rdamp"], None),
        ("drift: cable's capacitance", s.common * CABLE_PER_K * DRIFT_K * resonance, None),
    ]
    return [(name, mm * corrected, mm * (corrected if plain is None else plain)) for name, corrected, plain in causes]


def total(causes, column):
    return math.sqrt(sum(row[column] ** 2 for row in causes))
