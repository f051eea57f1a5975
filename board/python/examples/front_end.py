#!/usr/bin/env python3
"""A front end in one file: measures couplings and sends them to tricoil. Python's standard library only.

  python3 front_end.py serial:/dev/ttyGS0    the wire protocol (core/protocol/PROTOCOL.md); serial:pty makes a pseudo terminal and prints its name
  tricoil run --device serial:/dev/ttyACM0

  tricoil run --device columns:tcp:5006      lines of text instead, without framing or handshake
  python3 front_end.py tcp:localhost:5006    or udp:localhost:5006

Replace `Hardware` by yours. The one below is a dipole of C = 6.75e-3 m^3 and a sensor that moves on a circle.
"""

import json
import math
import os
import pty
import random
import select
import socket
import struct
import sys
import termios
import time
import tty
import zlib

VERSION = 3
COMMAND, ACK, STATUS, COLUMN, IDENTIFY, CALIBRATION = 1, 2, 3, 4, 6, 11
HELLO, START, STOP, EXCITE, KEEP_ALIVE, READ_CALIBRATION = range(1, 7)
DONE, REFUSED, UNKNOWN, UNREADABLE = 0, 1, 2, 8
HOST_SILENT, CONVERTER = 1 << 0, 1 << 2  # bits of the faults
STUCK = 1 << 2  # bit of the flags of a column
LAYOUT = {  # after version, type, sequence and time; little-endian
    COMMAND: "<BBHI",  # opcode, state, request, argument
    ACK: "<BBHI",  # opcode, result, request, argument
    STATUS: "<BBHIIIhH",  # device state, excitation, faults, dropped, overruns, transitions, temperature, supply
    COLUMN: "<BBHI9f3H",  # sensor, coil, flags, state sequence; in phase, quadrature, sigma, levels of three channels
    IDENTIFY: "<BBBBQIHBBIII",  # role, versions, sensors, serial, firmware, product, TDM, drives coils, mHz, window, watchdog in us
    CALIBRATION: "<H",  # request; then the calibration: none
}
FRAME_RATE_HZ = 100
SLOT_S = 1 / (3 * FRAME_RATE_HZ)  # the coils are driven in turn
WATCHDOG_S = 0.1
STATUS_S = 0.1
LONGEST_FRAME = 8192


class Hardware:
    """A simulated sensor. `fault`: the converter is stuck for a second, 2 s after the start."""

    SIGMA = 1e-6  # standard deviation of a coupling
    CONSTANT_M3 = 6.75e-3

    def __init__(self, fault=False):
        self.has_fault, self.begin_s = fault, time.monotonic()

    def now_s(self):
        """Clock of the device."""
        return time.monotonic() - self.begin_s

    def is_stuck(self):
        return self.has_fault and 2 <= self.now_s() < 3

    def measure(self, coil, time_s):
        """Three couplings to source coil 0, 1 or 2: voltages of the sensor coils divided by the reference current, in phase with it."""
        at = 0.4, 0.1 * math.cos(2 * time_s), 0.1 * math.sin(2 * time_s)
        r = math.hypot(*at)
        k = self.CONSTANT_M3 / r**3
        return [k * (1.5 * at[i] * at[coil] / r**2 - 0.5 * (i == coil)) + random.gauss(0, self.SIGMA) for i in range(3)]

    def coils_off(self):
        """Called whenever the measurement stops."""


def framed(message):
    """Message and CRC-32, stuffed so that they have no zero, and a zero: each zero becomes the distance to the next one. For less than 254 bytes."""
    data = message + struct.pack("<I", zlib.crc32(message))
    return b"".join(bytes([len(run) + 1]) + run for run in data.split(b"\0")) + b"\0"


def unframed(frame):
    """The message between two zeros; None if it is damaged."""
    data, at = bytearray(), 0
    while at < len(frame):
        code = frame[at]
        data += frame[at + 1:at + code]
        at += code
        if code < 255 and at < len(frame):
            data.append(0)
    message = bytes(data[:-4])
    return message if at == len(frame) and data[-4:] == struct.pack("<I", zlib.crc32(message)) else None


