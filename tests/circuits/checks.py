"""Limits of the results, and for each limit a wrong part with which the check must fail."""
import measures


class Check:
    """`result` must be between least and most. `wrong`: override of one part with which the check must fail."""

    def __init__(self, measure, result, least=None, most=None, wrong=None):
        self.measure, self.result, self.least, self.most, self.wrong = measure, result, least, most, wrong

    def holds(self, results):
        value = results[self.result]
        return (self.least is None or value >= self.least) and (self.most is None or value <= self.most)

    def limit(self):
        return " ".join(f"{sign} {bound:g}" for sign, bound in ((">=", self.least), ("<=", self.most)) if bound is not None)


GUARD_US = 277.6  # modes.csv; coil and preamplifier settle one after the other, the preamplifier within the last 100 us

SHARE = 0.9  # of the limits of exposure, with all tolerances
# three windings without walls that cross each other at mean radii of 37.5, 40 and 42.5 mm
WINDINGS_THAT_INTERSECT = {"S1.bore": 36.25, "S2.bore": 38.75, "S3.bore": 41.25, "S1.window": 14.0, "S2.window": 14.0, "S3.window": 14.0,
                           "source.wall": 0.0, "source.flange": 0.0, "source.rim": 0.0, "source.clearance": 0.0}

CHECKS = [
    Check(measures.loop, "loop.phase_margin_least_deg", least=45, wrong={"rd": "470k"}),
    Check(measures.loop, "loop.phase_margin_fault_deg", least=30, wrong={"fp2": "400k"}),
    Check(measures.slot, "slot.unsettled", most=1e-4, wrong={"rd": "1k"}),
    Check(measures.slot, "slot.settling_us", most=GUARD_US - 100, wrong={"rd": "2.2k"}),
    Check(measures.slot, "slot.peak_a", most=1.5, wrong={"rb": "8.2k"}),
    Check(measures.slot, "slot.beyond_supply_v", most=0.6, wrong={"iclamp": "1e-30"}),
    Check(measures.drive, "drive.full_s2_a", least=1.17, most=1.23, wrong={"ra": "10k"}),
    Check(measures.drive, "drive.headroom_v", least=0.3, wrong={"lcoil": "130u"}),
    Check(measures.drive, "drive.low_band_a", least=1.0, wrong={"rcoil": "12"}),
    Check(measures.drive, "drive.limit_least_a", least=1.4, wrong={"rset": "15k"}),
    Check(measures.drive, "drive.limit_most_a", most=2.0, wrong={"rset": "4.7k"}),
    Check(measures.fault, "fault.current_a", most=2.0, wrong={"rset": "3.3k"}),
    Check(measures.fault, "fault.beyond_supply_v", most=0.6, wrong={"iclamp": "1e-30"}),
    Check(measures.fault, "fault.supplies_v", most=24.0, wrong={"cbulk": "10u"}),
    Check(measures.supplies, "supplies.failed_v", most=25.5, wrong={"vcut": "100"}),
    Check(measures.supplies, "supplies.vdig_first_v", least=4.5, wrong={"slewp": "600"}),
    Check(measures.supplies, "supplies.vdig_most_v", most=5.5, wrong={"vreg": "6"}),
    Check(measures.supplies, "supplies.off_v", most=0.4, wrong={"rpull": "100k"}),
    Check(measures.heat, "heat.junction_c", most=110, wrong={"rhs": "8"}),
    Check(measures.two_bands, "two_bands.low_a", least=0.34, most=0.36, wrong={"cblk": "10n"}),
    Check(measures.two_bands, "two_bands.high_a", least=0.55, most=0.70, wrong={"cb": "22n"}),
    Check(measures.two_bands, "two_bands.peak_a", most=1.5, wrong={"rb": "8.2k"}),
    Check(measures.two_bands, "two_bands.junction_c", most=110, wrong={"rhs": "8"}),
    Check(measures.enable, "enable.off_v", most=0.4, wrong={"rpull": "100k"}),
    Check(measures.enable, "enable.on_v", least=2.4, most=4.6, wrong={"re": "6.8k"}),
    Check(measures.enable, "enable.on_delay_us", most=1, wrong={"ces": "4.7n"}),
    Check(measures.enable, "enable.off_delay_us", most=1, wrong={"ces": "4.7n"}),
    Check(measures.enable, "heartbeat.trigger_v", least=2.4, wrong={"chb": "3p"}),
    Check(measures.enable, "heartbeat.stuck_v", most=0.8, wrong={"chb": "10u"}),
    Check(measures.enable, "heartbeat.undershoot_v", least=-0.5, wrong={"iclamp": "1e-30"}),
    Check(measures.enable, "flag.cool_v", least=2.4, wrong={"rbe": "470k"}),
    Check(measures.enable, "flag.hot_v", least=-0.3, most=0.8, wrong={"rdown": "39k"}),
    Check(measures.enable, "flag.delay_ms", most=1, wrong={"ccool": "470n"}),
    Check(measures.preamplifier, "preamplifier.noise_10769", most=1.5e-9, wrong={"rg": "49.9"}),
    Check(measures.preamplifier, "preamplifier.noise_inner_10769", most=1.8e-9, wrong={"en": "2.2n"}),
    Check(measures.preamplifier, "preamplifier.noise_500", most=1.5e-9, wrong={"en": "3.2n"}),
    Check(measures.preamplifier, "preamplifier.gain_10769", least=302, most=316, wrong={"rf": "220"}),
    Check(measures.preamplifier, "preamplifier.gain_500", least=302, most=316, wrong={"r2": "12k"}),
    Check(measures.preamplifier, "preamplifier.flatness", most=0.01, wrong={"c1": "22n"}),
    Check(measures.preamplifier, "preamplifier.reject_conversions_db", least=70, wrong={"c1": "100p"}),
    Check(measures.preamplifier, "preamplifier.reject_samples_db", least=18, wrong={"c2": "100p"}),
    Check(measures.preamplifier, "preamplifier.reject_supply_db", least=65, wrong={"c1": "100p"}),
    Check(measures.accuracy, "preamplifier.driver_a", most=28e-3, wrong={"rg": "2.49"}),
    Check(measures.preamplifier, "preamplifier.settling_us", most=100, wrong={"c1": "100n"}),
    Check(measures.reference, "reference.full_drive_v", least=0.67, most=0.73, wrong={"r2": "3.3k"}),
    Check(measures.reference, "reference.phase_match_deg", most=1.0, wrong={"c4": "22n"}),
    Check(measures.reference, "reference.noise", most=200e-9, wrong={"en": "45n"}),
    Check(measures.fit, "coils.ring_gap_mm", least=0, wrong=WINDINGS_THAT_INTERSECT),
    Check(measures.fit, "coils.window_spare_mm", least=0, wrong={"litz.outer_max": 1.25}),
    Check(measures.fit, "coils.groove_spare_mm", least=0, wrong={"enamel.outer_max": 0.25}),
    Check(measures.fit, "coils.source_spread", most=0.02, wrong={"S1.turns": 29}),
    Check(measures.fit, "coils.sensor_spread", most=0.01, wrong={"C1.turns": 420}),
    Check(measures.coils, "coils.netlist_error", most=0.01, wrong={"S1.turns": 31}),
    Check(measures.coils, "coils.formulas_differ", most=0.05, wrong={"S3.turns": 1}),
    Check(measures.coils, "coils.coupling_tilted", most=0.01, wrong={"source.tilt_deg": 1}),
    Check(measures.exposure, "field.tdm_10cm_worst_ut", most=SHARE * 27, wrong={"S3.turns": 27}),
    Check(measures.exposure, "field.fdm_10cm_worst_ut", most=SHARE * 27, wrong={"S1.turns": 31}),
    Check(measures.exposure, "field.fdm_level_worst_m", most=0.097, wrong={"S1.turns": 34}),
    Check(measures.exposure, "field.two_bands_10cm_worst_share", most=SHARE, wrong={"S2.turns": 24}),
    Check(measures.crosstalk, "cause.crosstalk: reference amplifier through AVDD", most=0.01, wrong={"rfeed": "1m"}),
    Check(measures.accuracy, "budget.total_75_mm", most=0.2, wrong={"en": "3.2n"}),
]

RUNS = [measures.loop, measures.slot, measures.drive, measures.fault, measures.supplies, measures.heat, measures.two_bands, measures.enable, measures.preamplifier,
        measures.reference, measures.fit, measures.coils, measures.exposure]


def all_results():
    results = {}
    for measure in RUNS:
        results.update(measure())
    results.update(measures.accuracy(results))
    return results


def with_wrong_part(check, results):
    """Results of the check's measure with its wrong part."""
    if check.measure in (measures.accuracy, measures.crosstalk):
        return check.measure(results, **check.wrong)
    return check.measure(**check.wrong)
