// Which coil is on which channel, and which way round: also what leaves the handedness of the couplings as it was.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "core/geometry/types.hpp"

namespace tricoil::host {

/// For each channel the coil it carries (0-2) and its sign.
struct CoilOrder {
    std::array<int, 3> coil{0, 1, 2};
    std::array<int, 3> sign{1, 1, 1};
    [[nodiscard]] Mat3<double> matrix() const;  // channels = matrix * coils
    [[nodiscard]] bool straight() const;
};

struct Wiring {
    CoilOrder sensor;
    CoilOrder source;
    double misfit = 0;         // share of the couplings that the best wiring leaves
    double second_misfit = 0;  // that the next best leaves
    [[nodiscard]] bool certain() const { return misfit < 0.3 && second_misfit > 1.5 * misfit + 0.02; }
};

/// The wiring that explains couplings of a sensor held at `direction` with its axes along the source's: all 48 orders and signs
/// of each side against D(u). The direction must be unlike any axis or diagonal, or several wirings look alike. Reversing all six
/// coils changes nothing and is never reported. Throws InputError if the direction is zero or too symmetric.
Wiring identify_wiring(const std::vector<Mat3<double>>& frames, const Vec3<double>& direction);

/// "channel 1 = coil 2 reversed, ..." or "straight".
std::string to_text(const CoilOrder& order);

}  // namespace tricoil::host
