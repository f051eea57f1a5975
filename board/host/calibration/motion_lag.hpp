// Quadrature of the couplings that motion causes.
#pragma once

#include <array>

#include "core/linear/matrix.hpp"

namespace tricoil::host {

/// Least squares over frames without metal: the quadratures of source coil i by the rates of the couplings to all source coils.
/// A rate induces a voltage 90 degrees from the carrier's, and leaks from one carrier into the others; how much depends on the
/// carriers and on their phases in the window.
class MotionLag {
public:
    /// The next frame, frame_s after the last one. Columns: source coils. variance: of a coupling's noise.
    void add(const Mat3<double>& in_phase, const Mat3<double>& quadrature, double variance, double frame_s);
    /// The next frame does not follow the last one.
    void restart() { frames_ = 0; }

    /// False if the sensor moved too little, or the device has no quadrature.
    [[nodiscard]] bool is_known() const;
    /// (j, i): of quadratures of source coil i by rates of source coil j.
    [[nodiscard]] Mat3<double> lag_s() const;
    /// Standard deviations, from the residuals. Not finite without motion.
    [[nodiscard]] Mat3<double> sigma_s() const;

private:
    struct Frame {
        Mat3<double> in_phase = Mat3<double>::Zero();
        Mat3<double> quadrature = Mat3<double>::Zero();
    };
    std::array<Frame, 2> before_;  // the newest first
    int frames_ = 0;
    double count_ = 0;
    Mat3<double> rate_rate_ = Mat3<double>::Zero();
    Mat3<double> rate_quadrature_ = Mat3<double>::Zero();
    Vec3<double> quadrature_squared_ = Vec3<double>::Zero();
};

}  // namespace tricoil::host
