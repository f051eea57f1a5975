"""Serial line between the simulated front end and the program. Simulates a pulled cable, damaged messages, an open source coil and jumps of the
device clock."""
import os
import select
import struct
import termios
import threading
import time
import tty
import zlib

COLUMN = 4  # message type
TIME_AT = 6  # offset of the device time in every message
STATE_AT = 15  # of the source coil in a column
VALUES_AT, VALUES_END = 22, 46  # of the couplings in a column


def decoded(frame):
    """Message of a COBS frame (without the final zero); None if the frame is damaged."""
    out, at = bytearray(), 0
    while at < len(frame):
        run = frame[at]
        if run == 0 or at + run > len(frame):
            return None
        out += frame[at + 1:at + run]
        at += run
        if run < 255 and at < len(frame):
            out.append(0)
    message, crc = bytes(out[:-4]), out[-4:]
    return message if len(out) > 4 and struct.unpack("<I", crc)[0] == zlib.crc32(message) else None


def encoded(message):
    rest, out = message + struct.pack("<I", zlib.crc32(message)), bytearray()
    while True:
        run = rest.split(b"\0", 1)[0][:254]
        out.append(len(run) + 1)
        out += run
        if len(run) == 254 and len(rest) > 254:
            rest = rest[254:]
        elif len(run) < len(rest):
            rest = rest[len(run) + 1:]
        else:
            return bytes(out) + b"\0"


class Relay(threading.Thread):
    """Forwards bytes between the front end's line and a pseudo terminal. `path`: symbolic link to the pseudo terminal."""

    def __init__(self, front_end, path, random):
        super().__init__(daemon=True)
        self.front_end = os.open(front_end, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        tty.setraw(self.front_end, termios.TCSANOW)
        self.path, self.random = path, random
        self.master = None
        self.ahead_us = 0  # added to the device time of columns
        self.damage = 0.0  # share of messages that lose a byte
        self.open_coil = 0  # source coil without current, 1-3
        self.partial = b""
        self.lock = threading.Lock()
        self.ends = False
        self.plug_in()

    def plug_in(self):
        master, slave = os.openpty()
        tty.setraw(slave, termios.TCSANOW)
        os.set_blocking(master, False)
        with self.lock:
            os.symlink(os.ttyname(slave), self.path + ".new")
            os.replace(self.path + ".new", self.path)
            os.close(slave)
            self.master = master

    def pull(self):
        with self.lock:
            os.unlink(self.path)
            os.close(self.master)
            self.master = None

    def run(self):
        while not self.ends:
            with self.lock:
                master = self.master
                try:
                    self.forward(master)
                except OSError:  # nobody has opened the line
                    time.sleep(0.005)

    def forward(self, master):
        readable, _, _ = select.select([self.front_end] + ([master] if master is not None else []), [], [], 0.01)
        if self.front_end in readable:
            data = self.changed(os.read(self.front_end, 4096))
            if master is not None and data:
                os.write(master, data)
        if master in readable:
            os.write(self.front_end, os.read(master, 4096))

    def changed(self, data):
        if self.ahead_us == 0 and self.damage == 0 and self.open_coil == 0 and not self.partial:
            return data
        *frames, self.partial = (self.partial + data).split(b"\0")
        return b"".join(self.changed_frame(frame) for frame in frames)

    def changed_frame(self, frame):
        if self.random.random() < self.damage:
            return frame[:-1] + b"\0"
        message = decoded(frame)
        if message is None or message[1] != COLUMN:
            return frame + b"\0"
        if message[STATE_AT] == self.open_coil:
            message = message[:VALUES_AT] + bytes(VALUES_END - VALUES_AT) + message[VALUES_END:]
        now = struct.unpack_from("<q", message, TIME_AT)[0] + self.ahead_us
        return encoded(message[:TIME_AT] + struct.pack("<q", now) + message[TIME_AT + 8:])
