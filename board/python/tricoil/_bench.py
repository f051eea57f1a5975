"""`tricoil bench`: a tracker on the bench, from its poses alone: rest, pivot, board of known holes, hinge, pendulum."""

import dataclasses
import os
import re
from typing import Any

import numpy as np

from . import _bench_pivot
from ._bench_board import compare
from ._bench_match import match
from ._bench_rest import rest
from ._bench_segments import LEAST_S, Segment, matrices, parse, rests_of_sensor
from ._bench_turn import hinge, is_hinge, pendulum
from ._board import Board, read_board
from ._output_file import refuse_input_as_output, write_whole
from ._poses import READER_OPTIONS, PoseError, Poses, read, refuse_others
from ._whole_file import read_whole

LEAST_FOR_BOARD = 3
LEAST = 20
REFERENCE = "ReferenceToTrackerTransform"  # the name that PlusToolkit gives a sensor on the board


def relative(poses: Poses, to: Poses) -> Poses:
    """Poses in the frame of another sensor, at the times that both have."""
    from ._rotation import rotations, wxyz

    if poses.quaternion_wxyz is None or to.quaternion_wxyz is None:
        raise PoseError(f"{poses.name}: --relative-to needs attitudes")
    _, a, b = np.intersect1d(poses.time_s, to.time_s, return_indices=True)
    if len(a) < 2:
        raise PoseError(f"{poses.name}: --relative-to: the two sensors have no times in common")
    inverse = rotations(to.quaternion_wxyz[b]).inv()
    q = wxyz(inverse * rotations(poses.quaternion_wxyz[a]))
    notes = (*poses.notes, *(f"reference: {note}" for note in to.notes if note not in poses.notes))
    return dataclasses.replace(poses, time_s=poses.time_s[a], position_m=inverse.apply(poses.position_m[a] - to.position_m[b]), quaternion_wxyz=q, notes=notes,
                               deviation=None)


def found_segments(poses: Poses) -> list[Segment]:
    """Rests of the sensor, divots, and the hinge that the moving poses are."""
    rests = rests_of_sensor(poses)
    if poses.quaternion_wxyz is None:
        return rests
    turn = matrices(poses)
    is_moving = np.ones(len(poses), bool)
    for one in rests:
        is_moving[one.rows] = False
    moving = np.flatnonzero(is_moving)
    if len(moving) >= LEAST and is_hinge(turn[moving]):
        return [*rests, Segment(int(moving[0]), int(moving[-1]) + 1, "hinge")]
    divots = _bench_pivot.find(poses)
    return [one for one in rests if not any(one.begin < divot.end and divot.begin < one.end for divot in divots)] + divots


def kind_of(poses: Poses, segment: Segment) -> Segment:
    """The segment with its kind, which is found if it was not given. Raises PoseError."""
    if poses.quaternion_wxyz is None and segment.kind not in ("", "rest"):
        raise PoseError(f"{poses.name}: {segment.kind} needs attitudes; this file has positions only")
    if segment.kind in ("hinge", "pendulum") and len(segment) < LEAST:
        raise PoseError(f"{poses.name}: the {segment.kind} from {poses.time_s[segment.begin] - poses.time_s[0]:g} s has {len(segment)} poses; at least {LEAST} are needed; "
                        "choose a longer one with --segments")
    if segment.kind or poses.quaternion_wxyz is None:
        return dataclasses.replace(segment, kind=segment.kind or "rest")
    turn = matrices(poses)[segment.rows]
    tilts = _bench_pivot.tilts_of(turn)
    kind = "hinge" if len(segment) >= LEAST and is_hinge(turn) else "pivot" if tilts[1] > _bench_pivot.LEAST_TILT_RAD else "rest"
    return dataclasses.replace(segment, kind=kind)


def points_of(rests, pivots, poses, tip_m):
    """Points for the board: divots, or rests of the sensor, or of a tip that is given (sensor frame)."""
    if pivots is not None:
        return pivots.center_m
    if tip_m is None:
        return np.array([poses.position_m[one.rows].mean(axis=0) for one in rests])
    tips = poses.position_m + matrices(poses) @ tip_m
    return np.array([tips[one.rows].mean(axis=0) for one in rests])


