import json
import os
import time
import sys
import types

from rclpy.time import Time


class Publisher:
    def __init__(self, kind, topic):
        self.kind = kind
        self.topic = topic

    def publish(self, message):
        assert type(message) is self.kind
        print(json.dumps({"topic": self.topic, "message": message.as_dict()}), flush=True)


class Clock:
    def now(self):
        return Time(nanoseconds=time.time_ns())


class Node:
    def __init__(self, name):
        assert name.isidentifier()

    def declare_parameter(self, name, default):
        given = json.loads(os.environ.get("STAND_IN_PARAMETERS", "{}"))
        return types.SimpleNamespace(value=given.get(name, default))

    def create_publisher(self, kind, topic, depth):
        assert isinstance(depth, int)
        return Publisher(kind, topic)

    def get_clock(self):
        return Clock()

    def get_logger(self):
        return types.SimpleNamespace(warning=lambda text, throttle_duration_sec: print(text, file=sys.stderr))

    def destroy_node(self):
        pass