class WireFrontEnd:
    """The device side of the wire protocol on an open serial line."""

    def __init__(self, line, hardware):
        self.line, self.hardware = line, hardware
        self.sequences = dict.fromkeys(LAYOUT, 0)  # counts the messages of each type
        self.running, self.faults, self.dropped = False, 0, 0
        self.received = b""
        self.slot, self.begin_s, self.heard_s, self.status_s = 0, 0, 0, 0

    def send(self, kind, *fields, time_s=None):
        time_us = round(1e6 * (self.hardware.now_s() if time_s is None else time_s))
        message = struct.pack("<BBIq", VERSION, kind, self.sequences[kind] & 0xFFFFFFFF, time_us) + struct.pack(LAYOUT[kind], *fields)
        self.sequences[kind] += 1
        data = framed(message)
        try:
            is_sent = os.write(self.line, data) == len(data)
        except BlockingIOError:  # nobody reads
            is_sent = False
        self.dropped += not is_sent

    def read(self):
        try:
            self.received += os.read(self.line, 4096)
        except BlockingIOError:
            return
        *frames, self.received = self.received.split(b"\0")
        self.received = self.received[-LONGEST_FRAME:]
        for frame in filter(None, frames):
            message = unframed(frame)
            if message is None or message[0] != VERSION or message[1] != COMMAND or len(message) != 22:
                self.send(ACK, 0, UNREADABLE, 0, 0)
            else:
                self.obey(*struct.unpack(LAYOUT[COMMAND], message[14:]))

    def obey(self, opcode, _state, request, argument):
        if opcode == HELLO:
            self.send(IDENTIFY, 1, VERSION, VERSION, 1, 1234, 0x000100, 1, 0, 1, 1000 * FRAME_RATE_HZ, round(1e6 * SLOT_S), round(1e6 * WATCHDOG_S))
        elif opcode == START:
            drives_itself = argument == 0
            self.send(ACK, opcode, DONE if drives_itself else REFUSED, request, 0)
            if drives_itself and not self.running:
                self.running, self.slot, self.begin_s, self.faults = True, 0, self.hardware.now_s(), 0
        elif opcode == STOP:
            self.stop()
            self.send(ACK, opcode, DONE, request, 0)
        elif opcode == READ_CALIBRATION:
            self.send(CALIBRATION, request)
        elif opcode != KEEP_ALIVE:
            self.send(ACK, opcode, UNKNOWN, request, 0)
        if opcode in (START, KEEP_ALIVE):
            self.heard_s = self.hardware.now_s()

    def stop(self):
        self.running = False
        self.hardware.coils_off()

    def step(self):
        """Serves the host, and sends a column if its window is over."""
        end_s = self.begin_s + (self.slot + 1) * SLOT_S
        now_s = self.hardware.now_s()
        select.select([self.line], [], [], max(0, min(end_s - now_s, 0.01)) if self.running else 0.01)
        self.read()
        now_s = self.hardware.now_s()
        if self.running and now_s - self.heard_s > WATCHDOG_S:
            self.stop()
            self.faults |= HOST_SILENT
        if self.running and now_s >= end_s:
            self.send_column(self.slot, end_s - SLOT_S / 2)
            self.slot += 1
        self.faults = self.faults & ~CONVERTER | CONVERTER * self.hardware.is_stuck()
        if now_s - self.status_s > STATUS_S:
            self.status_s = now_s
            coil = self.slot % 3 + 1 if self.running else 0
            self.send(STATUS, int(self.running), coil, self.faults, self.dropped, 0, 0, 0, 0)

    def send_column(self, slot, middle_s):
        coil = slot % 3
        couplings = self.hardware.measure(coil, middle_s)
        flags = STUCK if self.hardware.is_stuck() else 0
        self.send(COLUMN, 0, coil + 1, flags, slot + 1, *couplings, *3 * [0], *3 * [self.hardware.SIGMA], *3 * [0], time_s=middle_s)


def open_line(name):
    """A serial line without translation of bytes. "pty": a new pseudo terminal, whose name is printed."""
    if name == "pty":
        line, other = pty.openpty()  # both stay open: a host may come and go
        tty.setraw(other, termios.TCSANOW)
        print(os.ttyname(other), flush=True)
    else:
        line = os.open(name, os.O_RDWR | os.O_NOCTTY)
        tty.setraw(line, termios.TCSANOW)
    os.set_blocking(line, False)
    return line


def send_lines(kind, address, hardware):
    """The same columns as lines of JSON, until the host closes the connection."""
    host, _, port = address.rpartition(":")
    with socket.socket(type=socket.SOCK_STREAM if kind == "tcp" else socket.SOCK_DGRAM) as connection:
        connection.connect((host.strip("[]"), int(port)))
        begin_s = hardware.now_s()
        slot = 0
        while True:
            middle_s = begin_s + (slot + 0.5) * SLOT_S
            time.sleep(max(0, middle_s + SLOT_S / 2 - hardware.now_s()))
            coil = slot % 3
            column = {"time_us": round(1e6 * middle_s), "state": coil + 1, "in_phase": hardware.measure(coil, middle_s),
                      "sigma": hardware.SIGMA, "flags": STUCK if hardware.is_stuck() else 0}
            try:
                connection.sendall(json.dumps(column).encode() + b"\n")
            except ConnectionError:
                if kind == "tcp":
                    return
            slot += 1  # of UDP also if nobody listens yet


def main():
    words = sys.argv[1:]
    hardware = Hardware(fault="--fault" in words)
    links = [word.partition(":") for word in words if word != "--fault"]
    if len(links) != 1 or links[0][0] not in ("serial", "tcp", "udp"):
        sys.exit("usage: front_end.py serial:PATH|serial:pty|tcp:HOST:PORT|udp:HOST:PORT [--fault]")
    kind, _, where = links[0]
    try:
        if kind != "serial":
            send_lines(kind, where, hardware)
        else:
            front_end = WireFrontEnd(open_line(where), hardware)
            while True:
                front_end.step()
    except (OSError, ValueError, termios.error) as error:
        sys.exit(f"front_end.py: {kind}:{where}: {error}")
    except KeyboardInterrupt:
        pass
    finally:
        hardware.coils_off()


if __name__ == "__main__":
    main()