def tip_of(text):
    if text is None:
        return None
    try:
        tip = np.array([float(word) for word in (text.split(",") if isinstance(text, str) else text)])
    except (TypeError, ValueError):
        tip = np.zeros(0)
    if tip.shape != (3,) or not np.isfinite(tip).all():
        raise PoseError(f"--tip must be three numbers x,y,z in m; is '{text}'")
    return tip


def analyse(poses: Poses, segments=None, board: Board | None = None, holes=None, tip_m=None) -> dict:
    """As bench(), with PoseError in the program's words."""
    if len(poses) < LEAST:
        raise PoseError(f"{poses.name}: {len(poses)} poses; at least {LEAST} are needed")
    if tip_m is not None and poses.quaternion_wxyz is None:
        raise PoseError(f"{poses.name}: --tip needs attitudes; this file has positions only")
    chosen = [kind_of(poses, one) for one in parse(segments, poses)] if segments else found_segments(poses)
    if not chosen:
        raise PoseError(f"{poses.name}: no rest of the sensor or of a tip for {LEAST_S:g} s, and no hinge, was found; give --segments")
    by_kind = {kind: [one for one in chosen if one.kind == kind] for kind in ("rest", "pivot", "hinge", "pendulum")}
    pivots = _bench_pivot.solve(poses, by_kind["pivot"]) if by_kind["pivot"] else None
    turns = sorted(by_kind["hinge"] + by_kind["pendulum"], key=lambda one: one.begin)
    result: dict[str, Any] = {
        "file": poses.name,
        "poses": len(poses),
        "duration_s": float(poses.time_s[-1] - poses.time_s[0]),
        "rate_hz": float(1 / np.median(np.diff(poses.time_s))),
        "rests": [rest(poses, one) for one in by_kind["rest"]],
        "pivot": None if pivots is None else _bench_pivot.report(poses, pivots),
        "hinges": [{**hinge(poses, one), "pendulum": pendulum(poses, one)} for one in turns],
        "board": None,
        "notes": list(poses.notes),
    }
    if any(one.kind == "pendulum" and found["pendulum"] is None for one, found in zip(turns, result["hinges"])):
        raise PoseError(f"{poses.name}: the segment does not swing as a free pendulum does; choose it with --segments, or call it hinge")
    if board is not None:
        points = points_of(by_kind["rest"], pivots, poses, tip_m)
        if len(points) < LEAST_FOR_BOARD:
            raise PoseError(f"{poses.name}: {len(points)} points for {board.name}; at least {LEAST_FOR_BOARD} rests or divots are needed; give --segments")
        result["board"] = compare(points, board, match(points, board, holes), pivots, poses)
        result["notes"] += board.notes
    return result


def bench(poses: Any, *, board: str | os.PathLike | None = None, segments: str | None = None, holes: str | list[str] | None = None, tip_m=None) -> dict:
    """A tracker on the bench, from its poses alone, without a reference.

    poses: as for motion_error(); or of positions only. Found by itself, or given by segments ("0-10:rest,12-30:pivot", seconds from the first pose;
    kinds rest, pivot, hinge and pendulum): rests of the sensor (jitter, drift), divots in which a tip rests while the pointer tilts (tip,
    its uncertainty, residuals), and motion about one axis (wobble, circle; period of a free pendulum). board: CSV with name, x_mm, y_mm, z_mm, or
    XML of PlusToolkit, of the holes in which the tip, or the sensor (tip_m: with this offset, m, sensor frame), rested: errors of all distances
    (trueness and precision as in ASTM F2554), and the scale or shear that explains them, with its standard deviation. holes: names in the
    order of the points, if they cannot be found.

    Returns the dictionary of `tricoil bench --json`: lengths in m, angles in rad. Raises ValueError if nothing is found, or it contradicts itself.
    """
    from ._command import own_names
    from ._motion_error import as_poses

    try:
        return analyse(as_poses(poses), segments, None if board is None else read_board(os.fspath(board)), holes, tip_of(tip_m))
    except PoseError as error:
        raise ValueError(own_names(str(error), {"--tip": "tip_m"})) from None


