"""One client of each output of `tricoil serve`, which reads as it should and connects again; counts poses and measures their age.

  outputs.py CLOCK     CLOCK: file of wall_clock.cpp. Prints the addresses for JSON lines and OSC by UDP, as JSON; then standard input has
                       the addresses that the program serves, a line of JSON; at its end the table is printed.

A process of its own: other work of the test does not delay the arrival of poses.
"""
import json
import mmap
import os
import struct
import sys
import termios
import threading
import time
import tty

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import output_readers as readers  # noqa: E402: in tests/support


class WallClock:
    """The offset that wall_clock.cpp adds to the program's wall clock. For some seconds after a step, poses of before are on their way."""

    SETTLING_S = 5

    def __init__(self, path):
        with open(path, "rb") as file:
            self.place = mmap.mmap(file.fileno(), 8, prot=mmap.PROT_READ)
        self.ahead_us, self.stepped = 0, 0.0

    def ahead_s(self):
        """None after a step."""
        ahead_us, = struct.unpack("<q", self.place[:8])
        if ahead_us != self.ahead_us:
            self.ahead_us, self.stepped = ahead_us, time.monotonic()
        return 1e-6 * ahead_us if time.monotonic() - self.stepped > self.SETTLING_S else None


class Count:
    """Appended poses of an output without times."""

    def __init__(self):
        self.poses = 0

    def append(self, _):
        self.poses += 1


class Histogram(Count):
    """Appended (arrival, time of the pose): ages in steps of 1 ms."""

    MOST_MS = 60_000

    def __init__(self, clock):
        super().__init__()
        self.clock, self.counts, self.least_ms, self.most_ms = clock, {}, float("inf"), float("-inf")

    def append(self, pose):
        super().append(pose)
        ahead_s = self.clock.ahead_s()
        if ahead_s is None:
            return
        age_ms = 1e3 * (pose[0] + ahead_s - pose[1])
        self.least_ms, self.most_ms = min(self.least_ms, age_ms), max(self.most_ms, age_ms)
        step = round(max(-1, min(age_ms, self.MOST_MS)))
        self.counts[step] = self.counts.get(step, 0) + 1

    def quantile_ms(self, share):
        rest = share * sum(self.counts.values())
        for step in sorted(self.counts):
            rest -= self.counts[step]
            if rest <= 0:
                return step
        return float("nan")


class Client(threading.Thread):
    """Calls `read` with its poses, again if the connection ends. A program that reads nothing for 30 s is disconnected."""

    def __init__(self, name, read, timed):
        super().__init__(daemon=True)
        self.name, self.read, self.timed = name, read, timed
        self.connections, self.ends = 0, False
        self.start()

    def run(self):
        ages = readers.Ages(timed=self.timed if isinstance(self.timed, Histogram) else Count(),
                            placed=Count() if isinstance(self.timed, Histogram) else self.timed)
        while not self.ends:
            self.connections += 1
            try:
                self.read(ages)
            except Exception:  # the end of a connection in the middle of a message, too
                time.sleep(0.2)


def read_terminal(ages, path):
    """FASTRAK on a pseudo terminal."""
    line = os.open(path, os.O_RDWR | os.O_NOCTTY)
    try:
        tty.setraw(line, termios.TCSANOW)
        os.write(line, b"C")
        while True:
            for _ in range(os.read(line, 4096).count(b"\n")):
                ages.placed.append(None)
    finally:
        os.close(line)


def clients_of(where, receivers, clock):
    """where: addresses that the program prints; receivers: sockets of JSON lines and OSC by UDP."""
    lines, osc = receivers
    tcp, terminal = where["fastrak"]
    timed = {
        "JSON lines, TCP": lambda ages: readers.read_lines(ages, readers.connected(where["json_lines"][0]).makefile()),
        "JSON lines, UDP": lambda ages: readers.read_datagrams(ages, lines, readers.take_json),
        "WebSocket": lambda ages: readers.read_websocket(ages, where["websocket"]),
        "OpenIGTLink": lambda ages: readers.read_openigtlink(ages, where["openigtlink"]),
        "live page": lambda ages: readers.read_page(ages, where["web"]),
    }
    placed = {
        "OSC, UDP": lambda ages: readers.read_datagrams(ages, osc, readers.take_osc),
        "FASTRAK, TCP": lambda ages: readers.read_fastrak(ages, tcp),
        "FASTRAK, terminal": lambda ages: read_terminal(ages, terminal),
    }
    return ([Client(name, read, Histogram(clock)) for name, read in timed.items()] +
            [Client(name, read, Count()) for name, read in placed.items()])


def table(clients):
    yield f"{'output':<20}{'poses':>10}{'connections':>13}{'median':>9}{'99.9 %':>9}{'least':>9}{'most':>9}    age, ms"
    for client in clients:
        row = f"{client.name:<20}{client.timed.poses:>10}{client.connections:>13}"
        if isinstance(client.timed, Histogram):
            seen = client.timed
            row += f"{seen.quantile_ms(0.5):>9.0f}{seen.quantile_ms(0.999):>9.0f}{seen.least_ms:>9.1f}{seen.most_ms:>9.1f}"
        yield row


def main():
    (lines, lines_at), (osc, osc_at) = readers.receiver(), readers.receiver()
    print(json.dumps({"lines": lines_at, "osc": osc_at}), flush=True)
    clients = clients_of(json.loads(sys.stdin.readline()), (lines, osc), WallClock(sys.argv[1]))
    sys.stdin.read()
    for client in clients:
        client.ends = True
    print("\n".join(table(clients)), flush=True)
    os._exit(0)  # readers wait for poses


main()
