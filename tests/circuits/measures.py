"""Runs of the netlists over tolerances and phases, reduced to results. Each function takes overrides of parameters."""
import functools
import itertools
import math
import os
import re

import budget
import field
import inductance
import spice
from waves import Wave
from winding import SENSOR, SOURCE, Triads

AMBIENT_C = 40
FULL_DRIVE_V = 1.44  # carrier at the DAC's pin: 1792 of 2048 codes (drivers/stm32g4/acquisition.hpp)
CONVERSION_TAPS = 8  # conversions per sample


def parameters(file, names, overrides):
    return {name: spice.number(str(overrides[name])) if name in overrides else spice.value(file, name) for name in names}


def _with(overrides, **more):
    return {**more, **overrides}  # `overrides` of the caller have priority


def tdm():
    return next(mode for mode in budget.modes() if mode["mode"] == "TDM 240")


INDUCTANCE_TOL = 0.1


def _source_spread():
    """Smallest and largest inductance of a source coil."""
    henry = [nominal_coils()[f"coils.{name.lower()}_h"] for name in SOURCE]
    return (1 - INDUCTANCE_TOL) * min(henry), (1 + INDUCTANCE_TOL) * max(henry)


def loop(**overrides):
    """Phase margin over the tolerances of coil, cable and amplifier."""
    spread = {"lcoil": _source_spread(), "rcoil": (0.18, 1.0), "ccoil": ("100p", "1n"), "gbw": ("11meg", "23meg"),
              "fp2": ("25meg", "100meg"), "ro": (1, 15)}
    least = 180.0
    for corner in itertools.product(*spread.values()):
        least = min(least, spice.run("power_loop.cir", **_with(overrides, **dict(zip(spread, corner))))["phase_margin_deg"])
    nominal = spice.run("power_loop.cir", **overrides)
    unplugged = spice.run("power_loop.cir", **_with(overrides, lcoil=10))["phase_margin_deg"]
    shorted = spice.run("power_loop.cir", **_with(overrides, lcoil="1u", ccoil="1p"))["phase_margin_deg"]
    return {"loop.phase_margin_deg": nominal["phase_margin_deg"], "loop.phase_margin_least_deg": least,
            "loop.phase_margin_fault_deg": min(unplugged, shorted), "loop.crossover_hz": nominal["crossover_hz"]}


def slot(**overrides):
    """Turn-on at four phases of the carrier; smallest coil and fastest amplifier, largest coil and slowest amplifier."""
    hz = spice.value("power_stage.cir", "fc")
    guard = float(tdm()["guard_s"])
    vs = parameters("power_stage.cir", ["vs"], overrides)["vs"]
    worst = {"slot.unsettled": 0.0, "slot.settling_us": 0.0, "slot.peak_a": 0.0, "slot.beyond_supply_v": -99.0}
    for (lcoil, gbw), phase in itertools.product(zip(_source_spread(), ("23meg", "11meg")), range(4)):
        on = 0.2e-3 + phase / 4 / hz
        rows = spice.run_vectors("power_slot.cir", **_with(overrides, lcoil=lcoil, gbw=gbw, ton=on))
        amps, out = Wave(rows, 1), Wave(rows, 2)
        late = on + guard + 8 / hz
        worst["slot.unsettled"] = max(worst["slot.unsettled"], amps.unsettled(hz, on + guard, late))
        times = [1e-5 * k for k in range(1, 40)]
        settled = next((t for t in times if amps.unsettled(hz, on + t, late) <= 1e-4), 1.0)
        worst["slot.settling_us"] = max(worst["slot.settling_us"], 1e6 * settled)
        worst["slot.peak_a"] = max(worst["slot.peak_a"], *(abs(v) for v in amps.extremes()))
        worst["slot.beyond_supply_v"] = max(worst["slot.beyond_supply_v"], *(abs(v) - vs for v in out.extremes()))
    return worst


