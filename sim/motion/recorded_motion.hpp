// A recorded trajectory as a smooth motion: repeated samples dropped, zero-phase smoothing, re-timed and re-positioned.
#pragma once

#include <vector>

#include "sim/motion/cubic_spline.hpp"
#include "sim/motion/motion.hpp"

namespace tricoil::sim {

struct RecordedMotionParams {
    double sample_rate_hz = 100;      // of the recording
    double cutoff_hz = 6;             // cutoff of the zero-phase smoothing; the band of hand motion
    double speed = 1;                 // 2: twice as fast
    Vec3<double> place_m{0.9, 0, 0};  // mean position of the motion
};

class RecordedMotion final : public Motion {
public:
    /// Throws std::invalid_argument if a rate is not positive, the cutoff is not below half the sample rate, or fewer than 8
    /// samples differ.
    RecordedMotion(const std::vector<Pose>& recording, const RecordedMotionParams& params);

    [[nodiscard]] double duration_s() const { return spline_.end_s() / speed_; }

private:
    static constexpr int kDimension = 7;  // position, quaternion
    [[nodiscard]] Pose do_at(double time_s) const override;
    CubicSpline<kDimension> spline_;
    double speed_;
};

}  // namespace tricoil::sim
