// Checks of a calibration fit: residuals by file, standard deviations of the parameters, names of the fixtures.
#pragma once

#include <Eigen/Core>

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "board/host/calibration/calibration_fit.hpp"
#include "board/support/statistics.hpp"
#include "core/tracking/judge/misfit.hpp"

namespace tricoil::host {

/// Residuals of the couplings of one file, relative to the norm of each signal matrix.
struct FileResidual {
    std::string path;
    std::size_t poses = 0;
    std::size_t used = 0;  // poses that are not outliers
    double squares = 0;    // sum over the used poses

    [[nodiscard]] double rms() const;  // 1 if no pose is used
};

/// Sets the RMS residuals of `fit` and adds warnings.
void set_residuals(const std::vector<FileResidual>& files, FitModel model, CalibrationFit& fit);

/// Throws InputError if most poses of a file are outliers, if its residual is far above those of the other files, or if the model
/// does not explain the couplings.
void refuse_residuals(const std::vector<FileResidual>& files, FitModel model);

/// Both for data of one set without poses of a stage.
void check_residuals_of_motion(const FileResidual& data, FitModel model, CalibrationFit& fit);

/// Linearised fit at the solution: nine rows per pose, then those of a prior, if any.
struct ParameterEstimate {
    Eigen::MatrixXd jacobian;          // columns: free parameters, magnetic parameters first
    std::vector<double> residuals;     // of the poses, m
    double outlier_limit_m = 0;        // poses with a longer residual are outliers
    std::span<const double> magnetic;  // free magnetic parameters
    bool has_pick_up = false;          // in the last columns
};

/// Errors of coils without that of C. position_share: RMS of the position errors that they cause, relative to the range.
inline calibration::CoilErrors<double> coil_errors(double position_share) {
    return calibration::CoilErrors<double>::within_limits(0, position_share / tracking::position_deviation(1.0, 1.0, 1.0));
}

/// A pose of the fit.
struct PoseEffect {
    Vec3<double> position_m;
    Matrix<double, 9, 6> by_pose;  // derivative of its residuals by position (m) and rotation
};

/// Errors of coils with this covariance of the magnetic parameters. jacobian: of the poses' residuals, magnetic parameters first.
/// The common change of all ranges is the error of C.
calibration::CoilErrors<double> coil_errors(const Eigen::MatrixXd& covariance, const Eigen::MatrixXd& jacobian,
                                            const std::vector<PoseEffect>& poses);

/// Sets the deviation of the pick-up, in the unit of its parameters, and the parameters with their standard deviations and the
/// condition number of the normalised Jacobian. Adds a warning for parameters that the poses determine weakly. Throws InputError
/// if they do not determine them. Returns the covariance of the free magnetic parameters.
Eigen::MatrixXd check_parameters(const ParameterEstimate& estimate, CalibrationFit& fit);

/// Adds a warning for each fixture whose rotation relative to the first fixture contradicts their names.
void check_fixture_names(const std::vector<std::string>& sensor_fixtures, CalibrationFit& fit);

constexpr double kFirstLoss_m = 5e-3;  // scale of the robust loss for the first fit, when the spread of the residuals is unknown
constexpr double kLossMedians = 4;     // scale of the robust loss for later fits, in medians of the residual norms
constexpr double kOutlierMedians = 8;  // a pose with a larger residual is an outlier, in medians of the residual norms

/// Scale of the robust loss for later fits, m.
inline double loss_of(std::vector<double> norms_m) { return std::max(kLossMedians * median(std::move(norms_m)), 1e-9); }

/// Factor from the internal unit of a magnetic parameter to the unit in its name.
double unit_of(std::size_t parameter);

/// Number of free magnetic parameters of a model.
int free_magnetic(FitModel model);

double degrees_between(const Mat3<double>& a, const Mat3<double>& b);

}  // namespace tricoil::host