def drive(**overrides):
    """Available voltage and current for the highest TDM carrier and for the low band. Headroom: coil S1 at its largest inductance."""
    p = parameters("power_stage.cir", ["vs", "drop", "rset", "lcoil"], overrides)
    run = spice.run("power_drive.cir", **overrides)
    largest = spice.run("power_drive.cir", **{**overrides, "lcoil": (1 + INDUCTANCE_TOL) * p["lcoil"]})
    swing = 0.98 * p["vs"] - p["drop"]
    full = run["siemens_10769"] * FULL_DRIVE_V
    limit = 24e3 / (5e3 + p["rset"])
    result = {f"drive.ohm_{f}": run[f"ohm_{f}"] for f in (300, 1000, 7658, 9572, 10769, 13401)}
    result.update({"drive.full_a": full, "drive.swing_v": swing, "drive.headroom_v": swing - 1.03 * full * largest["ohm_10769"],
                   "drive.low_band_a": min(1.5, swing / run["ohm_1000"]), "drive.limit_a": limit,
                   "drive.limit_least_a": 0.9 * limit, "drive.limit_most_a": 1.1 * limit})
    for name in ("s2", "s3"):  # the loop gain is finite: a smaller inductance gives more current
        result[f"drive.full_{name}_a"] = FULL_DRIVE_V * _driven(name, **overrides)["siemens_10769"]
    return result


def _driven(name, share=1.0, **overrides):
    """power_drive.cir with source coil `name`, its inductance times `share`."""
    coil = nominal_coils()
    return spice.run("power_drive.cir", **_with(overrides, lcoil=share * coil[f"coils.{name}_h"], rcoil=coil[f"coils.{name}_ohm"]))


def fault(**overrides):
    """Fault: the output is at its supply until the enable drops."""
    vs = parameters("power_stage.cir", ["vs"], overrides)["vs"]
    run = spice.run("power_fault.cir", **overrides)
    return {"fault.current_a": run["fault_current_a"],
            "fault.beyond_supply_v": max(run["fault_output_v"], -run["fault_output_min_v"]) - vs,
            "fault.supplies_v": run["fault_supply_v"] - run["fault_supply_min_v"]}


def supplies(**overrides):
    """A converter that fails high; start of the supplies. The overrides apply to the netlist that has the parameter."""
    def only(file):
        return {name: value for name, value in overrides.items() if spice.has(file, name)}

    fails, start = (spice.run(file, **only(file)) for file in ("supply_fault.cir", "supply_start.cir"))
    return {"supplies.failed_v": fails["failed_supply_v"],
            "supplies.vdig_first_v": start["vdig_at_vplus_v"], "supplies.vdig_most_v": start["vdig_most_v"],
            "supplies.off_v": start["off_most_v"]}


def heat(**overrides):
    """Power dissipation of each stage and in total, and the hottest junction at an ambient temperature of 40 degrees."""
    p = parameters("power_stage.cir", ["vs", "iqoff", "rjh", "rhs"], overrides)
    off = 2 * p["vs"] * p["iqoff"]
    fdm = next(mode for mode in budget.modes() if mode["mode"] == "FDM 240")
    carriers = [float(fdm[f"f{k}_hz"]) for k in (1, 2, 3)]
    stages = [spice.run("power_heat.cir", **_with(overrides, fc=f, vdac=FULL_DRIVE_V * 0.65 * carriers[0] / f))["heat_w"]
              for f in carriers]
    whole = spice.run("power_heat.cir", **overrides)["heat_w"]
    turn = whole / 3 + off * 2 / 3
    result = {"heat.tdm_stage_w": turn, "heat.tdm_all_w": 3 * turn, "heat.fdm_all_w": sum(stages)}
    result.update({f"heat.fdm_s{k + 1}_w": stages[k] for k in range(3)})
    result["heat.junction_c"] = AMBIENT_C + max(max(stages) * p["rjh"] + sum(stages) * p["rhs"], turn * (p["rjh"] + 3 * p["rhs"]))
    return result


HIGH_SHARE = budget.HIGH_SHARE


def low_drive_v():
    """Low carrier at the DAC's pin in two bands."""
    with open(os.path.join(spice.CIRCUITS, "..", "..", "..", "drivers", "stm32g4", "carrier_player.cpp")) as file:
        return FULL_DRIVE_V * float(re.search(r"kLowShare = ([0-9.]+)F;", file.read())[1])


