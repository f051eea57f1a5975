"""Movement-induced errors: the paper's examples, and the error budget of a pose."""

from numpy.typing import ArrayLike, NDArray

from . import _tricoil
from ._model import _finite, _three


def motion(
    example: str = "III",
    loop: str = "open",
    *,
    form: str = "angles",
    passes: int = 1,
    rate_hz: float = 240.0,
    duration_s: float = 10.0,
) -> NDArray:
    """The previous-measurement technique on a motion of the paper, and the errors that the paper's model predicts.

    example: I, II, III, orientation (Fig. 5) or IIIo (Fig. 6); Table 2 and equations (40), (41). loop: open (as in the paper) or closed
    (as in a device). form: angles (as in the paper) or vectors (without poles; closed loop only). passes: steps per update.

    Returns a structured array of the updates: time_s, range_m, azimuth_rad, elevation_rad (true), e_rho_m, e_alpha_rad and e_beta_rad
    (true minus measured; column 0 measured, column 1 predicted) and position_error_m (3D).
    """
    return _tricoil.motion(example, loop, form, passes, float(rate_hz), float(duration_s))


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
    rotation_rad.
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
