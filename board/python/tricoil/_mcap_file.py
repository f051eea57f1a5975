"""`tricoil convert --to mcap`: poses of a recording as an MCAP file (https://mcap.dev/spec) with JSON messages, for Foxglove and PlotJuggler.

Two topics for each sensor N: /sensorN/tracker has all poses with the fields of JSON lines (schema tricoil.Pose); /sensorN/pose has the valid poses in metres
as foxglove.PoseInFrame. Times are those of the poses, ns.
"""

import itertools
import json
import struct
import zlib

from ._mcap import CHANNEL, CHUNK, MAGIC, MESSAGE, OWN_SCHEMA, SCHEMA
from ._output_file import OutputFile
from ._staged_lines import INTEGERS, staged_lines

HEADER, FOOTER, MESSAGE_INDEX, CHUNK_INDEX, STATISTICS, DATA_END = 1, 2, 7, 8, 0x0B, 0x0F
CHUNK_BYTES = 1 << 20


def _numbers(kinds: str, *values: int) -> bytes:
    return struct.pack("<" + kinds, *values)


def _text(content: bytes) -> bytes:
    """Bytes after their number."""
    return _numbers("I", len(content)) + content


def _record(op: int, content: bytes) -> bytes:
    return _numbers("BQ", op, len(content)) + content


def _map_of(numbers: dict[int, int]) -> bytes:
    """Map from channels to numbers."""
    return _text(b"".join(_numbers("HQ", *one) for one in sorted(numbers.items())))


class McapWriter:
    """Chunks without compression, with CRCs, message indexes and a summary. put: takes the bytes of the file in order."""

    def __init__(self, put):
        self._put_bytes, self._at, self._crc = put, 0, 0
        self._schemas: dict[bytes, int] = {}
        self._channels = b""  # records of schemas and channels, repeated in the summary
        self._counts: dict[int, int] = {}  # messages by channel
        self._chunk, self._chunk_times, self._index = bytearray(), [], {}
        self._chunk_indexes: list[bytes] = []
        self._times: list[int] = []  # first and last of the chunks
        self._put(MAGIC)
        self._put(_record(HEADER, _text(b"") + _text(b"tricoil")))

    def _put(self, content: bytes):
        self._put_bytes(content)
        self._at += len(content)
        self._crc = zlib.crc32(content, self._crc)

    def add_channel(self, topic: str, name: bytes, schema: dict) -> int:
        """Adds a channel of JSON messages with a schema of this name. Returns its number."""
        records = b""
        if name not in self._schemas:
            self._schemas[name] = len(self._schemas) + 1
            records = _record(SCHEMA, _numbers("H", self._schemas[name]) + _text(name) + _text(b"jsonschema") + _text(json.dumps(schema).encode()))
        channel = len(self._counts)
        self._counts[channel] = 0
        records += _record(CHANNEL, _numbers("HH", channel, self._schemas[name]) + _text(topic.encode()) + _text(b"json") + _text(b""))
        self._channels += records
        self._chunk += records
        return channel

    def add_message(self, channel: int, sequence: int, time_ns: int, content: bytes):
        """time_ns: log time and publish time."""
        self._index.setdefault(channel, bytearray()).extend(_numbers("QQ", time_ns, len(self._chunk)))
        self._chunk += _record(MESSAGE, _numbers("HIQQ", channel, sequence, time_ns, time_ns) + content)
        self._chunk_times.append(time_ns)
        self._counts[channel] += 1
        if len(self._chunk) >= CHUNK_BYTES:
            self._write_chunk()

    def _write_chunk(self):
        if not self._index:
            return
        times, begin, size = (min(self._chunk_times), max(self._chunk_times)), self._at, len(self._chunk)
        self._put(_record(CHUNK, _numbers("QQQI", *times, size, zlib.crc32(self._chunk)) + _text(b"") + _numbers("Q", size) + self._chunk))
        end, offsets = self._at, {}
        for channel, entries in sorted(self._index.items()):
            offsets[channel] = self._at
            self._put(_record(MESSAGE_INDEX, _numbers("H", channel) + _text(entries)))
        index = _numbers("QQQQ", *times, begin, end - begin) + _map_of(offsets) + _numbers("Q", self._at - end) + _text(b"") + _numbers("QQ", size, size)
        self._chunk_indexes.append(_record(CHUNK_INDEX, index))
        self._times += times
        self._chunk, self._chunk_times, self._index = bytearray(), [], {}

    def finish(self):
        """Writes the last chunk and the summary."""
        self._write_chunk()
        self._put(_record(DATA_END, _numbers("I", self._crc)))
        begin = self._at
        attachments = metadata = 0
        statistics = _numbers("QHIIII", sum(self._counts.values()), len(self._schemas), len(self._counts), attachments, metadata, len(self._chunk_indexes))
        statistics += _numbers("QQ", min(self._times, default=0), max(self._times, default=0)) + _map_of(self._counts)
        summary = self._channels + _record(STATISTICS, statistics) + b"".join(self._chunk_indexes)
        places = _numbers("QQ", begin, 0)  # no summary offsets
        head = _numbers("BQ", FOOTER, len(places) + 4) + places
        self._put(summary + head)
        self._put(_numbers("I", zlib.crc32(summary + head)) + MAGIC)