def two_bands(**overrides):
    """Coil S1 with a high and a low carrier at the same time."""
    p = parameters("power_stage.cir", ["rjh", "rhs"], overrides)
    hz = 7658.0
    rows = spice.run_vectors("power_two_bands.cir", **_with(overrides, fc=hz, vdac=FULL_DRIVE_V * 0.65 * HIGH_SHARE,
                                                            vlow=low_drive_v()))
    amps, out = Wave(rows, 1), Wave(rows, 2)
    period, start = 8 / hz, 1.4e-3
    late = [row[3] for row in rows if start <= row[0] < start + 3 * period]
    heat_w = sum(late) / len(late)
    return {"two_bands.high_a": abs(amps.carrier(hz, start, 24)), "two_bands.low_a": abs(amps.carrier(hz / 8, start, 3)),
            "two_bands.peak_a": max(abs(v) for v in amps.extremes()), "two_bands.output_v": max(abs(v) for v in out.extremes()),
            "two_bands.heat_w": heat_w, "two_bands.junction_c": AMBIENT_C + heat_w * (p["rjh"] + 3 * p["rhs"])}


def enable(**overrides):
    run = spice.run("enable.cir", **overrides)
    return {"enable.off_v": run["off_v"], "enable.on_v": run["on_v"],
            "enable.on_delay_us": 1e6 * (run["on_at"] - 20e-6), "enable.off_delay_us": 1e6 * (run["off_at"] - 60e-6),
            "heartbeat.trigger_v": run["trigger_v"], "heartbeat.stuck_v": run["stuck_high_v"],
            "heartbeat.undershoot_v": run["undershoot_v"],
            "flag.cool_v": run["cool_v"], "flag.hot_v": run["hot_v"], "flag.delay_ms": 1e3 * (run["hot_at"] - 1e-3)}


def _boxcar(hz):
    """Attenuation by adding consecutive conversions."""
    x = math.pi * hz / budget.CONVERSIONS_HZ
    return abs(math.sin(CONVERSION_TAPS * x) / (CONVERSION_TAPS * math.sin(x)))


def preamplifier(**overrides):
    run = spice.run("preamplifier.cir", **overrides)
    carriers = (7658, 9572, 10769, 13401)
    gains = [run[f"gain_{f}"] for f in carriers]
    result = {f"preamplifier.gain_{f}": run[f"gain_{f}"] for f in (500, *carriers)}
    result.update({f"preamplifier.noise_{f}": run[f"noise_{f}"] for f in (500, *carriers)})
    coil = nominal_coils()
    inner = spice.run("preamplifier.cir", **_with(overrides, lcoil=coil["coils.c1_h"], rcoil=coil["coils.c1_ohm"]))
    result["preamplifier.noise_inner_10769"] = inner["noise_10769"]
    result["preamplifier.flatness"] = max(gains) / min(gains) - 1
    passed = run["gain_10769"]
    result["preamplifier.reject_conversions_db"] = 20 * math.log10(passed / run["gain_560900"])
    images = max(run["gain_58400"] * _boxcar(58400), run["gain_61000"] * _boxcar(61000))
    result["preamplifier.reject_samples_db"] = 20 * math.log10(passed * _boxcar(10769) / images)
    switching = max(run[f"gain_{f}"] * _boxcar(f) for f in (288000, 320000, 352000))
    result["preamplifier.reject_supply_db"] = 20 * math.log10(passed * _boxcar(10769) / switching)
    result["preamplifier.driver_siemens"] = run["driver_10769"]
    rows = spice.run_vectors("preamplifier.cir", **overrides)
    wave, hz = Wave(rows, 1), spice.value("preamplifier.cir", "fc")
    times = [1e-5 * k for k in range(1, 40)]
    settled = next((t for t in times if wave.unsettled(hz, 20e-6 + t, 0.65e-3) <= 1e-4), 1.0)
    result["preamplifier.settling_us"] = 1e6 * settled
    return result


def reference(**overrides):
    """Reference amplifier. The overrides apply to its netlist only."""
    run = spice.run("reference.cir", **overrides)
    sensor = spice.run("preamplifier.cir")
    sense = _driven("s2")["siemens_10769"] * FULL_DRIVE_V * spice.value("power_stage.cir", "rs")
    lag = max(abs(run[f"phase_{f}"] - sensor[f"phase_{f}"]) for f in (7658, 9572, 10769, 13401))
    return {"reference.gain": run["gain_10769"], "reference.full_drive_v": run["gain_10769"] * sense,
            "reference.phase_match_deg": lag, "reference.noise": run["noise_10769"], "reference.avdd_v": run["avdd_10769"] * sense}


