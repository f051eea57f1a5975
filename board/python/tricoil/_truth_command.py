"""tricoil truth: files, result, text, CSV and picture."""

import numpy as np
from scipy.spatial.transform import Rotation

from . import _chain, _inertial
from ._dynamic import number
from ._ground_truth import Truth
from ._output_file import refuse_input_as_output, write_all
from ._picture import check_picture, picture
from ._poses import READER_OPTIONS, PoseError, read, refuse_others
from ._truth import fused


def numbers(name, text, count):
    """Numbers of an option with commas, or None."""
    if text is None:
        return None
    try:
        values = np.array([float(word) for word in (text.split(",") if isinstance(text, str) else text)])
    except ValueError:
        values = np.zeros(0)
    if values.shape != (count,) or not np.isfinite(values).all():
        raise PoseError(f"--{name} must be {count} numbers; is '{text}'")
    return values


def inputs(files, imu, joints, chain, link, reader):
    """Streams of poses, and the inertial sensor or None."""
    if (joints is None) != (chain is None):
        raise PoseError("--joints and --chain are needed together")
    if link is not None and chain is None:
        raise PoseError("--link: only with --chain")
    if reader.get("rate_hz") is not None:
        reader = {**reader, "rate_hz": number("--rate-hz", reader["rate_hz"])}
    streams = [read(one, **reader) for one in files]
    if joints is not None:
        streams.append(_chain.joint_poses(_chain.read_chain(chain, link), joints))
    if not streams:
        raise PoseError("truth needs a file of poses, or --joints with --chain")
    return streams, None if imu is None else _inertial.read(imu, reader.get("time_unit"))


def truth_of(files, imu=None, joints=None, chain=None, link=None, lever=None, mount=None, same_clock=False, **reader) -> Truth:
    """As fused(), of files. Raises PoseError, OSError."""
    refuse_others(reader, READER_OPTIONS, "unknown option of truth")
    if imu is None:
        for name, value in (("lever", lever), ("mount", mount), ("same-clock", same_clock or None)):
            if value is not None:
                raise PoseError(f"--{name}: only with --imu")
    q = numbers("mount", mount, 4)
    if q is not None and abs(np.linalg.norm(q) - 1) > 0.01:
        raise PoseError(f"--mount: the quaternion has length {np.linalg.norm(q):.3f}, not 1")
    streams, inertial = inputs(files, imu, joints, chain, link, reader)
    return fused(streams, inertial, numbers("lever", lever, 3), None if q is None else Rotation.from_quat(q[[1, 2, 3, 0]]), bool(same_clock))


def summary(truth: Truth) -> dict:
    """The result of `tricoil truth --json`."""
    variance = np.diagonal(truth.covariance, axis1=1, axis2=2)
    has_turn = truth.poses.quaternion_wxyz is not None

    def deviation(rows, part):
        return float(np.sqrt(variance[rows][:, part].sum(axis=1).mean())) if rows.any() else None

    every = np.ones(len(variance), bool)
    return {
        "poses": len(variance), "bridged": int(truth.is_bridged.sum()), "begin_s": float(truth.poses.time_s[0]), "end_s": float(truth.poses.time_s[-1]),
        "position_deviation_m": deviation(every, slice(0, 3)), "rotation_deviation_rad": deviation(every, slice(3, 6)) if has_turn else None,
        "bridged_position_deviation_m": deviation(truth.is_bridged, slice(0, 3)),
        "bridged_rotation_deviation_rad": deviation(truth.is_bridged, slice(3, 6)) if has_turn else None,
        "max_position_deviation_m": float(np.sqrt(variance[:, :3].sum(axis=1).max())), "max_speed_m_s": float(np.linalg.norm(truth.velocity_m_s, axis=1).max()),
        "streams": truth.streams, "inertial": truth.inertial, "notes": list(truth.poses.notes),
    }


def _of(metres, radians):
    return f"{1e3 * metres:.4f} mm" + ("" if radians is None else f", {np.degrees(radians):.4f} deg")


