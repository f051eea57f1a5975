// Poses of the integer tracker as lines of text on a console.
#pragma once

#include "core/fixed/tracker.hpp"
#include "hal/console.hpp"
#include "hal/link.hpp"

namespace tricoil::semihosting {

/// Prints fixed::pose_line() of each pose. The console must outlive the link.
class FixedPoseLink final : public hal::EstimateLink<fixed::PoseEstimate> {
public:
    explicit FixedPoseLink(hal::Console& console) : console_(console) {}

private:
    Status do_send(const fixed::PoseEstimate& estimate) override;

    hal::Console& console_;
};

}  // namespace tricoil::semihosting