def fit(**overrides):
    """Whether the windings of coils.toml fit, their areas, and the wire to buy."""
    triads = Triads(**overrides)
    result = {f"coils.{coil.name.lower()}_m2": coil.area_m2 for coil in triads.coils}
    source, sensor = ([coil.area_m2 for coil in triad] for triad in (triads.source, triads.sensor))
    result.update({"coils.sensor_m2": math.fsum(sensor) / 3, "coils.source_spread": max(source) / min(source) - 1,
                   "coils.sensor_spread": max(sensor) / min(sensor) - 1, "coils.ring_gap_mm": min(triads.ring_gaps()),
                   "coils.window_spare_mm": triads.window_spare(), "coils.groove_spare_mm": triads.groove_spare(),
                   "coils.litz_m": triads.wire_m("litz"), "coils.enamel_m": triads.wire_m("enamel")})
    return result


ACCEPTANCE_HZ = 10e3


def _electrical(coil):
    henry, name = inductance.of_coil(coil), f"coils.{coil.name.lower()}"
    loss = inductance.loss_factor(coil, ACCEPTANCE_HZ)
    return {f"{name}_h": henry, f"{name}_ohm": coil.ohm, f"{name}_q": 2 * math.pi * ACCEPTANCE_HZ * henry / (loss * coil.ohm),
            f"{name}_resonance_hz": inductance.resonance_hz(coil, henry), f"{name}_wheeler_h": inductance.by_wheeler(coil)}


# parameters of the netlists that are results of the geometry; S1 has the largest inductance, C2 is the middle one
OF_COILS = {("power_stage.cir", "lcoil"): "coils.s1_h", ("power_stage.cir", "rcoil"): "coils.s1_ohm",
            ("preamplifier.cir", "lcoil"): "coils.c2_h", ("preamplifier.cir", "rcoil"): "coils.c2_ohm"}


def coils(**overrides):
    """Inductance, resistance at 20 degrees, Q and own resonance of each coil; coupling of two rings at the tolerance of their angle: that
    of coaxial rings times the sine of the deviation (exact for the dipole part of the field)."""
    triads = Triads(**overrides)
    result = {}
    for coil in triads.coils:
        result.update(_electrical(coil))
    tilt = math.sin(math.radians(triads.data["source"]["tilt_deg"]))
    result["coils.coupling_tilted"] = max(
        tilt * inductance.between(a, b) / math.sqrt(result[f"coils.{a.name.lower()}_h"] * result[f"coils.{b.name.lower()}_h"])
        for a, b in itertools.combinations(triads.source, 2))
    wheeler = [result[f"coils.{name.lower()}_wheeler_h"] / result[f"coils.{name.lower()}_h"] for name in SOURCE + SENSOR]
    result["coils.formulas_differ"] = max(abs(ratio - 1) for ratio in wheeler)
    result["coils.netlist_error"] = max(abs(spice.value(*place) / result[name] - 1) for place, name in OF_COILS.items())
    result["coils.sensor_ohm"] = result["coils.c2_ohm"]
    return result


@functools.cache
def nominal_coils():
    return coils()


def write_netlists():
    """Puts the results of the geometry into the netlists."""
    for (file, name), result in OF_COILS.items():
        spice.put(file, name, nominal_coils()[result])


# Largest deviations of the drive: supply of the DAC (regulator of the Nucleo), gain of the DAC, sense resistor, divider and low-pass at the
# input. All at once.
DRIVE_TOLS = {"avdd": 0.02, "dac": 0.005, "sense": 0.01, "divider": 0.0014, "low-pass": 0.002}


