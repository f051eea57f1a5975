"""Stand-in for pylsl. An outlet prints its description, then each sample."""

import json
import time


def local_clock():
    return time.monotonic()


class XMLElement:
    def __init__(self):
        self.children = []

    def append_child(self, name):
        child = XMLElement()
        self.children.append((name, child))
        return child

    def append_child_value(self, name, value):
        assert isinstance(value, str)
        self.children.append((name, value))
        return self

    def as_list(self):
        return [[name, value.as_list() if isinstance(value, XMLElement) else value] for name, value in self.children]


class StreamInfo:
    def __init__(self, name, type, channel_count, nominal_srate, channel_format, source_id):  # noqa: A002: as in pylsl
        assert channel_format == "float32" and source_id
        self.count = channel_count
        self.head = {"name": name, "type": type, "rate": nominal_srate}
        self.description = XMLElement()

    def desc(self):
        return self.description


class StreamOutlet:
    def __init__(self, info):
        self.count = info.count
        print(json.dumps({**info.head, "description": info.desc().as_list()}), flush=True)

    def push_sample(self, sample, timestamp):
        assert len(sample) == self.count and all(type(value) is float for value in sample)
        print(json.dumps({"sample": sample, "timestamp": timestamp, "now": local_clock()}), flush=True)
