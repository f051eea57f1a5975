"""tricoil design: what planned coils reach. Dipoles, the demodulator's windows, and the covariance of the direct solution."""

import math
import os

import numpy as np

from . import _coil, _tricoil
from ._model import couplings, solve
from ._output_file import write_all
from ._picture import check_picture, picture
from ._poses import refuse_others

LIMITS = {"turns": (1, 10_000), "radius": (1e-4, 10), "current": (1e-6, 1e4), "noise": (1e-12, 1e-3), "sensor_turns": (1, 10_000),
          "sensor_radius": (1e-4, 10), "wire": (1e-6, 0.1), "sensor_wire": (1e-6, 0.1), "carrier_hz": (1, 1e7), "rate_hz": (1, 1e5), "ranges": (1e-3, 1e3)}
REQUIRED = ("turns", "radius", "current", "noise")
RANGES_M = tuple(round(0.2 + 0.1 * n, 1) for n in range(11))
MULTIPLEXINGS = ("tdm", "fdm")


def _winding(turns, radius_m, wire_m):
    """Resistance, inductance; None without a wire."""
    if wire_m is None:
        return {"resistance_ohm": None, "inductance_h": None}
    return {"resistance_ohm": _coil.resistance_ohm(turns, radius_m, wire_m), "inductance_h": _coil.inductance_h(turns, radius_m, wire_m)}


def _number(name, value):
    """A number within its limits, turns as a whole number."""
    try:
        number = float(value)
    except (TypeError, ValueError):
        number = math.nan
    least, most = LIMITS[name]
    is_whole = name.endswith("turns")
    if not least <= number <= most or (is_whole and number != int(number)):
        raise ValueError(f"--{name.replace('_', '-')}: must be a {'whole ' if is_whole else ''}number from {least:g} to {most:g}; is {value}")
    return int(number) if is_whole else number


def _ranges(value):
    values = RANGES_M if value is None else value.split(",") if isinstance(value, str) else value
    return [_number("ranges", one) for one in np.atleast_1d(values).tolist()]


def design(turns, radius, current, noise, *, sensor_turns=None, sensor_radius=None, wire=None, sensor_wire=None, carrier_hz=None, mux="fdm",
           rate_hz=240.0, ranges=None) -> dict:
    """Signal to noise and expected errors of one frame over range, without filter; the options of `tricoil design`.

    Lengths m, current A (amplitude in each source coil at carrier_hz; with fdm the others inversely proportional to their frequency), noise V per
    root Hz. With m = N I A, the field on the axis is B = mu0 m / (2 pi r^3), and the voltage of a sensor coil w N A B = C / r^3. The lock-in over a
    window T has noise / sqrt(T). Errors: covariance of the closed form, equation (14) of the paper; RMS of the length of the position error and of
    the angle; the demodulator's removal of hum adds 2 % to both with fdm and 6 % with tdm at 240 frames/s. field_off_dipole: by which share the field of a source coil on its axis is below that of a dipole, 1 - (1 + (a / r)^2)^(-3/2).
    """
    if mux not in MULTIPLEXINGS:
        raise ValueError(f"--mux: must be tdm or fdm; is '{mux}'")
    sensor_turns = turns if sensor_turns is None else sensor_turns
    sensor_radius = radius if sensor_radius is None else sensor_radius
    window_s, carriers_hz = _tricoil.acquisition(mux, rate_hz)
    carrier_hz = carriers_hz[1 if mux == "fdm" else 0] if carrier_hz is None else carrier_hz
    moment = turns * current * math.pi * radius**2
    source = {"turns": turns, "radius_m": radius, "current_a": current, "moment_a_m2": moment, **_winding(turns, radius, wire)}
    sensor = {"turns": sensor_turns, "radius_m": sensor_radius, **_winding(sensor_turns, sensor_radius, sensor_wire)}
    w = 2 * math.pi * carrier_hz
    inductance, resistance = source["inductance_h"], source["resistance_ohm"]
    source["voltage_v"] = None if inductance is None else current * math.hypot(resistance, w * inductance)
    source["power_w"] = None if inductance is None else current**2 * resistance / 2
    source["resonance_f"] = None if inductance is None else 1 / (w**2 * inductance)
    coil_noise = 0.0 if sensor["resistance_ohm"] is None else _coil.thermal_noise(sensor["resistance_ohm"])
    density = math.hypot(noise, coil_noise)
    sigma_v = density / math.sqrt(window_s)
    constant = w * sensor_turns * math.pi * sensor_radius**2 * _coil.MU_0 * moment / (2 * math.pi)
    unit = np.diag(solve(couplings((1, 0, 0), coupling_constant=1.0), 1.0, coupling_constant=1.0)["covariance"])  # at 1 m, for sigma = k
    position, rotation = math.sqrt(unit[:3].sum()), math.sqrt(unit[3:].sum())

    def range_of(error_m):  # it grows with the fourth power of the range
        return (error_m * constant / (sigma_v * position)) ** 0.25

    rows = []
    for range_m in _ranges(ranges):
        strength = constant / range_m**3
        share = sigma_v / strength
        rows.append({"range_m": range_m, "field_t": _coil.MU_0 * moment / (2 * math.pi * range_m**3), "voltage_v": strength,
                     "snr_db": 20 * math.log10(strength / sigma_v), "position_rms_m": position * range_m * share, "orientation_rms_rad": rotation * share,
                     "field_off_dipole": 1 - (1 + (radius / range_m) ** 2) ** -1.5})
    return {"mux": mux, "rate_hz": rate_hz, "carrier_hz": carrier_hz, "window_s": window_s, "source": source, "sensor": sensor,
            "noise_v_per_sqrt_hz": density, "sensor_coil_noise_v_per_sqrt_hz": coil_noise, "sigma_v": sigma_v, "coupling_constant_v_m3": constant,
            "farthest_m": min((constant / (sigma_v * _tricoil.MIN_SNR)) ** (1 / 3), range_of(_tricoil.MAX_DEVIATION_M)), "range_of_1_mm_m": range_of(1e-3),
            "ranges": rows}


