// Metal at rest that has moved since the calibration of the surroundings, and the pose error that it causes.
#pragma once

#include "core/calibration/coil_correction.hpp"
#include "core/tracking/front/column_motion.hpp"
#include "core/tracking/front/signal_matrix_assembler.hpp"
#include "core/tracking/pose_estimate.hpp"

namespace tricoil::tracking {

/// Metal that moves changes its couplings in phase and its quadratures by nearly the same share: a table 1, 3, 10 cm lower
/// (tests/calibration/moved_surroundings_test) by 0.07, 0.21, 0.56 in phase and 0.07, 0.19, 0.50 in quadrature. No pose changes
/// the quadratures, so their ratio to the calibrated ones shows that share. The error of the pose is then nearly parallel to the
/// correction of the surroundings, and that share of it. Motion causes quadratures too: constant times the rates of the columns,
/// which are estimated with the share.
class SurroundingsChange {
public:
    /// coils: with calibrated quadratures of the surroundings.
    SurroundingsChange(const CommonParams<double>& params, const calibration::Calibration<double>& coils);

    /// Adds a column that a tracker has accepted, and the error to covariance and distortion of a valid pose of it. An uncertain
    /// pose then becomes invalid; the tracker stays in its state, because it has not lost the sensor.
    void update(const Column<double>& column, std::optional<PoseEstimate<double>>& pose);

private:
    static constexpr int kStates = 1 + kSourceCoils * kSourceCoils;
    using State = Matrix<double, kStates, 1>;

    void learn(const Mat3<double>& expected);
    void cover(PoseEstimate<double>& pose);

    CommonParams<double> params_;
    calibration::Calibration<double> coils_;
    calibration::CoilCorrection<double> phases_;
    SignalMatrixAssembler<double> columns_;
    ColumnMotion<double> motion_;
    int fresh_ = 0;                          // columns since the last call of learn()
    DeviceTime time_{};                      // of that call
    Mat3<double> x_ = Mat3<double>::Zero();  // its couplings
    State state_ = State::Zero();            // the share; then for each column its quadrature over the rates of the three, s
    Matrix<double, kStates, kStates> covariance_;
};

}  // namespace tricoil::tracking