def text(r: dict) -> str:
    """The result as lines."""
    lines = [f"{r['poses']} poses, {r['begin_s']:.3f} to {r['end_s']:.3f} s; {r['bridged']} of them between those of the files",
             f"  deviation    {_of(r['position_deviation_m'], r['rotation_deviation_rad'])} RMS (3D), at most {1e3 * r['max_position_deviation_m']:.4f} mm"]
    if r["bridged"]:
        lines.append(f"  bridged      {_of(r['bridged_position_deviation_m'], r['bridged_rotation_deviation_rad'])} RMS (3D)")
    first, *others = r["streams"]
    lines.append(f"  {first['file']}: {first['poses']} poses; noise of one axis {_of(first['noise_m'], first['noise_rad'])}; "
                 f"smooth error, part of the path, {_of(first['smooth_error_m'], first['smooth_error_rad'])}")
    lines += [f"  {one['file']}: {one['poses']} poses, {1e3 * one['difference_m']:.3f} mm from the first; clock {1e3 * one['clock_offset_s']:+.3f} ms, "
              f"{one['clock_rate_ppm']:+.1f} ppm; scale {one['scale_factor']:.5f}" for one in others]
    if imu := r["inertial"]:
        gravity = "" if imu["gravity_m_s2"] is None else f"; gravity {imu['gravity_m_s2']:.4f} m/s2"
        lever = ", ".join(f"{1e3 * v:.1f}" for v in imu["lever_m"])
        lines += [f"  {imu['file']}: clock {1e3 * imu['clock_offset_s']:+.3f} ms{gravity}",
                  f"    in the body: at {lever} mm, attitude {', '.join(f'{v:.5f}' for v in imu['mount_wxyz'])}"]
        for name, key, unit in (("accelerometer", "acc", "m/s2"), ("gyroscope", "gyro", "rad/s")):
            bias = imu["acc_bias_m_s2" if key == "acc" else "gyro_bias_rad_s"]
            if bias is not None:
                lines.append(f"    {name}: bias {', '.join(f'{v:+.4f}' for v in bias)} {unit}; noise {imu[key + '_noise']:.2g} {unit}/sqrt(Hz)")
    return "\n".join([*lines, *(f"  note: {note}" for note in r["notes"])]) + "\n"


def csv_text(truth: Truth) -> str:
    """The path as CSV: poses with deviations, velocities, and 1 where it is bridged."""
    poses, has_turn = truth.poses, truth.poses.quaternion_wxyz is not None
    deviations = np.sqrt(np.diagonal(truth.covariance, axis1=1, axis2=2))
    names = ["time_s", "x_m", "y_m", "z_m", *(["qw", "qx", "qy", "qz"] if has_turn else []), "std_x_m", "std_y_m", "std_z_m",
             *(["std_rx_rad", "std_ry_rad", "std_rz_rad"] if has_turn else []), "v_x_m_s", "v_y_m_s", "v_z_m_s",
             *(["w_x_rad_s", "w_y_rad_s", "w_z_rad_s"] if has_turn else []), "bridged"]
    parts = [poses.position_m, deviations, truth.velocity_m_s]
    if has_turn:
        parts = [poses.position_m, poses.quaternion_wxyz, deviations, truth.velocity_m_s, truth.rate_rad_s]
    else:
        parts[1] = deviations[:, :3]
    lines = [",".join(names)]
    for time_s, row, is_bridged in zip(poses.time_s, np.hstack(parts), truth.is_bridged):
        lines.append(f"{time_s:.9f}," + ",".join(f"{value:.9g}" for value in row) + f",{int(is_bridged)}")
    return "\n".join(lines) + "\n"


def run(files, out=None, plot=None, **options):
    """Result as `--json` prints it, and the path. Raises PoseError, OSError."""
    check_picture(plot)
    refuse_input_as_output({"--out": out, "--plot": plot}, [*files, *(options.get(name) for name in ("imu", "joints", "chain"))])
    truth = truth_of(files, **options)
    contents: dict[str, str | bytes] = {} if out is None else {out: csv_text(truth)}
    if plot is not None:
        from . import plot as drawing

        contents[plot] = picture(plot, drawing.truth(truth))
    write_all(contents)
    return summary(truth), truth
