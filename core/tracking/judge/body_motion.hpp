// Limits of the motion of a hand-held body, common to all trackers.
#pragma once

namespace tricoil::tracking {

/// Fastest motion of a body that trackers accept. Recorded hands reach 2 m/s and 15 rad/s, the paper's example III 45 m/s. A
/// tracker of simultaneous columns cannot distinguish a rotation rate of 2 pi times the frame rate (1,508 rad/s at 240 Hz) from
/// rest, so the limit is far below that.
constexpr double kMaxBodySpeed_m_s = 60;
constexpr double kMaxBodyRate_rad_s = 300;

}  // namespace tricoil::tracking