def _mm(metres, digits=3):
    return f"{1e3 * metres:.{digits}f}"


def _place(position_m):
    return " ".join(f"{_mm(value, 2):>9}" for value in position_m)


def rest_lines(rests):
    if not rests:
        return []
    lines = ["  rest         from, s    poses  range, m   jitter, mm (x y z, RMS)              deg   drift, mm/min"]
    for one in rests:
        x, y, z = one["jitter_m"]
        angle = f"{np.degrees(one['jitter_rms_rad']):8.4f}" if "jitter_rms_rad" in one else " " * 8
        lines.append(f"          {one['from_s']:12.2f} {one['poses']:8} {one['range_m']:9.3f}   {_mm(x):>7} {_mm(y):>7} {_mm(z):>7} {_mm(one['jitter_rms_m']):>9} {angle}"
                     f"   {_mm(60 * one['drift_m_per_s']):>7} +- {_mm(60 * one['drift_std_m_per_s'])}")
    return lines


def pivot_lines(pivot):
    if pivot is None:
        return []
    tip, std = pivot["tip_m"], pivot["tip_std_m"]
    lines = [f"  tip          {' '.join(_mm(value) for value in tip)} mm in the sensor frame, +- {' '.join(_mm(value) for value in std)} mm",
             f"  pivot        {_mm(pivot['residual_rms_m'], 2)} mm RMS of {pivot['poses']} poses in {len(pivot['divots'])} divots, {pivot['outliers']} outliers left out; "
             f"tilt {np.degrees(pivot['tilt_rad']):.1f} deg RMS",
             "  divot        from, s    poses        x         y         z, mm      +-   residual, mm"]
    for one in pivot["divots"]:
        lines.append(f"          {one['from_s']:12.2f} {one['poses']:8} {_place(one['position_m'])}  {_mm(np.linalg.norm(one['position_std_m']), 2):>6} {_mm(one['residual_rms_m'], 2):>10}")
    return lines


def named(strain):
    """A strain in words: what the tracker measures."""
    value, std = 100 * abs(strain["value"]), 100 * strain["std"]
    digits = 2 if std >= 0.005 else 4
    where = f" (axis {strain['board_axis']} of the board)" if strain["board_axis"] else ""
    if strain["name"].startswith("shear"):
        return f"a shear of {100 * 2 * strain['value']:.{digits}f} +- {2 * std:.{digits}f} % between axes {strain['name'][-2]} and {strain['name'][-1]}"
    direction = "along every axis" if strain["name"] == "scale" else f"on axis {strain['name'][-1]}{where}"
    return f"a scale of {value:.{digits}f} +- {std:.{digits}f} % {direction}: distances are measured too {'long' if strain['value'] > 0 else 'short'}"


def board_lines(board):
    if board is None:
        return []
    d = board["distances"]
    lines = [f"  board        {board['board']}: {len(board['holes'])} points in holes {', '.join(board['holes'][:12])}{', ...' if len(board['holes']) > 12 else ''}",
             f"  distances    {d['pairs']} pairs up to {_mm(d['longest_m'], 1)} mm: trueness {_mm(d['trueness_m'])} +- {_mm(d['trueness_std_m'])} mm, precision {_mm(d['precision_m'])} mm, "
             f"RMS {_mm(d['rms_m'])} mm, at most {_mm(d['max_m'])} mm",
             f"  landmarks    {_mm(board['rms_m'], 2)} mm RMS after the best rigid fit"]
    if board["repeatability_m"] is not None:
        lines.append(f"  repeats      {_mm(board['repeatability_m'])} mm between visits of one hole")
    for strain in board["strains"]:
        lines.append(f"  explained by {named(strain)}")
    if board["strains"]:
        lines.append(f"               left: {_mm(board['explained_rms_m'], 2)} mm RMS")
        if board["tip_without_strain_m"] is not None:
            lines.append(f"               without it the tip is {' '.join(_mm(value) for value in board['tip_without_strain_m'])} mm")
    else:
        lines.append("  scale, shear none is significant")
    if board["tip_shift"] is not None:
        shift = board["tip_shift"]
        lines.append(f"               a tip shifted by {' '.join(_mm(value, 2) for value in shift['tip_m'])} mm (sensor frame) would leave {_mm(shift['rms_m'], 2)} mm; "
                     f"the pivot excludes it by {shift['sigmas']:.0f} standard deviations")
    return lines


