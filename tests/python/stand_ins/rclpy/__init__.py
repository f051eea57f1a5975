"""Stand-in for rclpy. Parameters come from the environment variable STAND_IN_PARAMETERS (JSON)."""

_state = {"ok": False, "spins": 0}


def init():
    assert not _state["ok"]
    _state["ok"] = True


def ok():
    return _state["ok"]


def spin_once(node, timeout_sec=None):
    assert timeout_sec == 0
    _state["spins"] += 1


def try_shutdown():
    assert _state["spins"] > 0
    _state["ok"] = False
