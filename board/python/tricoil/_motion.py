"""Movement-induced errors: the paper's examples, and the error budget of a pose."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _tricoil
from ._model import COUPLING_CONSTANT, _finite, _three, couplings, solve
from ._progress import bar


PARTS = ("e_rho_m", "e_alpha_rad", "e_beta_rad")
SIMULATED = np.dtype([(name, float) for name in ("time_s", "stamp_us", "range_m", "azimuth_rad", "elevation_rad")] +
                     [(name, float, 3) for name in PARTS] +  # measured, predicted, by exact steps
                     [("e_alpha_rate_rad_s", float, 2)] +  # measured, predicted
                     [(name, float) for name in ("e_psi_rad", "e_theta_rad", "e_phi_rad", "position_error_m", "predicted_position_error_m", "rotation_error_rad")])
UPDATE = np.dtype([(name, float) for name in ("time_s", "range_m", "azimuth_rad", "elevation_rad")] +
                  [(name, float, 2) for name in PARTS] +  # measured, predicted
                  [(name, float) for name in ("e_psi_rad", "e_theta_rad", "e_phi_rad", "position_error_m")])
LARGEST = 1e9  # of the numbers of error_budget()


def has_prediction(form: str, passes: int) -> bool:
    """The angle form's prediction, (19)-(37), holds for one pass; the pole-free form's holds for any number of passes."""
    return form == "vectors" or passes == 1


def simulated(example="", rates=None, start_range_m=0.5, loop="open", form="angles", kappa="exact", azimuth_kappa="", passes=1, update_s=1 / 240,
              duration_s=10.0, start_s=0.0, attitude_factor=1.0, progress=None):
    """Updates of a motion (SIMULATED), and its singular instants as a dictionary, or None; the arguments are those of bind_motion.cpp."""
    rows, singularities = _tricoil.motion(example, rates or {}, start_range_m, loop, form, kappa, azimuth_kappa, passes, update_s, duration_s,
                                          start_s, attitude_factor, progress)
    return rows.view(SIMULATED)[:, 0], singularities


def motion(
    example: str = "III",
    loop: str = "open",
    *,
    form: str = "angles",
    kappa: str = "exact",
    passes: int = 1,
    rate_hz: float = 240.0,
    duration_s: float = 10.0,
    progress: bool | None = None,
) -> NDArray:
    """The previous-measurement technique on a motion of the paper, and the errors that the paper's model predicts.

    example: I, II, III, orientation (Fig. 5) or IIIo (Fig. 6); Table 2 and equations (40), (41). loop: open (as in the paper) or closed
    (as in a device). form: angles (as in the paper) or vectors (without poles; closed loop only). kappa: of the prediction: exact,
    paper (29) or two (the paper's approximation for small steps). passes: steps per update. progress: bar on standard error; None: if
    it is a terminal.

    Returns a structured array of the updates: time_s, range_m, azimuth_rad, elevation_rad (true), e_rho_m, e_alpha_rad and e_beta_rad
    (true minus measured; column 0 measured, column 1 predicted), e_psi_rad, e_theta_rad and e_phi_rad (of azimuth, elevation and roll
    of the attitude, measured) and position_error_m (3D). Angle errors keep whole turns. Ctrl-C raises KeyboardInterrupt.
    """
    if not 1 <= rate_hz <= 1e5:
        raise ValueError("rate_hz must be 1 to 1e5")
    with bar("motion", progress) as show:
        found, _ = simulated(example, loop=loop, form=form, kappa=kappa, passes=passes, update_s=1 / rate_hz, duration_s=float(duration_s), progress=show)
    rows = np.empty(len(found), UPDATE)
    for name in UPDATE.names:
        rows[name] = found[name][:, :2] if name in PARTS else found[name]
        if name in PARTS and not has_prediction(form, passes):
            rows[name][:, 1] = np.nan
    return rows


def _vector(name, value):
    return _finite(name, _three(name, value))


def error_budget(
    position_m: ArrayLike,
    velocity_m_s: ArrayLike = (0, 0, 0),
    angular_rate_rad_s: ArrayLike = (0, 0, 0),
    *,
    noise_ratio: float = 1e-4,
    mux: str = "fdm",
    rate_hz: float = 240.0,
    solver: str = "direct",
    latency_s: float = 0.0,
) -> dict[str, dict[str, float]]:
    """Errors that a motion causes in one pose. All vectors are in the source frame.

    noise_ratio: standard deviation of one coupling, relative to the coupling strength C / rho^3. mux: fdm (coils at once) or tdm (in
    turn). solver: direct, previous or previous-angles. latency_s: from the time of the pose to its use.

    Returns a dictionary of the terms linearization, frame_propagation, skew, blur, latency, noise and total; each has position_m and
    rotation_rad (3D, RMS). With tdm a pose is solved after each column, and the skew depends on the coil that was measured last: the
    terms are the RMS over the three coils.
    """
    numbers = np.array([rate_hz, noise_ratio, latency_s], dtype=float)
    if not (np.all(numbers >= 0) and np.all(numbers <= LARGEST) and rate_hz > 0):
        raise ValueError("rate_hz must be positive; noise_ratio and latency_s zero or more; all at most 1e9")
    if mux not in ("tdm", "fdm"):
        raise ValueError(f"mux must be tdm or fdm; is '{mux}'")
    position = np.array(_vector("position_m", position_m))
    if not position.any():
        raise ValueError("position_m must not be zero")
    motion = np.concatenate((position, (1, 0, 0, 0), _vector("velocity_m_s", velocity_m_s), _vector("angular_rate_rad_s", angular_rate_rad_s), np.zeros(6)))
    ages = np.zeros((1, 3)) if mux == "fdm" else np.array([[2, 1, 0], [0, 2, 1], [1, 0, 2]]) / (3 * rate_hz)  # of each coil, by the newest
    window_s = 1 / rate_hz if mux == "fdm" else 1 / (3 * rate_hz)
    errors = _tricoil.systematic_errors(np.tile(motion, (len(ages), 1)), ages, 1 / rate_hz, window_s, float(latency_s), solver)
    strength = COUPLING_CONSTANT / np.linalg.norm(position) ** 3
    noise = np.diag(solve(couplings(position), 1.0)["covariance"]) * (noise_ratio * strength) ** 2
    terms = {name: errors[:, row] for row, name in enumerate(("linearization", "frame_propagation", "skew", "blur", "latency"))}
    squares = {name: (_squares(term[:, :3]), _squares(term[:, 3:])) for name, term in terms.items()}
    squares["noise"] = (noise[:3].sum(), noise[3:].sum())
    systematic = errors.sum(axis=1)
    squares["total"] = (_squares(systematic[:, :3]) + noise[:3].sum(), _squares(systematic[:, 3:]) + noise[3:].sum())
    return {name: {"position_m": float(np.sqrt(position)), "rotation_rad": float(np.sqrt(rotation))} for name, (position, rotation) in squares.items()}


def _squares(vectors):
    """Mean of the squared lengths."""
    return np.mean(np.sum(vectors**2, axis=1))
