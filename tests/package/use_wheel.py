"""Uses the wheel of a release in a system without the Debian packages of tricoil and of its components."""
import importlib.metadata
import json

import tricoil

poses = [pose for pose in tricoil.open("sim:hand,duration_s=1") if pose.valid]
print(json.dumps({"valid": 1, "position_m": list(poses[0].position_m)}, separators=(",", ":")), flush=True)
assert len(poses) > 200
assert importlib.metadata.version("tricoil") == tricoil.__version__
assert tricoil.run("hand", tracker="scaat", duration_s=1).rms_mm() < 1
try:
    next(iter(tricoil.open("usb:1209:0001")))
except (ValueError, OSError) as error:
    assert "USB" in str(error) and "\n" not in str(error), error
else:
    raise AssertionError("the wheel has no USB, but opens a device on USB")
