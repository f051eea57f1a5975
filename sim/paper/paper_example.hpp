// The paper's examples: Table 2 with (40), and the varying orientation (41).
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "core/geometry/angles.hpp"

namespace tricoil::paper {

/// rate(t) = offset + amplitude sin(frequency t), (40), (41). rad/s or m/s; frequency in rad/s.
struct Rate {
    double offset = 0;
    double amplitude = 0;
    double frequency_rad_s = 0;

    [[nodiscard]] double at(double time_s) const;
};

/// Angle rates of (40) use one constant for amplitude and frequency: B + A sin(A t).
constexpr Rate paper_angle_rate(double a_rad_s, double b_rad_s) { return {b_rad_s, a_rad_s, a_rad_s}; }

struct Example {
    std::string name;
    Rate range;  // m/s
    Rate azimuth;
    Rate elevation;
    Rate attitude;  // psi, theta and phi
    geometry::Spherical<double> start{0.5, 0, 0};
};

/// I, II, III, orientation (Fig. 5: fixed position) and IIIo (Fig. 6: III with varying orientation).
const std::vector<std::string>& example_names();

/// Throws std::invalid_argument for a name that is not in example_names().
Example example(std::string_view name);

}  // namespace tricoil::paper
