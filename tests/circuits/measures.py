"""Runs of the netlists over tolerances and phases, reduced to results. Each function takes overrides of parameters."""
import itertools
import math

import budget
import field
import spice
from waves import Wave

AMBIENT_C = 40
FULL_DRIVE_V = 1.44  # carrier at the DAC's pin: 1792 of 2048 codes (drivers/stm32g4/acquisition.hpp)
CONVERSION_TAPS = 8  # conversions per sample


def parameters(file, names, overrides):
    return {name: spice.number(str(overrides[name])) if name in overrides else spice.value(file, name) for name in names}


def _with(overrides, **more):
    return {**more, **overrides}  # `overrides` of the caller have priority


def tdm():
    return next(mode for mode in budget.modes() if mode["mode"] == "TDM 240")


def loop(**overrides):
    """Phase margin over the tolerances of coil, cable and amplifier."""
    spread = {"lcoil": ("83u", "110u"), "rcoil": (0.24, 1.0), "ccoil": ("100p", "1n"), "gbw": ("11meg", "23meg"),
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
    for (lcoil, gbw), phase in itertools.product((("83u", "23meg"), ("110u", "11meg")), range(4)):
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
    """Available voltage and current for the highest TDM carrier and for the low band."""
    p = parameters("power_stage.cir", ["vs", "drop", "rset"], overrides)
    run = spice.run("power_drive.cir", **overrides)
    swing = 0.98 * p["vs"] - p["drop"]
    full = run["siemens_10769"] * FULL_DRIVE_V
    limit = 24e3 / (5e3 + p["rset"])
    result = {f"drive.ohm_{f}": run[f"ohm_{f}"] for f in (300, 1000, 7658, 9572, 10769, 13401)}
    result.update({"drive.full_a": full, "drive.swing_v": swing, "drive.headroom_v": swing - 1.03 * full * run["ohm_10769"],
                   "drive.low_band_a": min(1.5, swing / run["ohm_1000"]), "drive.limit_a": limit,
                   "drive.limit_least_a": 0.9 * limit, "drive.limit_most_a": 1.1 * limit})
    return result


def fault(**overrides):
    """Fault: the output is at its supply until the enable drops."""
    vs = parameters("power_stage.cir", ["vs"], overrides)["vs"]
    run = spice.run("power_fault.cir", **overrides)
    return {"fault.current_a": run["fault_current_a"],
            "fault.beyond_supply_v": max(run["fault_output_v"], -run["fault_output_min_v"]) - vs,
            "fault.supplies_v": run["fault_supply_v"] - run["fault_supply_min_v"]}


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


HIGH_SHARE, LOW_A = budget.HIGH_SHARE, 0.35  # two bands: low carriers, A


def two_bands(**overrides):
    """Coil S1 with a high and a low carrier at the same time."""
    p = parameters("power_stage.cir", ["rjh", "rhs"], overrides)
    gain = spice.run("power_drive.cir")
    hz = 7658.0
    rows = spice.run_vectors("power_two_bands.cir", **_with(overrides, fc=hz, vdac=FULL_DRIVE_V * 0.65 * HIGH_SHARE,
                                                            vlow=LOW_A / gain["siemens_960"]))
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
            "heartbeat.undershoot_v": run["undershoot_v"]}


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
    inner = spice.run("preamplifier.cir", **_with(overrides, lcoil="4.4m", rcoil=37.9))  # 540 turns at 8.6 mm
    result["preamplifier.noise_inner_10769"] = inner["noise_10769"]
    result["preamplifier.flatness"] = max(gains) / min(gains) - 1
    passed = run["gain_10769"]
    result["preamplifier.reject_conversions_db"] = 20 * math.log10(passed / run["gain_560900"])
    images = max(run["gain_58400"] * _boxcar(58400), run["gain_61000"] * _boxcar(61000))
    result["preamplifier.reject_samples_db"] = 20 * math.log10(passed * _boxcar(10769) / images)
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
    sense = spice.run("power_drive.cir")["siemens_10769"] * FULL_DRIVE_V * spice.value("power_stage.cir", "rs")
    lag = max(abs(run[f"phase_{f}"] - sensor[f"phase_{f}"]) for f in (7658, 9572, 10769, 13401))
    return {"reference.gain": run["gain_10769"], "reference.full_drive_v": run["gain_10769"] * sense,
            "reference.phase_match_deg": lag, "reference.noise": run["noise_10769"]}


