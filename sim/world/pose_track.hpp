// The pose at every ADC sample of a block: the motion is evaluated every 16 samples and interpolated by a cubic through four
// poses.
#pragma once

#include <array>

#include "sim/motion/motion.hpp"

namespace tricoil::sim {

/// At 144 kS/s, 16 samples last 0.11 ms: for a 10 Hz oscillation the cubic's error is below 1e-10 of the amplitude.
class PoseTrack {
public:
    PoseTrack(const Motion& motion, double start_s, double sample_s);

    /// The pose at sample n of the block; n starts at -1 and never decreases.
    Pose at(int n);

private:
    static constexpr int kStride = 16;
    using Point = Matrix<double, 7, 1>;

    [[nodiscard]] Point knot(int index) const;

    const Motion& motion_;
    double start_s_;
    double sample_s_;
    int base_ = 0;                // knots_[1] is at sample base_ * kStride
    std::array<Point, 4> knots_;  // at base - 1 ... base + 2
};

}  // namespace tricoil::sim
