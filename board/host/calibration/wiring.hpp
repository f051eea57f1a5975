// Identifies coil and polarity of each channel, including swaps and reversals that keep the handedness.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "core/linear/matrix.hpp"

namespace tricoil::host {

/// Coil (0-2) and sign of each channel.
struct CoilOrder {
    std::array<int, 3> coil{0, 1, 2};
    std::array<int, 3> sign{1, 1, 1};
    [[nodiscard]] Mat3<double> matrix() const;  // channels = matrix * coils
    [[nodiscard]] bool straight() const;
};

struct Wiring {
    CoilOrder sensor;
    CoilOrder source;
    double misfit = 0;         // share of the couplings that the best wiring does not explain
    double second_misfit = 0;  // the same for the second best wiring
    [[nodiscard]] bool is_certain() const { return misfit < 0.3 && second_misfit > 1.5 * misfit + 0.02; }
};

/// Finds the wiring that explains the couplings of a sensor at `direction`, with its axes parallel to the source's: compares all
/// 48 orders and signs of each side with D(u). The direction must differ from every axis and diagonal, because several wirings
/// fit equally well there. Reversal of all six coils has no effect and is never reported. Throws InputError if the direction is
/// zero or too symmetric.
Wiring identify_wiring(const std::vector<Mat3<double>>& frames, const Vec3<double>& direction);

/// "channel 1 = coil 2 reversed, ..." or "straight".
std::string to_text(const CoilOrder& order);

}  // namespace tricoil::host