def coils(**overrides):
    """Inductances by Wheeler 1928 for multilayer coils, SI units, and the deviation of the netlists' values."""
    p = parameters("power_stage.cir", ["n1", "n2", "n3", "a1", "a2", "a3", "length", "depth", "copper", "lcoil", "rcoil"], overrides)
    q = parameters("preamplifier.cir", ["turns", "radius", "length", "depth", "copper", "lcoil", "rcoil"], {})

    def wound(turns, radius, length, depth, copper):
        henry = 31.6e-6 * (turns * radius) ** 2 / (6 * radius + 9 * length + 10 * depth)
        return henry, 1.72e-8 * turns * 2 * math.pi * radius / copper

    result, worst = {}, 0.0
    for k in (1, 2, 3):
        henry, ohm = wound(p[f"n{k}"], p[f"a{k}"], p["length"], p["depth"], p["copper"])
        result.update({f"coils.s{k}_h": henry, f"coils.s{k}_ohm": ohm, f"coils.s{k}_m2": p[f"n{k}"] * math.pi * p[f"a{k}"] ** 2})
    worst = max(abs(p["lcoil"] / result["coils.s1_h"] - 1), abs(p["rcoil"] / result["coils.s1_ohm"] - 1))
    henry, ohm = wound(q["turns"], q["radius"], q["length"], q["depth"], q["copper"])
    result.update({"coils.sensor_h": henry, "coils.sensor_ohm": ohm, "coils.sensor_m2": q["turns"] * math.pi * q["radius"] ** 2})
    result["coils.netlist_error"] = max(worst, abs(q["lcoil"] / henry - 1), abs(q["rcoil"] / ohm - 1))
    return result


def exposure(**overrides):
    """RMS field at 10 and 30 cm from the middle of the source; FDM: sum over the coils (sum rule)."""
    p = parameters("power_stage.cir", ["n1", "n2", "n3", "a1", "a2", "a3"], overrides)
    full = spice.run("power_drive.cir")["siemens_10769"] * FULL_DRIVE_V
    fdm = next(mode for mode in budget.modes() if mode["mode"] == "FDM 240")
    share = [0.65 * float(fdm["f1_hz"]) / float(fdm[f"f{k}_hz"]) for k in (1, 2, 3)]
    each = [(p[f"n{k}"], p[f"a{k}"], full) for k in (1, 2, 3)]
    shared = [(n, a, i * s) for (n, a, i), s in zip(each, share)]
    result = {}
    for cm in (10, 30):
        result[f"field.tdm_{cm}cm_ut"] = 1e6 / math.sqrt(2) * field.largest(cm / 100, each, False)
        result[f"field.fdm_{cm}cm_ut"] = 1e6 / math.sqrt(2) * field.largest(cm / 100, shared, True)
    low = [(n, a, LOW_A) for n, a, _ in each]
    low_ut = 1e6 / math.sqrt(2) * field.largest(0.1, low, True)
    result["field.two_bands_10cm_share"] = HIGH_SHARE * result["field.fdm_10cm_ut"] / 27 + low_ut / 80  # ICNIRP 2010, 1 kHz: 80 uT
    return result


def accuracy(results, **overrides):
    """Position errors of the chain. results: of the functions above; overrides: of the preamplifier's netlist."""
    names = ("turns", "radius", "lcoil", "rcoil", "ccable", "rdamp")
    coil = parameters("preamplifier.cir", names, overrides)
    if overrides:
        results = {**results, **preamplifier(**overrides)}
    chain = budget.Chain(results, coil, results["coils.s2_m2"] * results["drive.full_a"])
    window = float(tdm()["window_s"])
    result = {"budget.moment_am2": chain.moment, "budget.nearest_m": chain.nearest_m(10769)}
    for cm in (15, 30, 60, 75, 90, 120):
        drive_share, gain, volts = chain.ranging(cm / 100, 10769)
        causes = budget.of_frame(chain, cm / 100, tdm(), coil)
        result.update({f"range.field_{cm}_t": chain.field_t(cm / 100), f"range.coil_{cm}_v": chain.coil_v(cm / 100, 10769),
                       f"range.drive_{cm}": drive_share, f"range.gain_{cm}": gain, f"range.converter_{cm}_v": volts,
                       f"range.snr_{cm}_db": chain.snr_db(cm / 100, 10769, window),
                       f"budget.noise_{cm}_mm": math.hypot(*(row[1] for row in causes[:budget.NOISES])),
                       f"budget.total_{cm}_mm": budget.total(causes, 1), f"budget.plain_{cm}_mm": budget.total(causes, 2)})
        if cm == 75:
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
