// Rigid transform between two coordinate frames.
#pragma once

#include "core/linear/matrix.hpp"

namespace tricoil::host {

/// v_to = translation_m + rotation v_from.
struct Rigid {
    Mat3<double> rotation = Mat3<double>::Identity();
    Vec3<double> translation_m = Vec3<double>::Zero();
};

}  // namespace tricoil::host
