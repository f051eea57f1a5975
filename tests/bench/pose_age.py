#!/usr/bin/env python3
"""Age of poses at clients of every output of `tricoil serve`, in one run: from the midpoint of sampling to the client.

  pose_age.py TRICOIL [SECONDS]     default: 10 s. Needs python3-websockets

The simulated hand at 240 Hz in real time, TDM. The time of a pose is its own field, or, for FASTRAK and OSC, which have none, that of the
JSON line with the same position. Half a demodulation window is part of the age. FASTRAK sends at most 120 poses a second; the page
gets 30 events a second, each with all new poses.
"""
import math
import os
import re
import statistics
import subprocess
import sys
import threading
import time

sys.dont_write_bytecode = True
sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import output_readers as readers  # noqa: E402: in tests/support

SETTLING_S = 1.0


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
    (lines_end, lines_to), (osc_end, osc_to) = readers.receiver(), readers.receiver()
    outputs = ["--json-lines", "-", "--json-lines", "tcp:0", "--json-lines", f"udp:{lines_to}", "--websocket", "0", "--osc", osc_to,
               "--fastrak", "tcp:0", "--openigtlink", "0", "--web", "0"]
    program = subprocess.Popen([sys.argv[1], "serve", "--scenario", "hand", "--mux", "tdm", "--tracker", "scaat", "--read-only", *outputs],
                               stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    where = addresses_of(program, 6)
    clients = {
        "JSON lines, output -": (readers.read_lines, program.stdout),
        "JSON lines, TCP": (lambda ages, address: readers.read_lines(ages, readers.connected(address).makefile()), where["json_lines"][0]),
        "JSON lines, UDP": (lambda ages, end: readers.read_datagrams(ages, end, readers.take_json), lines_end),
        "WebSocket": (readers.read_websocket, where["websocket"][0]),
        "OSC, UDP": (lambda ages, end: readers.read_datagrams(ages, end, readers.take_osc), osc_end),
        "FASTRAK, TCP": (readers.read_fastrak, where["fastrak"][0]),
        "OpenIGTLink": (readers.read_openigtlink, where["openigtlink"][0]),
        "live page": (readers.read_page, where["web"][0]),
    }
    ages = {name: readers.Ages() for name in clients}
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
