// Poses as lines of text on a console.
#pragma once

#include "hal/console.hpp"
#include "hal/link.hpp"

namespace tricoil::semihosting {

/// "pose SEQUENCE TIME_US FLAGS X Y Z W X Y Z": position in metres, quaternion w x y z, flags as bits. The console must outlive
/// it.
class PoseLink final : public hal::Link<float> {
public:
    explicit PoseLink(hal::Console& console) : console_(console) {}

private:
    Status do_send(const tracking::PoseEstimate<float>& estimate) override;

    hal::Console& console_;
};

}  // namespace tricoil::semihosting
