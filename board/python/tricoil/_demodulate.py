"""`tricoil demodulate`: couplings from a capture, result, text and table."""

import contextlib
import os

import numpy as np

from ._byte_stream import ByteStream
from ._capture import ArrayCapture, codes_of, open_capture
from ._capture_analysis import Analyser
from ._number_text import number_text
from ._output_file import OutputFile, refuse_input_as_output
from ._poses import refuse_others
from ._wiring import OF_COILS_COMMENT, Wiring, wiring_of

COLUMNS = ["time_us", "sigma", *(f"{kind}{i}{j}" for kind in "xq" for i in "123" for j in "123")]
OPTIONS = ("carrier_hz", "rate_hz", "bits", "guard", "block", "columns", "reference", "wiring", "induced", "out", "follow")


def _list(value, kind):
    if value is None:
        return []
    values = value.split(",") if isinstance(value, str) else np.atleast_1d(value).tolist()
    return [kind(one) for one in values]


def _count(name, value):
    try:
        number = int(value or 0)
    except (TypeError, ValueError):
        number = -1
    if number < 0 or number != float(value or 0):
        raise ValueError(f"--{name}: {value} is not a whole number, 0 or more")
    return number


def _csv(rows):
    lines = []
    for row in rows:
        numbers = ",".join(f"{value:.10g}" for value in (*row["x"].flat, *row["quadrature"].flat))
        lines.append(f"{1e6 * row['time_s']:.0f},{row['sigma']:.6g},{numbers}\n")
    return "".join(lines)


def _analysed(capture, carrier_hz, rate_hz=None, guard=0, block=0, reference=None, wiring=None, induced=False, out=None, keeps_rows=False):
    """Result and rows, if they are kept: a stream may be endless."""
    rows = []
    with OutputFile(os.fspath(out)) if out is not None else contextlib.nullcontext() as file:
        if file:
            file.write(("" if wiring is None else OF_COILS_COMMENT + "\n") + ",".join(COLUMNS) + "\n")
        analyser = Analyser(capture, _list(carrier_hz, float), float(rate_hz or 0), guard, block, reference, wiring_of(wiring), bool(induced))
        for some in analyser.rows():
            if keeps_rows:
                rows.append(some)
            if file:
                file.write(_csv(some), flush=capture.follows)
        if file:
            file.commit()
    return analyser.result(), rows


def run(capture, bits=16, columns=None, follow=False, guard=0, block=0, keeps_rows=False, **options):
    """Result, as `--json` prints it, and the rows, if they are kept. capture: name of a file, "-": standard input, or an array. Raises ValueError; OSError if a
    disk fails."""
    refuse_others(options, OPTIONS, "unknown option of demodulate")
    options["reference"] = None if options.get("reference") is None else str(options["reference"])
    options |= {"guard": _count("guard", guard), "block": _count("block", block), "keeps_rows": keeps_rows}
    refuse_input_as_output({"--out": options.get("out")}, [capture, options.get("wiring")])
    chosen = {"bits": _count("bits", bits), "columns": _list(columns, str)}
    if not isinstance(capture, (str, os.PathLike)):
        return _analysed(ArrayCapture(capture, **chosen), **options)
    codes_of(chosen["bits"])
    with ByteStream(os.fspath(capture), bool(follow)) as stream:
        return _analysed(open_capture(stream, follows=bool(follow), **chosen), **options)


def demodulate(capture, carrier_hz, *, rate_hz: float | None = None, bits: int = 16, guard: int = 0, block: int | None = None, columns=None,
               reference: str | int | None = None, wiring: Wiring | str | os.PathLike | None = None, induced: bool = False,
               out: str | os.PathLike | None = None) -> dict:
    """Couplings from raw samples of three sensor coils, and optionally of the reference current.

    capture: name of a WAV file or a table, as `tricoil demodulate` reads them, or an array: (N, channels) of coils that are driven at the same
    time, (repeats, 3, samples, channels) of coils that are driven in turn; three or four channels; whole numbers are codes of a converter with
    `bits` bits, with or without sign, others volts. carrier_hz: one frequency of coils in turn, three of coils at the same time; estimated within
    1 %. rate_hz: samples per second and channel; None: of the WAV file. guard: samples to discard at the start of each block. block: samples of a
    block of coils at the same time; None: four periods of the smallest difference of frequencies. columns: channels by name or number from 1.
    reference: channel of the reference current by name or number, "none", or None: found. wiring: of the channels, see read_wiring(). induced: the sensors are coils,
    whose voltages grow with the carrier: couplings at three carriers are divided by the carrier over the mean of the carriers. out: file for the
    couplings of each repeat (CSV).

    Returns the dictionary that `tricoil demodulate --json` prints, with "rows", a structured array (repeats,) of time_s (s, middle, from the first
    sample), x and quadrature (3, 3; sensor channel i, source coil j; share of the reference, or volts or codes without one) and sigma (standard
    deviation of an entry). Tones are fitted by least squares (IEEE Std 1057, clause 5). Raises ValueError with the reason, such as no carrier, a
    carrier that aliases, clipped blocks or damaged files; OSError if a file cannot be read to its end or written.
    """
    from ._command import own_names

    try:
        result, rows = run(capture, keeps_rows=True, bits=bits, columns=columns, guard=guard, block=block, carrier_hz=carrier_hz, rate_hz=rate_hz,
                           reference=reference, wiring=wiring, induced=induced, out=out)
    except ValueError as error:
        raise ValueError(own_names(str(error))) from None
    result["rows"] = np.concatenate(rows)
    return result


# Output


def _number(value: float, form: str) -> str:
    return number_text(value, form).strip()


def _percent(misfit_share):
    """Of the amplitude, as the calibrations print it."""
    return _number(100 * np.sqrt(misfit_share), ".1f") + " %"


def text(r: dict) -> str:
    """The result as lines."""
    lines = [f"carrier {hz:.3f} Hz, {ppm:+.0f} ppm from the given one" for hz, ppm in zip(r["carrier_hz"], r["carrier_offset_ppm"])]
    has_reference = r["reference_channel"] is not None
    current = f"reference current on {r['channels'][r['reference_channel']]} (amplitude {r['reference_amplitude']:.4g})" if has_reference else \
        "no reference: each source coil may be reversed (tricoil calibrate wiring)"
    lines.append(f"{current}; {r['repeats']} repeats")
    lines.append("signal matrix (rows: sensor channels; columns: S1 S2 S3) +- scatter between successive repeats")
    for i, channel in enumerate(r["sensor_channels"]):
        entries = "".join(f"   {x:+.5f} +- {deviation:.5f}" for x, deviation in zip(r["mean"][i], r["scatter"][i]))
        lines.append(f"  {r['channels'][channel]}{entries}" + (f"   (phase {r['phase_deg'][i]:+.1f} deg)" if has_reference else ""))
    singular = " ".join(_number(s, ".5f") for s in r["singular_values"])
    lines.append(f"det {_number(r['determinant'], '+.3e')}, singular values {singular}, signal to noise {_number(r['snr_db'], '.1f')} dB, "
                 f"couplings unexplained {_percent(r['misfit_share'])}")
    if r["induced_misfit_share"] is not None:
        lines.append(f"voltages of coils grow with the carrier: with --induced {_percent(r['induced_misfit_share'])} are unexplained")
    lines += [f"flag: {flag}" for flag in r["flags"]]
    return "\n".join([*lines, r["verdict"]]) + "\n"
