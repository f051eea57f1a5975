// Errors of the stage that gives the true poses, and of the room around it. They are not part of the tracker.
#pragma once

#include "core/linear/matrix.hpp"

namespace tricoil::host {

/// A stage at position t with rotation R stands at t + (R turning R^T + room) t. All zero: an ideal stage.
struct StageErrors {
    Mat3<double> turning =
        Mat3<double>::Zero();                  // linear in the position as it is in the turning frame: sag, guides not straight
    Mat3<double> room = Mat3<double>::Zero();  // linear in the position in the stage's frame: scales and angles of its axes
    Mat3<double> stray =
        Mat3<double>::Zero();  // uniform field of the surroundings, source frame, coupling units: column per coil

    [[nodiscard]] bool is_ideal() const { return turning.isZero(0) && room.isZero(0) && stray.isZero(0); }
    [[nodiscard]] Vec3<double> position_m(const Vec3<double>& stage_m, const Mat3<double>& rotation) const {
        return stage_m + rotation * (turning * (rotation.transpose() * stage_m)) + room * stage_m;
    }
};

}  // namespace tricoil::host