def hinge_lines(hinges):
    lines = []
    for one in hinges:
        lines.append(f"  hinge        from {one['from_s']:.2f} s, {one['poses']} poses over {np.degrees(one['turn_rad']):.1f} deg: axis {' '.join(f'{value:.4f}' for value in one['axis'])} "
                     f"+- {np.degrees(one['axis_std_rad']):.3f} deg, wobble {np.degrees(one['wobble_rms_rad']):.3f} deg RMS")
        lines.append(f"               radius {_mm(one['radius_m'], 2)} mm: {_mm(one['radial_rms_m'])} mm RMS from the circle, {_mm(one['axial_rms_m'])} mm along the axis")
        swing = one["pendulum"]
        if swing is not None:
            lines.append(f"  pendulum     period {swing['period_s']:.6f} +- {swing['period_std_s']:.1e} s, damping {swing['damping_per_s']:.5f} +- {swing['damping_std_per_s']:.1e} /s; "
                         f"angle {np.degrees(swing['residual_rms_rad']):.3f} deg RMS from it, {np.degrees(swing['residual_fast_rad']):.3f} where fast, "
                         f"{np.degrees(swing['residual_slow_rad']):.3f} where slow")
    return lines


def text(result: dict) -> str:
    """The result as the program prints it."""
    lines = [f"{result['file']}: {result['poses']} poses, {result['duration_s']:.2f} s, {result['rate_hz']:.1f} Hz"]
    lines += [f"  {note}" for note in result["notes"]]
    lines += rest_lines(result["rests"]) + pivot_lines(result["pivot"]) + board_lines(result["board"]) + hinge_lines(result["hinges"])
    return "\n".join(lines) + "\n"


def points_csv(result: dict) -> str:
    """Divots, or rests if there are none, with their holes and residuals."""
    points = result["pivot"]["divots"] if result["pivot"] else result["rests"]
    board = result["board"]
    lines = ["from_s,to_s,poses,x_m,y_m,z_m,hole,residual_m"]
    for n, one in enumerate(points):
        hole = (board["holes"][n], f"{board['residuals_m'][n]:.9g}") if board else ("", "")
        lines.append(",".join((f"{one['from_s']:.6f}", f"{one['to_s']:.6f}", str(one["poses"]), *(f"{value:.9g}" for value in one["position_m"]), *hole)))
    return "\n".join(lines) + "\n"


def plus_pair(file):
    """Names of the tool and of the reference in a sequence of PlusToolkit that has these two only; otherwise None twice."""
    names = dict.fromkeys(re.findall(rb"^Seq_Frame[0-9]+_(\w+Transform) =", read_whole(file), re.M))
    others = [name.decode() for name in names if name != REFERENCE.encode() and not name.startswith(b"ImageTo")]
    return (others[0], REFERENCE) if REFERENCE.encode() in names and len(others) == 1 else (None, None)


def run(file, board=None, holes=None, segments=None, tip=None, sensor=None, relative_to=None, out=None, **reader) -> tuple[dict, str]:
    """Result and text of the command. Raises PoseError, OSError."""
    refuse_others(reader, READER_OPTIONS, "unknown option of bench")
    if holes and board is None:
        raise PoseError("--holes requires --board")
    refuse_input_as_output({"--out": out}, [file, board])
    known = None if board is None else read_board(os.fspath(board))
    note = None
    if sensor is None and relative_to is None and os.path.isfile(file):
        sensor, relative_to = plus_pair(file)
        note = sensor and f"{sensor} in the frame of {relative_to}; choose others with --sensor and --relative-to"
    poses = read(file, sensor=sensor, **reader)
    if relative_to is not None:
        poses = relative(poses, read(file, sensor=relative_to, **reader))
    if note:
        poses = dataclasses.replace(poses, notes=(*poses.notes, note))
    result = analyse(poses, segments, known, holes, tip_of(tip))
    if out is not None:
        write_whole(out, points_csv(result))
    return result, text(result)
