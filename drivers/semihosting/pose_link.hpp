// Poses as lines of text on a console.
#pragma once

#include "core/base/text_line.hpp"
#include "hal/console.hpp"
#include "hal/link.hpp"

namespace tricoil::semihosting {

/// "pose SEQUENCE TIME_US FLAGS X Y Z W X Y Z\n". Sequence and time (us): low 32 bits, signed; flags as bits; position in metres;
/// quaternion w x y z.
TextLine pose_line(const tracking::PoseEstimate<float>& estimate);

/// Prints pose_line() of each pose: the function above, or that of the namespace of the estimate. The console must outlive the
/// link.
template <typename Estimate>
class PoseLink final : public hal::EstimateLink<Estimate> {
public:
    explicit PoseLink(hal::Console& console) : console_(console) {}

private:
    Status do_send(const Estimate& estimate) override { return console_.write(pose_line(estimate).view()); }

    hal::Console& console_;
};

}  // namespace tricoil::semihosting
