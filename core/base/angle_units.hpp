// Conversion between radians (used everywhere in the code) and degrees (for input and output).
#pragma once

#include <numbers>

namespace tricoil {

constexpr double kDegrees = 180 / std::numbers::pi;  // degrees in a radian
constexpr double kRadians = std::numbers::pi / 180;  // radians in a degree

}  // namespace tricoil
