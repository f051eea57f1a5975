#!/usr/bin/env python3
"""Lab Streaming Layer outlet: every pose of one sensor as a sample of a MoCap stream, for LabRecorder and other receivers.

  python3 lsl_outlet.py [SOURCE]     default: sim:hand,realtime=yes

Needs pylsl. Channels: position in metres, quaternion w x y z, validity (0 or 1), as in the MoCap meta-data of XDF.
"""

import collections
import sys

import pylsl

import tricoil

RATE_HZ = 240
CHANNELS = [("x", "PositionX", "meters"), ("y", "PositionY", "meters"), ("z", "PositionZ", "meters"),
            ("qw", "OrientationA", "quaternion"), ("qx", "OrientationB", "quaternion"), ("qy", "OrientationC", "quaternion"),
            ("qz", "OrientationD", "quaternion"), ("valid", "Confidence", "normalized")]


def make_outlet(source):
    info = pylsl.StreamInfo("tricoil", "MoCap", len(CHANNELS), RATE_HZ, "float32", f"tricoil {source}")
    channels = info.desc().append_child("channels")
    for label, kind, unit in CHANNELS:
        channel = channels.append_child("channel")
        channel.append_child_value("label", label)
        channel.append_child_value("type", kind)
        channel.append_child_value("unit", unit)
    return pylsl.StreamOutlet(info)


def main():
    source = sys.argv[1] if len(sys.argv) > 1 else "sim:hand,realtime=yes"
    outlet = make_outlet(source)
    delays_s = collections.deque(maxlen=1000)  # LSL time minus device time; the shortest sets the difference of the clocks
    with tricoil.open(source, "scaat") as poses:
        for pose in poses:
            if pose.sensor == 0:
                delays_s.append(pylsl.local_clock() - pose.time_s)
                sample = [*pose.position_m, *pose.quaternion_wxyz, pose.valid]
                outlet.push_sample([float(value) for value in sample], pose.time_s + min(delays_s))


if __name__ == "__main__":
    try:
        main()
    except KeyboardInterrupt:
        pass
