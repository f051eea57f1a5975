"""Movement-induced errors: the paper's examples, and the error budget of a pose."""

from numpy.typing import ArrayLike, NDArray

from . import _tricoil
from ._model import _finite, _three
from ._progress import bar


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
    with bar("motion", progress) as show:
        return _tricoil.motion(example, loop, form, kappa, passes, float(rate_hz), float(duration_s), show)


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
    return _tricoil.error_budget(
        _vector("position_m", position_m),
        _vector("velocity_m_s", velocity_m_s),
        _vector("angular_rate_rad_s", angular_rate_rad_s),
        float(noise_ratio),
        mux,
        float(rate_hz),
        solver,
        float(latency_s),
    )
