"""Example: poses of a simulation by ctypes. Usage: consumer_ctypes.py libtricoil.so"""

import ctypes
import sys


class Pose(ctypes.Structure):
    _fields_ = [
        ("time_us", ctypes.c_int64),
        ("sequence", ctypes.c_uint32),
        ("sensor", ctypes.c_uint8),
        ("valid", ctypes.c_uint8),
        ("flags", ctypes.c_uint16),
        ("position_m", ctypes.c_double * 3),
        ("quaternion_wxyz", ctypes.c_double * 4),
        ("position_std_m", ctypes.c_double * 3),
        ("rotation_std_rad", ctypes.c_double * 3),
        ("distortion_m", ctypes.c_double),
        ("snr_db", ctypes.c_double),
        ("covariance", ctypes.c_double * 6 * 6),
        ("couplings", ctypes.c_double * 3 * 3),
    ]


if len(sys.argv) != 2:
    sys.exit(__doc__)
tricoil = ctypes.CDLL(sys.argv[1])
tricoil.tricoil_open.restype = ctypes.c_void_p
tricoil.tricoil_open.argtypes = [ctypes.c_char_p, ctypes.c_char_p, ctypes.c_char_p, ctypes.c_size_t]
tricoil.tricoil_poll.argtypes = [ctypes.c_void_p, ctypes.POINTER(Pose), ctypes.c_int]
tricoil.tricoil_close.argtypes = [ctypes.c_void_p]

error = ctypes.create_string_buffer(256)
assert tricoil.tricoil_open(b"nonsense", None, error, len(error)) is None
assert b"nonsense" in error.value, error.value
tracker = tricoil.tricoil_open(b"sim:hand,duration_s=1", b"scaat", error, len(error))
assert tracker, error.value
pose = Pose()
count = 0
while tricoil.tricoil_poll(tracker, pose, 1000) == 1:
    count += 1
tricoil.tricoil_close(tracker)
assert count > 200 and pose.valid, count
assert abs(sum(q * q for q in pose.quaternion_wxyz) - 1) < 1e-9
assert 0 < pose.position_std_m[0] < 0.01 and abs(pose.covariance[0][0] - pose.position_std_m[0] ** 2) < 1e-15
print(f"ctypes: {count} poses, the last at {list(pose.position_m)} m")
