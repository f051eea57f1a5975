#!/usr/bin/env python3
"""Age of poses at clients of every output of `tricoil serve`, in one run: from the midpoint of sampling to the client.

  pose_age.py TRICOIL [SECONDS]     default: 10 s. Needs python3-websockets

The simulated hand at 240 Hz in real time, TDM. The time of a pose is its own field, or, for FASTRAK and OSC, which have none, that of the
JSON line with the same position. Half a demodulation window is part of the age. FASTRAK sends at most 120 poses a second; the page
gets 30 events a second, each with all new poses.
"""
import asyncio
import json
import math
import re
import socket
import statistics
import struct
import subprocess
import sys
import threading
import time

import websockets

SETTLING_S = 1.0


class Ages:
    """Poses of one client: arrival and time of the pose, or its position."""

    def __init__(self):
        self.timed = []  # (arrival, time of the pose), s since 1970
        self.placed = []  # (arrival, position in m)


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
    async def receive():
        async with websockets.connect(url) as poses:
            async for message in poses:
                take_json(ages, time.time(), message)

    asyncio.run(receive())


def receiver():
    end = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    end.bind(("127.0.0.1", 0))
    return end, f"127.0.0.1:{end.getsockname()[1]}"


def addresses_of(program, count):
    """Addresses that the program prints to standard error."""
    found = {}
    while len(found) < count:
        line = program.stderr.readline()
        match = re.match(r"serving (\w+) on (.*)$", line)
        if match is None:
            sys.exit(f"pose_age: expected an address, not '{line}'")
        found[match[1]] = match[2].split(", ")
    return found


class Times:
    """Times of the poses of JSON lines by their positions."""

    CELL_M = 1e-4

    def __init__(self, ages):
        self.cells = {}
        for (arrival, utc_s), (_, position) in zip(ages.timed, ages.placed):
            self.cells.setdefault(round(position[0] / self.CELL_M), []).append((arrival, utc_s, position))

    def of(self, position, near):
        """Time of the pose with this position that arrived within a second; NaN if there is none."""
        cell = round(position[0] / self.CELL_M)
        near_poses = [pose for n in (cell - 1, cell, cell + 1) for pose in self.cells.get(n, []) if abs(pose[0] - near) < 1]
        best = min(near_poses, key=lambda pose: math.dist(position, pose[2]), default=None)
        return best[1] if best is not None and math.dist(position, best[2]) < 1e-6 else math.nan


def watch(read, ages, of, is_ending):
    """Reads until the program ends."""
    try:
        read(ages, of)
    except Exception:
        if not is_ending.is_set():
            raise


def row(name, pairs, begin):
    ages_ms = sorted(1e3 * (arrival - utc_s) for arrival, utc_s in pairs if arrival > begin and not math.isnan(utc_s))
    if len(ages_ms) < 10:
        sys.exit(f"pose_age: {name}: only {len(ages_ms)} poses")
    print(f"{name:<22}{len(ages_ms):>6}{statistics.median(ages_ms):>9.2f}{ages_ms[int(0.99 * len(ages_ms))]:>9.2f}{ages_ms[-1]:>9.2f}")


def main():
    if len(sys.argv) not in (2, 3):
        sys.exit("usage: pose_age.py TRICOIL [SECONDS]")
    duration_s = float(sys.argv[2]) if len(sys.argv) == 3 else 10
    (lines_end, lines_to), (osc_end, osc_to) = receiver(), receiver()
    outputs = ["--json-lines", "-", "--json-lines", "tcp:0", "--json-lines", f"udp:{lines_to}", "--websocket", "0", "--osc", osc_to,
               "--fastrak", "tcp:0", "--openigtlink", "0", "--web", "0"]
    program = subprocess.Popen([sys.argv[1], "serve", "--scenario", "hand", "--mux", "tdm", "--tracker", "scaat", "--read-only", *outputs],
                               stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    where = addresses_of(program, 6)
    clients = {
        "JSON lines, output -": (read_lines, program.stdout),
        "JSON lines, TCP": (lambda ages, address: read_lines(ages, connected(address).makefile()), where["json_lines"][0]),
        "JSON lines, UDP": (lambda ages, end: read_datagrams(ages, end, take_json), lines_end),
        "WebSocket": (read_websocket, where["websocket"][0]),
        "OSC, UDP": (lambda ages, end: read_datagrams(ages, end, take_osc), osc_end),
        "FASTRAK, TCP": (read_fastrak, where["fastrak"][0]),
        "OpenIGTLink": (read_openigtlink, where["openigtlink"][0]),
        "live page": (read_page, where["web"][0]),
    }
    ages = {name: Ages() for name in clients}
    is_ending = threading.Event()
    for name, (read, of) in clients.items():
        threading.Thread(target=watch, args=(read, ages[name], of, is_ending), daemon=True).start()
    begin = time.time() + SETTLING_S
    time.sleep(SETTLING_S + duration_s)
    is_ending.set()
    program.kill()
    program.wait()
    time.sleep(1)  # until the readers have ended
    times = Times(ages["JSON lines, TCP"])
    print(f"{'output':<22}{'poses':>6}{'median':>9}{'99 %':>9}{'max':>9}    age, ms")
    for name, seen in ages.items():
        pairs = seen.timed or [(arrival, times.of(position, arrival)) for arrival, position in seen.placed]
        row(name, pairs, begin)


main()
