// Ratio and phase of the low band's couplings without metal, and the quadrature that motion causes.
#pragma once

#include <array>

#include "core/linear/matrix.hpp"

namespace tricoil::host {

/// Least squares over means of simultaneous columns of both bands, for each coupling: low band over in-phase high band. The ratio
/// does not depend on the pose, so the sensor may move. Motion causes a quadrature, so only means at rest give phases. Errors of
/// a low coupling do not depend on its size. A mean over a whole number of mains cycles contains no hum.
class BandRatio {
public:
    /// `window`: columns of each mean.
    explicit BandRatio(int window) : window_(window) {}

    /// Couplings of the sensor coils to source coil j at the same time: high band in phase, low band in phase and in quadrature.
    void add(int j, const Vec3<double>& high, const Vec3<double>& low, const Vec3<double>& low_quadrature);
    /// Begins a new mean for source coil j: columns are missing.
    void restart(int j) { means_[static_cast<std::size_t>(j)] = {}; }

    [[nodiscard]] int columns() const { return columns_; }
    /// (i, j): sensor coil i, source coil j. NaN without columns.
    [[nodiscard]] Mat3<double> ratio() const;
    /// Standard deviation of the ratio, from the residuals.
    [[nodiscard]] Mat3<double> sigma() const { return in_phase_.sigma(); }

    /// False if the sensor rested too little or in too few attitudes, or the device has no quadrature: phases are then unknown.
    [[nodiscard]] bool knows_phases() const;
    [[nodiscard]] Mat3<double> phase_rad() const;
    [[nodiscard]] Mat3<double> phase_sigma_rad() const { return quadrature_.sigma(); }

private:
    struct Mean {
        Vec3<double> high = Vec3<double>::Zero();
        Vec3<double> change = Vec3<double>::Zero();  // of the high band, from the first half to the second
        Vec3<double> low = Vec3<double>::Zero();
        Vec3<double> low_quadrature = Vec3<double>::Zero();
        int columns = 0;
    };
    /// One part of the low band by the high band: sums over means.
    struct Regression {
        Mat3<double> high_high = Mat3<double>::Zero();
        Mat3<double> low_high = Mat3<double>::Zero();
        Mat3<double> low_low = Mat3<double>::Zero();
        Vec3<double> count = Vec3<double>::Zero();  // means per source coil

        void add(int j, const Vec3<double>& high, const Vec3<double>& low);
        [[nodiscard]] Mat3<double> slope() const { return low_high.cwiseQuotient(high_high); }
        [[nodiscard]] Mat3<double> sigma() const;
    };

    int window_;
    std::array<Mean, 3> means_;  // of each source coil
    Regression in_phase_;
    Regression quadrature_;
    int columns_ = 0;
};

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