def exposure(**overrides):
    """RMS field at 10 and 30 cm from the middle of the source; FDM: sum over the coils (sum rule). overrides: of coils.toml. Worst: all
    tolerances of the drive, the least inductance, and each coil larger by the tolerance of its radius."""
    triads = Triads(**overrides)
    fdm = next(mode for mode in budget.modes() if mode["mode"] == "FDM 240")
    carriers = [float(fdm[f"f{k}_hz"]) for k in (1, 2, 3)]
    largest = math.prod(1 + tol for tol in DRIVE_TOLS.values())
    result = {}
    for kind, more, drive, henry in (("", 0.0, 1.0, 1.0), ("_worst", 1e-3 * triads.data["source"]["radius_tol"], largest, 1 - INDUCTANCE_TOL)):
        driven = [_driven(name.lower(), henry) for name in SOURCE]
        tdm_a = [FULL_DRIVE_V * run["siemens_10769"] for run in driven]
        fdm_a = [FULL_DRIVE_V * 0.65 * carriers[0] / hz * run[f"siemens_{hz:.0f}"] for run, hz in zip(driven, carriers)]
        low_a = [low_drive_v() * run["siemens_960"] for run in driven]
        each, shared, low = ([(coil.turns, coil.radius_m + more, drive * amps) for coil, amps in zip(triads.source, currents)]
                             for currents in (tdm_a, fdm_a, low_a))
        for cm in (10, 30):
            result[f"field.tdm_{cm}cm{kind}_ut"] = 1e6 / math.sqrt(2) * field.largest(cm / 100, each, False)
            result[f"field.fdm_{cm}cm{kind}_ut"] = 1e6 / math.sqrt(2) * field.largest(cm / 100, shared, True)
        low_ut = 1e6 / math.sqrt(2) * field.largest(0.1, low, True)
        result[f"field.fdm_level{kind}_m"] = field.reached_m(27e-6 * math.sqrt(2), shared)
        # ICNIRP 2010, 1 kHz: 80 uT
        result[f"field.two_bands_10cm{kind}_share"] = HIGH_SHARE * result[f"field.fdm_10cm{kind}_ut"] / 27 + low_ut / 80
    return result


def crosstalk(results, **overrides):
    """The overrides apply to the reference amplifier."""
    return accuracy({**results, **reference(**overrides)})


def accuracy(results, **overrides):
    """Position errors of the chain. results: of the functions above; overrides: of the preamplifier's netlist."""
    coil = parameters("preamplifier.cir", ("lcoil", "rcoil", "ccable", "rdamp"), overrides)
    if overrides:
        results = {**results, **preamplifier(**overrides)}
    chain = budget.Chain(results, results["coils.s2_m2"] * results["drive.full_s2_a"], results["coils.sensor_m2"])
    window = float(tdm()["window_s"])
    result = {"budget.moment_am2": chain.moment, "budget.nearest_m": chain.nearest_m(10769),
              "preamplifier.driver_a": results["preamplifier.driver_siemens"] * chain.coil_v(0.15, 10769)}  # before the drive is reduced
    for cm in (15, 30, 60, 75, 90, 120):
        drive_share, gain, volts = chain.ranging(cm / 100, 10769)
        causes = budget.of_frame(chain, cm / 100, tdm(), coil)
        result.update({f"range.field_{cm}_t": chain.field_t(cm / 100), f"range.coil_{cm}_v": chain.coil_v(cm / 100, 10769),
                       f"range.drive_{cm}": drive_share, f"range.gain_{cm}": gain, f"range.converter_{cm}_v": volts,
                       f"range.snr_{cm}_db": chain.snr_db(cm / 100, 10769, window),
                       f"budget.noise_{cm}_mm": math.hypot(*(row[1] for row in causes[:budget.NOISES])),
                       f"budget.total_{cm}_mm": budget.total(causes, 1), f"budget.plain_{cm}_mm": budget.total(causes, 2)})
        if cm == 75:
            result["budget.pick_up_75_percent"] = 100 * chain.pick_up(0.75, 10769)
            for name, corrected, plain in causes:
                result[f"cause.{name}"], result[f"plain.{name}"] = corrected, plain
    for gain in (1, 2, 4, 8, 16, 32, 64):
        for name, density in zip(("preamplifier", "opamp", "converter"), chain.densities(10769, gain)):
            result[f"density.{name}_{gain}"] = density
    for mode in budget.modes():
        load = budget.load_of(mode)
        for cm in (30, 60, 120):
            result[f"snr.{mode['mode']}_{cm}_db"] = chain.snr_db(cm / 100, *load)
            if mode["multiplexing"] == "dual-band":
                result[f"snr.low band 240_{cm}_db"] = chain.low_snr_db(cm / 100, mode)
    return result
