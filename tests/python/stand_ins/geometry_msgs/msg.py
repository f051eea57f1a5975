"""Stand-ins for ROS 2 messages: fixed fields with fixed types."""

import numpy as np


class Message:
    FIELDS = {}

    def __init__(self):
        for name, kind in self.FIELDS.items():
            object.__setattr__(self, name, kind())

    def __setattr__(self, name, value):
        kind = self.FIELDS[name]  # KeyError: no such field
        if kind is Covariance:
            assert isinstance(value, np.ndarray) and value.shape == (36,) and value.dtype == np.float64
        else:
            assert isinstance(value, kind), f"{name}: {type(value)} instead of {kind}"
        object.__setattr__(self, name, value)

    def as_dict(self):
        return {name: plain(getattr(self, name)) for name in self.FIELDS}


def plain(value):
    """As JSON has it."""
    if isinstance(value, Message):
        return value.as_dict()
    return [plain(part) for part in value] if isinstance(value, (np.ndarray, list, bytes)) else value


class Covariance:
    def __new__(cls):
        return np.zeros(36)



class Header(Message):
    FIELDS = {"stamp": Message, "frame_id": str}


class Point(Message):
    FIELDS = {"x": float, "y": float, "z": float}


class Quaternion(Message):
    FIELDS = {"x": float, "y": float, "z": float, "w": float}


class Pose(Message):
    FIELDS = {"position": Point, "orientation": Quaternion}


class PoseWithCovariance(Message):
    FIELDS = {"pose": Pose, "covariance": Covariance}


class PoseWithCovarianceStamped(Message):
    FIELDS = {"header": Header, "pose": PoseWithCovariance}


class Transform(Message):
    FIELDS = {"translation": Point, "rotation": Quaternion}


class TransformStamped(Message):
    FIELDS = {"header": Header, "child_frame_id": str, "transform": Transform}
