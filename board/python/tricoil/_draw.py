"""Draws the pictures of the program `tricoil` from CSV files in the current folder. _drawing.py starts it, with -I:

_draw.py PICTURE...            for figures and evaluate: names in PICTURES
_draw.py poses.svg UNIT FLAGS  for plot, also poses.png, of the rows in poses.npy; FLAGS: names, separated by commas

Exit status 2: the last line of the standard error is a message for the user. 3: the same, matplotlib is missing.
"""

import csv
import functools
import importlib.util
import itertools
import math
import os
import re
import sys

# Its list of fonts is kept where it is for every program; no folder of settings is read or made.
os.environ["MPLCONFIGDIR"] = os.path.join(os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache"), "matplotlib")
PIXELS_PER_INCH = 96
MOST_POINTS = 4000  # of a curve of poses
SHORTEST_BAR = 0.004  # of the time axis; a shorter one would be invisible
RED, BLUE, GREEN, OCHRE = "#cc0000", "#0044cc", "#008844", "#aa6600"
SENSORS = (BLUE, GREEN, OCHRE, "#882288")
METALS = ("#b87333", "#888888", BLUE, GREEN, "#aa00aa", RED)
CALCULATED = {"color": "black", "ls": "-.", "lw": 1.1}
DOTS = {"color": RED, "ls": "", "marker": "o", "mew": 0}


UNITS_PER_M = {"m": 1, "mm": 1e3, "cm": 1e2, "in": 1 / 0.0254}


def refuse_without_libraries(reason):
    print(f"python3 cannot draw ({reason}): install the package python3-matplotlib", file=sys.stderr)
    sys.exit(3)


def import_libraries():
    """After the check that they are there."""
    global matplotlib, np, Figure, MaxNLocator
    try:
        import matplotlib
        import numpy as np
        from matplotlib.figure import Figure
        from matplotlib.ticker import MaxNLocator
    except ImportError as error:
        refuse_without_libraries(error)


# Parts of pictures


@functools.cache
def table(file):
    """Columns of a CSV file by name, as text."""
    with open(file, newline="", encoding="utf-8") as lines:
        names, *rows = csv.reader(lines)
    return dict(zip(names, zip(*rows)))


def column(file, name):
    """Numbers of a column; an empty field is NaN."""
    return np.array([float(text or "nan") for text in table(file)[name]])


def line(file, x, y, label=None, color=RED, scale=1.0, **style):
    """Arguments of plot() for one curve of a CSV file."""
    return (column(file, x), scale * column(file, y)), {"label": label, "color": color, "lw": 0.9, **style}


def equal(file, name):
    """The line on which both coordinates are equal."""
    return line(file, name, name, "equal", "black", lw=0.8)


def grid(panels, columns, width, height):
    """An empty picture and its axes. width, height: of a panel, pixels."""
    rows = -(-panels // columns)
    figure = Figure(figsize=(columns * width / PIXELS_PER_INCH, rows * height / PIXELS_PER_INCH), layout="constrained")
    return figure, [figure.add_subplot(rows, columns, n + 1) for n in range(panels)]


def panel(axes, title, x, y, curves=(), log="", legend_columns=4):
    """Draws the curves. The legend stands above the data. log: the logarithmic axes."""
    for data, style in curves:
        axes.plot(*data, **style)
    for name in log:
        getattr(axes, f"set_{name}scale")("log")
    labels = len(axes.get_legend_handles_labels()[1])
    if labels:
        axes.legend(loc="lower right", bbox_to_anchor=(1, 1), ncol=min(labels, legend_columns), borderaxespad=0.1)
    axes.set_title(title, pad=6 + 13 * math.ceil(labels / legend_columns))
    axes.set(xlabel=x, ylabel=y)


# Figures of the paper, and our own


def errors(file, title, symbol, name, color=RED, calculated="Calculated", measured="Measured", more=()):
    """Arguments of panel(): a measured error and its calculation."""
    unit = re.search("(?<=_)(m|rad|rad_s)$", name)[0].replace("_", "/")
    curves = [line(file, "time_s", name, measured, color), line(file, "time_s", f"predicted_{name}", calculated, **CALCULATED)]
    return title, "Time (s)", f"${symbol}$ ({unit})", [*curves, *more]


def paper_figure(*panels):
    figure, axes = grid(len(panels), 1, 640, 260)
    for one, arguments in zip(axes, panels):
        panel(one, *arguments)
    return figure


def line_of_sight(file, color=RED):
    """Range, azimuth and elevation."""
    return (errors(file, "(a) Range error", "e_ρ", "e_rho_m", color), errors(file, "(b) Azimuth error", "e_α", "e_alpha_rad", color),
            errors(file, "(c) Elevation error", "e_β", "e_beta_rad", color))


def fig1():
    return paper_figure(*line_of_sight("fig1.csv")[:2])


def fig2():
    """Also shows the calculation with kappa = 2, which Fig. 2(b) most likely shows: the paper's two curves differ, ours do not."""
    kappa_2 = line("fig2_kappa_2.csv", "time_s", "predicted_e_beta_rad", "Calculated, κ = 2", BLUE)
    return paper_figure(line_of_sight("fig2.csv")[0], errors("fig2.csv", "(b) Elevation error", "e_β", "e_beta_rad", more=[kappa_2]))


def fig3():
    return paper_figure(*line_of_sight("fig3.csv"))


def fig4():
    """Close to a pole the rate exceeds 10,000 rad/s. The axis is limited, so that the other values are visible."""
    figure, (axes,) = grid(1, 1, 720, 360)
    panel(axes, *errors("fig4.csv", "Error of the azimuth rate, example III", r"e_{dα/dt}", "e_alpha_rate_rad_s"))
    axes.set_ylim(-2000, 2000)
    return figure


def fig5():
    """Two runs: the orientation errors are chaotic."""
    def orientation(title, symbol, name):
        return (title, "Time (s)", f"${symbol}$ (rad)", [line("fig5.csv", "time_s", name, "Measured"),
                                                         line("fig5_changed.csv", "time_s", name, "Rates 1e-13 larger", **CALCULATED)])
    return paper_figure(orientation("(a) Orientation: azimuth error", "e_ψ", "e_psi_rad"),
                        orientation("(b) Orientation: elevation error", "e_θ", "e_theta_rad"),
                        orientation("(c) Orientation: roll error", "e_φ", "e_phi_rad"))


def fig6():
    """Also shows the measured error at fixed orientation of Fig. 3(b), in red."""
    ranges, _, elevation = line_of_sight("fig6.csv", BLUE)
    fixed = line("fig3.csv", "time_s", "e_alpha_rad", "Measured, fixed orientation")
    return paper_figure(ranges, errors("fig6.csv", "(b) Azimuth error", "e_α", "e_alpha_rad", BLUE, measured="Measured, varying orientation",
                                       more=[fixed]), elevation)


def loops():
    """Open and closed loop, examples I, II and III."""
    figure, axes = grid(6, 2, 560, 280)
    cases = [(example, symbol, name, loop) for example, symbol, name in (("I", "e_α", "e_alpha_rad"), ("II", "e_β", "e_beta_rad"))
             for loop in ("open", "closed")]
    for one, (example, symbol, name, loop) in zip(axes, cases):
        panel(one, *errors(f"loop_{example}_{loop}.csv", f"Example {example}, {loop} loop", symbol, name, calculated="Calculated, exact κ"))
    def position(file, label, color):
        return line(file, "time_s", "position_error_m", label, color, 1e3)
    closed = [("", "angle form", RED), ("_vectors_1", "pole-free", BLUE), ("_vectors_2", "pole-free, 2 passes", GREEN)]
    for one, loop, curves in ((axes[4], "open", closed[:1]), (axes[5], "closed", closed)):
        panel(one, f"Example III, {loop} loop", "Time (s)", "|position error| (mm)",
              [position(f"loop_III_{loop}{form}.csv", label, color) for form, label, color in curves], "y")
        one.set_ylim(1e-6, 1e5)
    return figure


def budget():
    """Comparison of error budget and simulation."""
    figure, axes = grid(3, 1, 720, 320)
    for one, title, unit, name in ((axes[0], "Position", "mm", "position_rms_mm"), (axes[1], "Orientation", "deg", "rotation_rms_deg")):
        motions = line("budget.csv", f"measured_{name}", f"predicted_{name}", "one motion", **DOTS, ms=4)
        panel(one, f"{title}, TDM 240 Hz", f"Simulated RMS ({unit})", f"Predicted RMS ({unit})", [motions, equal("budget.csv", f"measured_{name}")])
    curves = [line("budget_instants.csv", "time_s", "measured_z_m", "Simulated", RED, 1e3),
              line("budget_instants.csv", "time_s", "predicted_z_m", "Predicted", scale=1e3, **CALCULATED)]
    panel(axes[2], f"Motion {table('budget.csv')['motion'][0]}, z: direct solution of each column with the previous two", "Time (s)", "z error (mm)",
          [((data[0][shown], data[1][shown]), style) for data, style in curves for shown in [(data[0] >= 0.5) & (data[0] <= 0.6)]])
    axes[2].set_xlim(0.5, 0.6)
    return figure


def metal():
    """Metal near the coils: response of a sphere by frequency, position error by distance, position error and distortion figure."""
    figure, axes = grid(4, 2, 560, 320)
    def of_metals(file, x, value):
        names = [name.removesuffix(f"_{value}") for name in table(file) if name.endswith(f"_{value}")]
        return [line(file, x, f"{name}_{value}", name, color) for name, color in zip(names, itertools.cycle(METALS))]
    sphere = "sphere of 40 mm diameter"
    for one, part, value in ((axes[0], "In phase (perfect conductor: -1)", "in_phase"), (axes[1], "Quadrature", "quadrature")):
        panel(one, f"{part}, {sphere}", "Frequency (Hz)", "Moment, relative", of_metals("metal_response.csv", "frequency_hz", value), "x", 3)
    panel(axes[2], f"Resting sensor at 0.5 m, 10 kHz, {sphere} beside the middle", "Distance from the line source to sensor (m)",
          "Position error (mm)", of_metals("metal_distance.csv", "distance_m", "error_mm"), "y", 3)
    file = "metal_distortion.csv"
    panel(axes[3], "The same sphere at 240 random places, all metals", "Distortion figure (mm)", "Position error (mm)",
          [line(file, "distortion_mm", "error_mm", "one place", **DOTS, ms=3), equal(file, "distortion_mm")], "xy")
    return figure


# Errors against ground truth


def error_vectors():
    """Error vectors over the workspace in three views. The largest is drawn at most 20 mm long."""
    file = "pose_errors.csv"
    largest = max(1e-6, *np.sqrt(sum(column(file, f"e{axis}_mm") ** 2 for axis in "xyz")))
    power = 10 ** math.floor(math.log10(20 / largest))
    magnification = max(1, math.floor(20 / largest / power)) * power  # with one significant digit
    figure, axes = grid(3, 3, 520, 480)
    for one, (x, y) in zip(axes, ("xy", "xz", "yz")):
        places = np.array([column(file, f"{axis}_mm") for axis in (x, y)])
        vectors = magnification * np.array([column(file, f"e{axis}_mm") for axis in (x, y)])
        one.quiver(*places, *vectors, angles="xy", scale_units="xy", scale=1, color=RED, width=0.003)
        panel(one, f"Error vectors, drawn x{magnification:g}; viewed along the third axis", f"{x} (mm)", f"{y} (mm)")
        one.update_datalim((places + vectors).T)
        one.set_aspect("equal")
        one.autoscale_view()
    return figure


def bins(values, by, count=14):
    """Places, medians and quartiles of values in bins of equally many poses."""
    order = np.array_split(np.argsort(by, kind="stable"), min(count, max(1, len(by) // 20)))
    return np.array([(np.median(by[part]), *np.percentile(values[part], (50, 25, 75))) for part in order]).T


def dynamic_errors():
    """Measured and predicted errors of a moving sensor: medians with quartiles, and what the prediction leaves."""
    file = "dynamic_errors.csv"
    used = column(file, "outlier") == 0
    figure, axes = grid(4, 2, 560, 300)
    for one, (name, by) in zip(axes, (("speed_m_s", "Speed (m/s)"), ("angular_rate_rad_s", "Angular rate (rad/s)"), ("range_m", "Distance from the source (m)"))):
        for values, label, color in (("position_error_mm", "measured", RED), ("predicted_error_mm", "predicted", BLUE), ("left_mm", "left", GREEN)):
            x, middle, low, high = bins(column(file, values)[used], column(file, name)[used])
            one.fill_between(x, low, high, color=color, alpha=0.2, lw=0)
            one.plot(x, middle, color=color, label=label, lw=1.1, marker="o", ms=2.5)
        panel(one, f"Position error against {by.split(' (')[0].lower()}", by, "Median, quartiles (mm)")
    measured = np.concatenate([column(file, f"measured_{axis}_mm")[used] for axis in "xyz"])
    predicted = np.concatenate([column(file, f"predicted_{axis}_mm")[used] for axis in "xyz"])
    x, middle, low, high = bins(measured, predicted)
    axes[3].fill_between(x, low, high, color=RED, alpha=0.2, lw=0)
    axes[3].plot(x, middle, color=RED, label="measured", lw=1.1, marker="o", ms=2.5)
    axes[3].plot(x, x, color="black", label="equal", lw=0.8)
    panel(axes[3], "Components: measured against predicted", "Predicted (mm)", "Median, quartiles (mm)")
    return figure


# Poses


def reduced(poses):
    """At most MOST_POINTS rows, each for several poses: the first valid position, and the largest deviation and error."""
    step = -(-len(poses) // MOST_POINTS)
    missing = np.full((-len(poses) % step, poses.shape[1]), np.nan)
    parts = np.concatenate((poses, missing)).reshape(-1, step, poses.shape[1])
    valid = parts[:, :, 1] == 1
    rows = parts[np.arange(len(parts)), np.argmax(valid, axis=1)].copy()
    rows[:, 0] = parts[:, 0, 0]
    rows[:, 6:] = np.fmax.reduce(np.where(valid[:, :, None], parts[:, :, 6:], np.nan), axis=1)
    return rows


def limits(low, high, shortest):
    """Limits of an axis with a margin, at least `shortest` apart, so that a path along a line has a readable scale."""
    half = 0.55 * max(high - low, shortest)
    return (low + high) / 2 - half, (low + high) / 2 + half


def flag_bars(axes, sensors, flags, time_range):
    """Intervals in which flags are set; one line for each flag of each sensor that has it."""
    names = []
    shortest = SHORTEST_BAR * (time_range[1] - time_range[0])
    for (bit, flag), (sensor, poses) in itertools.product(enumerate(flags), sensors.items()):
        is_set = np.concatenate(([0], poses[:, 2].astype(int) >> bit & 1, [0]))
        begins, ends = np.flatnonzero(np.diff(is_set) == 1), np.flatnonzero(np.diff(is_set) == -1)
        times = poses[:, 0]
        bars = []  # begin and end
        for begin, end in zip(times[begins], times[np.minimum(ends, len(times) - 1)]):
            if bars and begin <= bars[-1][1]:
                begin, _ = bars.pop()
            bars.append((begin, max(end, begin + shortest)))
        if bars:
            axes.broken_barh([(begin, end - begin) for begin, end in bars], (len(names) - 0.3, 0.6), color=OCHRE, lw=0)
            names.append(flag + (f", sensor {sensor}" if len(sensors) > 1 else ""))
    axes.set_yticks(range(len(names)), names)
    axes.set_ylim(max(len(names), 1) - 0.3, -0.7)
    if not names:
        axes.text(0.5, 0.5, "none", transform=axes.transAxes, ha="center")
    panel(axes, "Flags", "Time (s)", "")


def poses_picture(unit, flags):
    """Path from above and from the side, position error or standard deviation, and flags over time. Rows of poses.npy: sensor, time_s, valid,
    flags, x, y, z, standard deviation and error, NaN if unknown."""
    rows = np.load("poses.npy")
    sensors = {int(sensor): rows[rows[:, 0] == sensor, 1:] for sensor in np.unique(rows[:, 0])}
    units_per_m = UNITS_PER_M[unit]
    curves = {sensor: reduced(poses) for sensor, poses in sensors.items()}
    every = np.concatenate(list(sensors.values()))
    lows, highs = np.nanmin(every[:, 3:6], axis=0), np.nanmax(every[:, 3:6], axis=0)
    shortest = max(0.01 * units_per_m, 0.4 * max(highs - lows))
    of_valid = every[every[:, 1] == 1]
    has_deviation, has_error = np.any(of_valid[:, 6:] > 0, axis=0)
    time_range = every[:, 0].min(), max(every[:, 0].max(), every[:, 0].min() + 1e-3)
    figure, axes = grid(3 + (has_deviation or has_error), 2, 560, 340)

    def label(sensor, what=""):
        return ", ".join(filter(None, (what, f"sensor {sensor}" if len(sensors) > 1 else ""))) or None

    for one, title, vertical in ((axes[0], "Path from above", 1), (axes[1], "Path from the side", 2)):
        panel(one, title, f"x ({unit})", f"{'xyz'[vertical]} ({unit})",
              [((rows[:, 3], rows[:, 3 + vertical]), {"label": label(sensor), "color": SENSORS[sensor], "lw": 0.9, "gid": f"path{vertical}_{sensor}"})
               for sensor, rows in curves.items()])
        one.set(xlim=limits(lows[0], highs[0], shortest), ylim=limits(lows[vertical], highs[vertical], shortest), aspect="equal")
        one.xaxis.set_major_locator(MaxNLocator(5, steps=(1, 2, 5, 10)))
    if len(axes) == 4:
        lines = []
        for sensor, rows in curves.items():
            if has_error:
                color = RED if sensor == 0 else SENSORS[sensor]
                lines.append(((rows[:, 0], 1e3 * rows[:, 7]), {"label": label(sensor, "error"), "color": color, "lw": 0.8}))
            if np.any(rows[:, 6] > 0):
                lines.append(((rows[:, 0], 1e3 / units_per_m * rows[:, 6]), {"label": label(sensor, "standard deviation"), "color": SENSORS[sensor],
                                                                             "lw": 1.1, "ls": "--" if has_error else "-"}))
        title = "Position error and standard deviation (3D)" if has_error else "Standard deviation of the position (3D)"
        panel(axes[2], title, "Time (s)", "mm", lines, "y", 2)
        axes[2].set_xlim(time_range)
    flag_bars(axes[-1], sensors, flags, time_range)
    axes[-1].set_xlim(time_range)
    return figure


PICTURES = {f"{make.__name__}.svg": make for make in (fig1, fig2, fig3, fig4, fig5, fig6, loops, budget, metal, error_vectors, dynamic_errors)}


def main():
    for package in ("matplotlib", "numpy"):
        if importlib.util.find_spec(package) is None:
            refuse_without_libraries(f"No module named '{package}'")
    if sys.argv[1].startswith("poses."):
        picture, unit, flags = sys.argv[1:]
        pictures = {picture: functools.partial(poses_picture, unit, flags.split(","))}
    else:
        pictures = {name: PICTURES[name] for name in sys.argv[1:]}
    import_libraries()
    # Of the user's settings nothing is used, so a picture is always the same.
    matplotlib.rcdefaults()
    matplotlib.rcParams.update({
        "axes.axisbelow": True, "axes.grid": True, "axes.spines.right": False, "axes.spines.top": False, "axes.titlesize": 9.75,
        "axes.xmargin": 0.02, "figure.constrained_layout.h_pad": 0.08, "figure.constrained_layout.w_pad": 0.08, "font.size": 9.5,
        "grid.color": "#dddddd", "legend.fontsize": 9, "legend.frameon": False, "legend.handlelength": 1.6, "svg.fonttype": "none",
        "svg.hashsalt": "tricoil"})
    for name, make in pictures.items():
        make().savefig(name, dpi=PIXELS_PER_INCH, metadata={"Date": None, "Creator": None} if name.endswith(".svg") else None)


if __name__ == "__main__":
    try:
        main()
    except OSError as error:
        print(f"{error.filename}: cannot be read or written ({error.strerror})", file=sys.stderr)
        sys.exit(2)
