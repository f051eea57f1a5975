// kappa(t): twice the signal along the assumed line of sight, relative to the signal along the real one; (29) and (37).
#pragma once

#include <cmath>
#include <cstdint>

#include "core/error_model/line_of_sight_step.hpp"

namespace tricoil::error_model {

/// Level of approximation of the formulas.
enum class KappaForm : std::uint8_t {
    exact,  // no approximation: kappa = 3 cos^2(g) - 1 and the matching increments
    paper,  // (29), with (28) and (33)
    two,    // kappa = 2, with (32) and (36)
};

/// kappa = 2 W11 / k = 3 cos^2(g) - 1, from (11) with the exact R of (12) and fixed orientation.
template <typename Scalar>
Scalar kappa_exact(const LineOfSightStep<Scalar>& step) {
    const Scalar cosine = cosine_of_turn(step);
    return 3 * cosine * cosine - 1;
}

/// (29).
template <typename Scalar>
Scalar kappa_paper(const LineOfSightStep<Scalar>& step) {
    const auto square = [](Scalar value) { return value * value; };
    return 2 - 3 * square(std::sin(step.d_elevation_rad)) -
           3 * square(std::cos(step.elevation_rad)) * std::cos(2 * step.d_elevation_rad) * square(std::sin(step.d_azimuth_rad));
}

template <typename Scalar>
Scalar kappa(KappaForm form, const LineOfSightStep<Scalar>& step) {
    switch (form) {
        case KappaForm::exact:
            return kappa_exact(step);
        case KappaForm::paper:
            return kappa_paper(step);
        case KappaForm::two:
            break;
    }
    return Scalar(2);
}

/// e_rho = rho - rho~ (27) = rho (1 - cbrt(2 / kappa)) (37). kappa must be positive; it is positive for steps below 54.7 degrees.
template <typename Scalar>
Scalar range_error(Scalar range_m, Scalar kappa) {
    return range_m * (1 - std::cbrt(2 / kappa));
}

}  // namespace tricoil::error_model