def _object(title: str, **properties) -> dict:
    return {"title": title, "type": "object", "properties": properties}


NUMBER, INTEGER = {"type": "number"}, {"type": "integer"}
POSE_IN_FRAME = _object("foxglove.PoseInFrame", timestamp=_object("time", sec=INTEGER, nsec=INTEGER), frame_id={"type": "string"},
                        pose=_object("foxglove.Pose", position=_object("foxglove.Vector3", **dict.fromkeys("xyz", NUMBER)),
                                     orientation=_object("foxglove.Quaternion", **dict.fromkeys("xyzw", NUMBER))))


def _pose_schema(poses) -> dict:
    """Of JSON lines. A field is null in some of them."""
    number, properties = {"type": ["number", "null"]}, {}
    for name, value in itertools.chain.from_iterable(pose.items() for pose in poses):
        if value is not None or name not in properties:
            array = {"type": ["array", "null"], "items": number}
            properties[name] = INTEGER if name in INTEGERS else {"type": "string"} if isinstance(value, str) else array if isinstance(value, list) else number
    return _object("tricoil.Pose", **properties)


def _in_frame(pose: dict, time_ns: int, frame: str) -> bytes:
    w, x, y, z = pose["q_wxyz"]
    place = {"position": dict(zip("xyz", pose["position_m"])), "orientation": {"x": x, "y": y, "z": z, "w": w}}
    return json.dumps({"timestamp": {"sec": time_ns // 10**9, "nsec": time_ns % 10**9}, "frame_id": frame, "pose": place}).encode()


def run(folder: str, out: str, options: dict) -> int:
    """Writes the poses of a recording; returns their number. options: stages, units and euler of `tricoil convert`. Raises ValueError, OSError."""
    frame = "aligned" if "align" in options else f"sensor{int(options['relative_to']) - 1}" if "relative_to" in options else "source"
    with staged_lines(folder, out, options, "jsonl") as (in_metres, shown):
        with open(shown, "rb") as lines:
            schema = _pose_schema(map(json.loads, lines))
        with OutputFile(out) as file, open(in_metres, "rb") as metres, open(shown, "rb") as lines:
            writer, channels, count = McapWriter(file.write), {}, 0
            for count, (line, text) in enumerate(zip(metres, lines), 1):
                pose = json.loads(line)
                sensor, time_ns = pose["sensor"], 1000 * max(pose["time_us"], 0)
                if sensor not in channels:
                    channels[sensor] = (writer.add_channel(f"/sensor{sensor}/tracker", OWN_SCHEMA, schema),
                                        writer.add_channel(f"/sensor{sensor}/pose", b"foxglove.PoseInFrame", POSE_IN_FRAME))
                writer.add_message(channels[sensor][0], pose["sequence"], time_ns, text.rstrip())
                if pose["valid"]:
                    writer.add_message(channels[sensor][1], pose["sequence"], time_ns, _in_frame(pose, time_ns, frame))
            writer.finish()
            file.commit()
    return count
