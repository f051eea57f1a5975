// A pose as a line of text with exact numbers.
#pragma once

#include "core/base/text_line.hpp"
#include "core/fixed/tracker.hpp"

namespace tricoil::fixed {

/// "pose SEQUENCE TIME_US FLAGS X Y Z W X Y Z NOISE MISFIT\n". Sequence and time (us): low 32 bits, signed. Numbers in their
/// stored units: position in 2^-28 m, quaternion and misfit share in 2^-30, noise share in 2^-31.
inline TextLine pose_line(const PoseEstimate& estimate) {
    TextLine line;
    line.text("pose ").decimal(static_cast<std::int32_t>(estimate.sequence)).text(" ");
    line.decimal(static_cast<std::int32_t>(to_us(estimate.time))).text(" ").hex(estimate.flags.bits(), 3);
    const Vec3<Metres>& p = estimate.position_m;
    const Quaternion& q = estimate.q_source_sensor;
    for (const std::int32_t raw : {p(0).raw(), p(1).raw(), p(2).raw(), q.w.raw(), q.x.raw(), q.y.raw(), q.z.raw(),
                                   estimate.noise_share.raw(), estimate.misfit_share.raw()}) {
        line.text(" ").decimal(raw);
    }
    return line.text("\n");
}

}  // namespace tricoil::fixed
