"""`tricoil calibrate converters`: as on a stage, with the non-linearity of the board's converters and the errors of its gain steps."""

from . import _calibrate_stage


def run(data, out, blob=None, model="general", fixtures="free", stage=None, fixture=(), wiring=None) -> tuple[dict, str]:
    """What `tricoil calibrate converters --json` prints, and its text. Raises ValueError; OSError if a disk fails."""
    return _calibrate_stage.run(data, out, blob, model, fixtures, stage, fixture, wiring, converters=True)
