// Poses as lines of text on a console.
#pragma once

#include "hal/console.hpp"
#include "hal/link.hpp"

namespace tricoil::semihosting {

/// "pose SEQUENCE TIME_US FLAGS X Y Z W X Y Z". Sequence and time (us): low 32 bits, signed; flags as bits; position in metres;
/// quaternion w x y z. The console must outlive the link.
class PoseLink final : public hal::Link<float> {
public:
    explicit PoseLink(hal::Console& console) : console_(console) {}

private:
    Status do_send(const tracking::PoseEstimate<float>& estimate) override;

    hal::Console& console_;
};

}  // namespace tricoil::semihosting
