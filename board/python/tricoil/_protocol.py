"""`tricoil protocol`: the wire protocol as DBC file and page."""

import itertools
import os

from . import _tricoil
from ._output_file import refuse_input_as_output, write_all

STAMP_END = 14  # bytes of the fields that INTRODUCTION describes
FRAME_BYTES = 64  # the longest frame of CAN FD

DBC_START = """VERSION "1"

NS_ :

BS_:

BU_: HOST DEVICE
"""
DBC_FORMATS = """BA_DEF_ BO_ "VFrameFormat" ENUM "StandardCAN","ExtendedCAN","reserved","reserved","reserved","reserved","reserved","reserved","reserved","reserved","reserved","reserved","reserved","reserved","StandardCAN_FD","ExtendedCAN_FD";
BA_DEF_DEF_ "VFrameFormat" "StandardCAN_FD";
"""

# Beginning of the page. Arguments: version, longest message.
INTRODUCTION = """# Wire protocol, version {}

Generated from `schema.hpp` by `tricoil protocol`; do not edit. Numbers are little-endian, in the stated unit. A number outside the
range of its field (by default that of its type) makes the message invalid. Messages of an unknown version or type are refused and
counted. Every message begins with the same fields:

| byte | field | type | unit | range | |
|---|---|---|---|---|---|
| 0 | version | u8 | | | of the protocol |
| 1 | type | u8 | | | number in the heading of the message |
| 2 | sequence | u32 | | | counts the sender's messages of this type |
| 6 | time | i64 | 1e-06 s | 0 to 9.2e+12 | device time; middle of the window |

- CAN FD: one message per frame, standard identifier 0x100 + 16 type + node (0-15), padded with zeros to the next CAN FD length.
  Longer messages use ISO 15765-2 segments: 0x1E0 + node from the device, 0x1F0 + node from the host; at most {} bytes.
- Byte streams (USB bulk, serial): message and CRC-32 (IEEE 802.3, little-endian), COBS encoded, then a zero byte.

A host sends `command` hello with its range of versions. The device answers `identify`. Both use the newest common version. After
`command` start and its `ack` the device sends columns or poses. If the host is silent for the watchdog time, it becomes idle, coils off. If the host drives the coils, it reports each change by `command` excite with a state
sequence.

A command that is not executed is answered by `ack` with the reason. A device with several links sends its stream to each host
that has sent start, until this host sends stop or is silent. Without such a host, or the parameter start, the coils are off.

| command | argument |
|---|---|
| hello | oldest version, newest version x 256 |
| start | 0; 1: the host drives the coils |
| excite | state sequence |
| keep alive | sequence of the newest received column or pose |
| mode | bits 0-27: frame rate in mHz, 0: default; bit 28: FDM; bit 30: dual-band, without bit 28; bit 29: columns instead of poses. `ack` returns the frame rate |
| hemisphere | x, y, z of its direction as signed bytes, index of the sensor in the highest byte; all zero: unknown; a tracker board forgets it when the measurement ends |
| boresight | 1: the present attitude becomes zero; 0: removes this correction |
| loader | 0x4C4F4144; 0x494D4147 starts the image that was written |

A tracker board executes loader, and stores an image, calibration or parameters, only after a press of its button: one of them within 60 s;
otherwise `ack` refused has the argument 1.
"""


def _decimal(value: float) -> str:
    """Without exponent, because some readers of DBC files do not support exponents."""
    return f"{value:.12f}".rstrip("0").rstrip(".")


def _signal(name, kind, at, scale, low, high, unit, unlimited=False):
    """SG_ name : start|bits@1(sign) (scale,offset) [low|high] "unit" receiver; [0|0]: no limits."""
    sign = "+" if kind[0] == "u" else "-"
    low, high = (0, 0) if kind == "f32" and unlimited else (low, high)
    return f' SG_ {name} : {8 * at}|{kind[1:]}@1{sign} ({_decimal(scale)},0) [{_decimal(low)}|{_decimal(high)}] "{unit}" Vector__XXX\n'


def dbc_file() -> str:
    """Of all messages of fixed length that fit into a CAN FD frame, for node 0."""
    messages, comments, floats, formats = "", "", "", ""
    for m in _tricoil.protocol()["messages"]:
        if m["bytes"] > FRAME_BYTES or m["tail_unit"]:
            continue
        number = m["can_id"]
        messages += f"\nBO_ {number} {m['name']}: {m['can_bytes']} {'HOST' if m['from'] == 'host' else 'DEVICE'}\n"
        messages += _signal("version", "u8", 0, 1, 0, 255, "") + _signal("type", "u8", 1, 1, 0, 255, "")
        comments += f'CM_ BO_ {number} "{m["what"]}";\n'
        formats += f'BA_ "VFrameFormat" BO_ {number} 14;\n'
        for f in m["fields"]:
            messages += _signal(f["name"], f["type"], f["at"], f["scale"], f["low"], f["high"], f["unit"], not f["has_low"])
            comments += f'CM_ SG_ {number} {f["name"]} "{f["what"]}";\n'
            floats += f"SIG_VALTYPE_ {number} {f['name']} : 1;\n" if f["type"] == "f32" else ""
    return DBC_START + messages + "\n" + comments + DBC_FORMATS + formats + floats


def _row(places, names, field) -> str:
    """Of a message's table. An empty range is that of the type."""
    unit = field["unit"]
    factor = "" if field["scale"] == 1 else str(field["scale"]).removesuffix(".0") + (" " if unit else "")
    limits = f"{field['low']:.6g} to {field['high']:.6g}" if field["has_low"] or field["has_high"] else ""
    return f"| {places} | {names} | {field['type']} | {factor}{unit} | {limits} | {field['what']} |\n"


def _rows(fields) -> str:
    """Of a message's own fields. The elements of a field share a row."""
    rows = ""
    for _, group in itertools.groupby((field for field in fields if field["at"] >= STAMP_END), key=lambda field: field["number"]):
        elements = list(group)
        rows += _row(", ".join(str(e["at"]) for e in elements), ", ".join(e["name"] for e in elements), elements[0])
    return rows


def _page() -> str:
    """Description of the protocol in Markdown."""
    protocol = _tricoil.protocol()
    text = INTRODUCTION.format(protocol["version"], protocol["most_bytes"])
    for m in protocol["messages"]:
        tail = " and a tail" if m["tail_unit"] else ""
        text += f"\n## {m['name']} ({m['number']})\n\nFrom: {m['from']}. {m['what']}; {m['bytes']} bytes{tail}.\n\n"
        text += "| byte | field | type | unit | range | |\n|---|---|---|---|---|---|\n" + _rows(m["fields"])
        if m["tail_unit"]:
            text += f"| {m['bytes']} | (tail) | {m['tail_unit']} bytes each | | | {m['tail_what']} |\n"
    return text


def run(dbc=None, page=None) -> tuple[dict, str]:
    """What `tricoil protocol --json` prints: the names of the written files, or their contents; and its text. Raises ValueError, OSError."""
    if dbc is None and page is None:
        result = {"page": _page(), "dbc": dbc_file()}
        return result, result["page"]
    refuse_input_as_output({"--dbc": dbc, "--page": page}, [])
    files = {"dbc_file": (dbc, dbc_file()), "page_file": (page, _page())}
    named = {key: (os.fspath(path), text) for key, (path, text) in files.items() if path is not None}
    write_all(dict(named.values()))
    return {key: path for key, (path, _) in named.items()}, ""