def _length(metres):
    return f"{1e3 * metres:.3g} mm"


def _winding_text(coil):
    return "" if coil["inductance_h"] is None else f", {coil['resistance_ohm']:.3g} ohm, {1e6 * coil['inductance_h']:.4g} uH"


def text(result: dict) -> str:
    """The result as the program prints it."""
    source, sensor = result["source"], result["sensor"]
    lines = [f"source coils: {source['turns']} turns, radius {_length(source['radius_m'])}, {source['current_a']:g} A: moment "
             f"{source['moment_a_m2']:.4g} A m^2{_winding_text(source)}"]
    if source["inductance_h"] is not None:
        lines.append(f"  at {result['carrier_hz']:.6g} Hz: {source['voltage_v']:.3g} V, {source['power_w']:.3g} W a coil; "
                     f"{1e9 * source['resonance_f']:.4g} nF in series resonate")
    lines.append(f"sensor coils: {sensor['turns']} turns, radius {_length(sensor['radius_m'])}{_winding_text(sensor)}")
    with_coil = " with the coil's own" if result["sensor_coil_noise_v_per_sqrt_hz"] else ""
    lines.append(f"noise: {1e9 * result['noise_v_per_sqrt_hz']:.3g} nV per root Hz{with_coil}; {1e9 * result['sigma_v']:.3g} nV in a window of "
                 f"{1e3 * result['window_s']:.3g} ms ({result['mux']}, {result['rate_hz']:g} frames/s)")
    lines.append(f"{'range, m':>10}{'field, uT':>12}{'signal, uV':>13}{'signal to noise, dB':>21}{'position, mm':>14}{'angle, deg':>12}{'off dipole, %':>15}")
    lines += [f"{row['range_m']:>10g}{1e6 * row['field_t']:>12.4g}{1e6 * row['voltage_v']:>13.4g}{row['snr_db']:>21.1f}{1e3 * row['position_rms_m']:>14.3g}"
              f"{math.degrees(row['orientation_rms_rad']):>12.3g}{100 * row['field_off_dipole']:>15.2g}" for row in result["ranges"]]
    lines.append(f"errors are RMS of one frame, without filter: 1 mm at {result['range_of_1_mm_m']:.3g} m; no valid pose beyond {result['farthest_m']:.3g} m")
    return "\n".join(lines) + "\n"


