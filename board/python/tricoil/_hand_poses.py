"""Poses of rests that a hand placed, for `tricoil calibrate converters` without a stage. SciPy is imported by the call."""


def hand_poses(grid, anywhere, out, *, nodes, spacing_mm, hemisphere=(1, 0, 0)) -> dict:
    """Writes rests with their poses, for `tricoil calibrate converters`: a stage is not needed. Of a tracker board in TDM without a stored
    calibration, each file from `tricoil convert --to rests`.

    grid: rests at the nodes of a grid, columns changing fastest, equally many in different attitudes at each. anywhere: rests at all ranges of
    use, in all attitudes. nodes: (columns, rows, levels). spacing_mm: of the nodes. hemisphere: half space of all positions, source frame.

    Three of the nine couplings of a rest do not depend on its pose. Gains and angles of the coils, pick-up, converters and gain steps are fitted to
    these three; then each rest gives its pose, and the grid the scale. Returns rests, misfit (share of the couplings that remains), grid_rms_m
    (distance from the nodes), scale_deviation (relative, of lengths). Raises ValueError that names file and line; OSError if a disk fails."""
    from . import _hand_fit

    return _hand_fit.hand_poses(grid, anywhere, out, nodes, spacing_mm, hemisphere)
