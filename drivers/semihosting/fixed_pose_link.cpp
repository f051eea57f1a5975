#include "drivers/semihosting/fixed_pose_link.hpp"

#include "core/fixed/pose_line.hpp"

namespace tricoil::semihosting {

Status FixedPoseLink::do_send(const fixed::PoseEstimate& estimate) { return console_.write(fixed::pose_line(estimate).view()); }

}  // namespace tricoil::semihosting
