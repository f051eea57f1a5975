"""Clients of the outputs of `tricoil serve`. A reader runs until its connection ends, and appends each valid pose to `ages.timed`, as (arrival,
time of the pose), s since 1970, or, from an output without times, to `ages.placed`, as (arrival, position in m)."""
import asyncio
import json
import re
import socket
import struct
import time


class Ages:
    """Poses of one client."""

    def __init__(self, timed=None, placed=None):
        self.timed = [] if timed is None else timed
        self.placed = [] if placed is None else placed


def connected(address):
    host, port = address.rsplit(":", 1)
    return socket.create_connection((host, int(port)), timeout=10)


def read_lines(ages, lines):
    for line in lines:
        arrival = time.time()
        pose = json.loads(line)
        if pose["valid"]:
            ages.timed.append((arrival, pose["utc_s"]))
            ages.placed.append((arrival, pose["position_m"]))


def read_datagrams(ages, receiver, take):
    while True:
        data = receiver.recv(65536)
        take(ages, time.time(), data)


def take_json(ages, arrival, data):
    pose = json.loads(data)
    if pose["valid"]:
        ages.timed.append((arrival, pose["utc_s"]))


def take_osc(ages, arrival, data):
    at = data.find(b"/position")
    if at >= 0:
        floats = data.index(b",fff", at) + 8  # the type tags take eight bytes
        ages.placed.append((arrival, struct.unpack(">fff", data[floats:floats + 12])))


def read_fastrak(ages, address):
    line = connected(address)
    line.sendall(b"uO1,52,1\rC")
    for record in line.makefile(newline="\n"):
        numbers = re.findall(r"[-+]?\d\.\d+E[-+]\d+", record)
        if record[:3] == "01 " and len(numbers) == 3:
            ages.placed.append((time.time(), [0.01 * float(number) for number in numbers]))


def read_openigtlink(ages, address):
    stream = connected(address).makefile("rb")
    while True:
        header = stream.read(58)
        seconds, fraction, size = struct.unpack(">IIQ", header[34:50])
        stream.read(size)
        if header[2:11] == b"TRANSFORM":
            ages.timed.append((time.time(), seconds + fraction / 2**32))


def read_page(ages, url):
    address = url.removeprefix("http://").rstrip("/")
    line = connected(address)
    line.sendall(f"GET /stream HTTP/1.1\r\nHost: {address}\r\n\r\n".encode())
    columns = None
    for text in line.makefile():
        if text.startswith("data: "):
            event = json.loads(text[6:])
            columns = event.get("hello", {}).get("columns", columns)
            for values in event["poses"]:
                pose = dict(zip(columns, values))
                if pose["flags"] == 0:
                    ages.timed.append((time.time(), 1e-3 * pose["utc_ms"]))


def read_websocket(ages, url):
    import websockets

    async def receive():
        async with websockets.connect(url) as poses:
            async for message in poses:
                take_json(ages, time.time(), message)

    asyncio.run(receive())


def receiver():
    end = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    end.bind(("127.0.0.1", 0))
    return end, f"127.0.0.1:{end.getsockname()[1]}"
