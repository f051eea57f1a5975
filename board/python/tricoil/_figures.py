"""tricoil figures: data and pictures of the paper's figures, of the loops, of the error budget and of metal."""

import glob
import os

import numpy as np

from . import _tricoil
from ._drawing import draw_and_publish
from ._motion import simulated
from ._motion_example import error_csv
from ._output_file import OutputFile
from ._progress import bar
from ._staged_folder import StagedFolder
from ._tdm_experiment import tdm

PLOTTED = {f"fig{number}": example for number, example in enumerate(("I", "II", "III", "III", "orientation", "IIIo"), 1)}
CHANGED = 1 + 1e-13  # Fig. 5 is chaotic
VECTORS = {"loop": "closed", "form": "vectors"}
SIMULATIONS = {
    "fig2_kappa_2": ("II", {"kappa": "two"}),
    **{f"loop_{example}_{loop}": (example, {"loop": loop}) for example in ("I", "II", "III") for loop in ("open", "closed")},
    "loop_III_closed_vectors_1": ("III", VECTORS),
    "loop_III_closed_vectors_2": ("III", {**VECTORS, "passes": 2}),
}
PICTURES = [f"{name}.svg" for name in ("budget", *(f"fig{number}" for number in range(1, 7)), "loops", "metal")]
RADIUS_M = 0.02  # of the sphere beside the coils
SENSOR_M = np.array([0.5, 0, 0])
GENERATED = 20
BUDGET = ("measured_position_rms_mm", "predicted_position_rms_mm", "device_position_rms_mm", "measured_rotation_rms_deg",
          "predicted_rotation_rms_deg", "device_rotation_rms_deg", "position_correlation", "rotation_correlation")


def csv(names, rows):
    """Text of a table; numbers with six digits, words as they are."""
    lines = (",".join(value if isinstance(value, str) else f"{value:.6g}" for value in row) for row in rows)
    return "\n".join((",".join(names), *lines)) + "\n"


def write(folder, name, text):
    with OutputFile(os.path.join(folder, name)) as file:
        file.write(text)
        file.commit()


# The paper


def write_updates(folder, name, example, **options):
    write(folder, f"{name}.csv", error_csv(simulated(example, **options)[0]))


def write_paper(folder):
    """Figures with the equations of the paper: range (37) and elevation (28) with kappa of (29), azimuth (35) with kappa = 2."""
    for name, example in PLOTTED.items():
        write_updates(folder, name, example, kappa="paper", azimuth_kappa="two")
    write_updates(folder, "fig5_changed", PLOTTED["fig5"], kappa="paper", azimuth_kappa="two", attitude_factor=CHANGED)
    for name, (example, options) in SIMULATIONS.items():
        write_updates(folder, name, example, **options)


# The error budget


def motions(hand_motion):
    """Names and arguments of tdm(): the .traj files of a folder, or generated motions."""
    if not hand_motion:
        return [(f"generated{seed}", ("", seed)) for seed in range(1, GENERATED + 1)]
    files = sorted(glob.glob(os.path.join(glob.escape(hand_motion), "*.traj")))
    if not files:
        raise ValueError(f"no .traj files in {hand_motion}; give another folder with --hand-motion")
    return [(os.path.splitext(os.path.basename(file))[0], (file, 0)) for file in files]


def budget_row(errors):
    """Measured, predicted, and predicted from the device's own poses: RMS, and the correlation of the first two. errors: (N, 3, 6)."""
    parts = (1e3 * errors[:, :, :3], np.degrees(errors[:, :, 3:]))
    rms = [np.sqrt(np.mean(np.sum(part**2, axis=2), axis=0)) for part in parts]
    return *rms[0], *rms[1], *(np.corrcoef(part[:, 0].ravel(), part[:, 1].ravel())[0, 1] for part in parts)


def write_budget(folder, hand_motion, show):
    rows = []
    cases = motions(hand_motion)
    for n, (name, arguments) in enumerate(cases):
        show(n / len(cases))
        time_s, errors = tdm(*arguments)
        if n == 0:
            names = ["time_s", *(f"{kind}_{axis}_m" for kind in ("measured", "predicted") for axis in "xyz")]
            lines = (",".join(f"{value:.9g}" for value in (t, *e[0, :3], *e[1, :3])) for t, e in zip(time_s, errors))
            write(folder, "budget_instants.csv", "\n".join((",".join(names), *lines)) + "\n")
        rows.append((name, str(len(time_s)), *budget_row(errors)))
    write(folder, "budget.csv", csv(("motion", "poses", *BUDGET), rows))


# Metal


def write_metal(folder):
    frequency_hz = 100 * 10 ** (0.05 * np.arange(61))
    responses = _tricoil.sphere_response(frequency_hz, RADIUS_M)
    metals = list(responses)
    names = [f"{metal}_{part}" for metal in metals for part in ("in_phase", "quadrature")]
    columns = [part for response in responses.values() for part in (response.real, response.imag)]
    write(folder, "metal_response.csv", csv(("frequency_hz", *names), np.column_stack((frequency_hz, *columns))))
    distance_m = np.arange(0.04, 0.401, 0.01)
    places_m = 0.5 * SENSOR_M + distance_m[:, None] * np.array([0, 0.8, 0.6])
    errors_mm = [1e3 * _tricoil.sphere_errors(metal, RADIUS_M, places_m, SENSOR_M)[:, 0] for metal in metals]
    write(folder, "metal_distance.csv", csv(("distance_m", *(f"{metal}_error_mm" for metal in metals)), np.column_stack((distance_m, *errors_mm))))
    places_m = 0.5 * SENSOR_M + np.random.default_rng(1).uniform(-0.5, 0.5, (1000, 3))
    far = np.minimum(np.linalg.norm(places_m, axis=1), np.linalg.norm(places_m - SENSOR_M, axis=1)) >= 3 * RADIUS_M
    places_m = places_m[far][:240]
    rows = [1e3 * _tricoil.sphere_errors(metal, RADIUS_M, places_m[n::len(metals)], SENSOR_M)[:, ::-1] for n, metal in enumerate(metals)]
    write(folder, "metal_distortion.csv", csv(("distortion_mm", "error_mm"), np.concatenate(rows)))


# The command


def run(out, hand_motion=None, csv_only=False, progress=None) -> dict:
    """The result of `tricoil figures --json`. Raises ValueError, OSError."""
    out = os.path.join(os.fspath(out), "")[:-1] or "/"
    with StagedFolder(out) as staged, bar("figures", progress) as shown:
        show = shown or (lambda share: None)
        write_paper(staged.path)
        show(0.2)
        write_budget(staged.path, hand_motion, lambda share: show(0.2 + 0.3 * share))
        write_metal(staged.path)
        show(0.7)
        tables = sorted(os.listdir(staged.path))
        pictures = [] if csv_only else PICTURES
        if csv_only:
            staged.publish()
        else:
            draw_and_publish(staged, out, pictures)
    return {"pictures": [os.path.join(out, name) for name in pictures], "csv": [os.path.join(out, name) for name in tables]}


def text(result: dict) -> str:
    return "".join(f"{name}\n" for name in result["pictures"] or result["csv"])
