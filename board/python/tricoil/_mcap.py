"""Poses in an MCAP file of `tricoil convert --to mcap`: the records of https://mcap.dev/spec, as far as that file has them."""

import json
import struct

from ._poses import PoseError

MAGIC = b"\x89MCAP0\r\n"
SCHEMA, CHANNEL, MESSAGE, CHUNK = 3, 4, 5, 6
OWN_SCHEMA = b"tricoil.Pose"


class Content:
    """Bytes of a record, read from the beginning. Raises PoseError at their end."""

    def __init__(self, data: bytes, name: str):
        self.data, self.name, self.at = data, name, 0

    def take(self, count: int) -> bytes:
        if count > len(self.data) - self.at:
            raise PoseError(f"{self.name}: the MCAP file is cut off, or damaged; convert the recording again")
        self.at += count
        return self.data[self.at - count:self.at]

    def number(self, kind: str) -> int:
        return struct.unpack("<" + kind, self.take(struct.calcsize("<" + kind)))[0]

    def text(self) -> bytes:
        return self.take(self.number("I"))

    def records(self):
        """(op, content) of each record."""
        while self.at < len(self.data):
            op = self.number("B")
            yield op, Content(self.take(self.number("Q")), self.name)


def records_of(data: bytes, name: str):
    """Records, with those of the chunks in their place. Raises PoseError."""
    body = data[len(MAGIC):]
    for op, content in Content(body.removesuffix(MAGIC), name).records():
        if op != CHUNK:
            yield op, content
            continue
        content.take(8 + 8 + 8 + 4)  # times, size and CRC
        compression = content.text()
        if compression:
            raise PoseError(f"{name}: the MCAP file is compressed ({compression.decode(errors='replace')[:16]}); write it without compression, or as CSV")
        yield from Content(content.take(content.number("Q")), name).records()


def json_text(data: bytes, name: str) -> bytes:
    """The messages of the schema tricoil.Pose as JSON lines. Raises PoseError."""
    schemas, channels, lines = {}, set(), []
    for op, content in records_of(data, name):
        if op == SCHEMA:
            number = content.number("H")
            schemas[number] = content.text()
        elif op == CHANNEL:
            number, schema = content.number("H"), content.number("H")
            content.text()
            if schemas.get(schema) == OWN_SCHEMA and content.text() == b"json":
                channels.add(number)
        elif op == MESSAGE and content.number("H") in channels:
            content.take(4 + 8 + 8)  # sequence and times
            message = content.data[content.at:]
            try:
                json.loads(message)
            except ValueError:
                raise PoseError(f"{name}: a message of the MCAP file is no JSON; convert the recording again") from None
            lines.append(message.replace(b"\n", b" "))
    if not lines:
        raise PoseError(f"{name}: has no messages tricoil.Pose; of MCAP files those of tricoil convert --to mcap are read")
    return b"\n".join(lines)
