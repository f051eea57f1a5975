// The response of metal to arbitrary coil currents, from its response to sine waves.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "sim/world/metal/metal_set.hpp"

namespace tricoil::virtual_board {

/// The currents of the board are not sine waves, so the field of the metal is written as a sum of R-L loops,
/// D(w) = D_0 + sum of D_p i w T_p / (1 + i w T_p), with fixed time constants T_p and real matrices D_p that fit the response at
/// tones_hz(). Eddy currents are such a sum (Wait 1951). The fit is within 2 % of the largest response for the presets.
class EddyResponse {
public:
    static constexpr std::size_t kPoles = 7;
    static constexpr std::size_t kTerms = kPoles + 1;
    using Terms = std::array<Mat3<double>, kTerms>;  // D_0, D_1 ...

    /// The frequencies that fit() needs.
    static const std::vector<double>& tones_hz();

    EddyResponse();

    /// `fields`: at tones_hz().
    [[nodiscard]] Terms fit(const std::vector<sim::ComplexMat3>& fields) const;

private:
    Eigen::MatrixXd inverse_;  // kTerms x 2 tones
};

/// The part of one coil's current that flows in each R-L loop; the first is the current itself.
class LoopCurrents {
public:
    /// Advances by `step_s`, over which the current's rate of change goes from `before` to `after` linearly.
    void advance(double step_s, double before, double after, double current);
    [[nodiscard]] const std::array<double, EddyResponse::kTerms>& currents() const { return currents_; }
    [[nodiscard]] const std::array<double, EddyResponse::kTerms>& derivatives() const { return derivatives_; }

private:
    std::array<double, EddyResponse::kTerms> currents_{};
    std::array<double, EddyResponse::kTerms> derivatives_{};
};

}  // namespace tricoil::virtual_board
