#include "drivers/semihosting/pose_link.hpp"

namespace tricoil::semihosting {

TextLine pose_line(const tracking::PoseEstimate<float>& estimate) {
    const Quat<float>& q = estimate.q_source_sensor;
    TextLine line;
    line.text("pose ").decimal(static_cast<std::int32_t>(estimate.sequence)).text(" ");
    line.decimal(static_cast<std::int32_t>(to_us(estimate.time))).text(" ").hex(estimate.flags.bits(), 3);
    for (const float value :
         {estimate.position_m.x(), estimate.position_m.y(), estimate.position_m.z(), q.w(), q.x(), q.y(), q.z()}) {
        line.text(" ").scientific(value);
    }
    return line.text("\n");
}

}  // namespace tricoil::semihosting