def _volts_per_coupling(mux, rate_hz):
    """Sensor voltage of the simulation (sim/world/coil_world.hpp). Couplings are those at 10 kHz; with tdm the reference is 1 V at any frequency, with fdm
    0.5 V at 10 kHz and inversely proportional to it."""
    return 0.5 if mux == "fdm" else _tricoil.acquisition(mux, rate_hz)[1][0] / 10e3


def scenario_text(result: dict) -> str:
    """A world with these coils for `tricoil run --scenario`; converter and mains are ideal, a sensor rests at the first range."""
    source, mux = result["source"], result["mux"]
    constant = result["coupling_constant_v_m3"] / _volts_per_coupling(mux, result["rate_hz"])
    lines = [f'description = "coils of tricoil design: {source["turns"]} turns, {source["current_a"]:g} A, --mux {mux}"', "duration_s = 10", "",
             "[motion]", 'kind = "still"', f"position_m = [{result['ranges'][0]['range_m']:g}, 0, 0]", "euler_deg = [20, -10, 35]", "", "[world]",
             f"coupling_constant_m3 = {constant:.9g}  # of the simulated reference",
             f"noise_v_per_sqrt_hz = {result['noise_v_per_sqrt_hz']:.9g}", "mains_v = 0", "converter_bits = 31"]
    if source["inductance_h"] is not None:
        lines += [f"coil_resistance_ohm = {source['resistance_ohm']:.6g}", f"coil_inductance_h = {source['inductance_h']:.6g}"]
    return "\n".join(lines) + "\n"


def _refuse_filled(table, empty):
    """The user adds measured couplings to `table`: only an empty one may be replaced. Raises ValueError."""
    if os.path.isfile(table):
        with open(table, "rb") as file:
            if file.read().split(b"\n", 1)[0].strip() != empty.encode().split(b"\n", 1)[0]:
                raise ValueError(f"--grid-pdf: {table} has other columns than an empty table of nodes; choose another name or move it")


def _grid(grid_pdf, spacing_mm):
    """Writes the page and the table of its nodes. Result and text."""
    from . import _grid_page

    page = _grid_page.layout(spacing_mm)
    check_picture(grid_pdf, "--grid-pdf", (".pdf",))
    table = os.path.splitext(grid_pdf)[0] + ".csv"
    _refuse_filled(table, _grid_page.table(page))
    write_all({grid_pdf: picture(grid_pdf, _grid_page.draw(page)), table: _grid_page.table(page)})
    result = _grid_page.result(page, grid_pdf, table)
    return result, _grid_page.text(result)


def run(plot=None, scenario=None, grid_pdf=None, spacing_mm=None, **options) -> tuple[dict, str]:
    """Result and text of tricoil design. Raises ValueError, OSError."""
    if spacing_mm is not None and grid_pdf is None:
        raise ValueError("--spacing-mm requires --grid-pdf")
    if grid_pdf is not None:
        if options or plot is not None or scenario is not None:
            raise ValueError("--grid-pdf: only with --spacing-mm")
        return _grid(grid_pdf, spacing_mm)
    refuse_others(options, LIMITS.keys() | {"mux"}, "unknown option of design")
    for name in LIMITS.keys() - {"ranges"}:
        if options.get(name) is not None:
            options[name] = _number(name, options[name])
    missing = [f"--{name}" for name in REQUIRED if options.get(name) is None]
    if missing:
        raise ValueError(f"design needs {', '.join(missing)}, or --grid-pdf")
    check_picture(plot)
    if scenario is not None and not scenario.endswith(".toml"):
        raise ValueError(f"--scenario must end in .toml; is '{scenario}'")
    found = design(**options)
    contents = {}
    if scenario is not None:
        contents[scenario] = scenario_text(found)
    if plot is not None:
        from . import plot as drawing

        contents[plot] = picture(plot, drawing.design(found))
    write_all(contents)
    return found, text(found)
