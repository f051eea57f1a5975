#include "board/host/calibration/surroundings_calibration.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "board/host/calibration/fit_quality.hpp"
#include "board/host/calibration/misfit_floor.hpp"
#include "board/support/errors.hpp"

namespace tricoil::host {
namespace {

ModelErrors errors_of_model(const field::GeneralDipole<double>& model, const SurroundingsData& data,
                            const std::vector<solver::RigidPose<double>>& truths) {
    ModelErrors errors;
    double squares = 0;
    for (std::size_t k = 0; k < truths.size(); ++k) {
        const auto solution = solve_tolerant(model, data.poses[k].x, truths[k].position_m);
        if (!solution.ok() || !solution->refinement.converged()) {
            ++errors.not_converged;
            errors.error_m.push_back(std::numeric_limits<double>::infinity());
            continue;
        }
        const double error_m = (solution->refinement.pose.position_m - truths[k].position_m).norm();
        squares += error_m * error_m;
        errors.position_max_m = std::max(errors.position_max_m, error_m);
        errors.error_m.push_back(error_m);
        errors.misfit_max = std::max(errors.misfit_max, solution->refinement.misfit_share);
    }
    errors.position_rms_m =
        std::sqrt(squares / static_cast<double>(std::max<std::size_t>(truths.size() - errors.not_converged, 1)));
    return errors;
}

/// Index of a pose whose error is far above that of the others, or that has no solution.
std::optional<std::size_t> find_outlier(const ModelErrors& errors, const std::vector<solver::RigidPose<double>>& truths) {
    constexpr double kOfMedian = 20;
    constexpr double kOfRange = 0.01;
    const auto worst = std::max_element(errors.error_m.begin(), errors.error_m.end());
    const auto index = static_cast<std::size_t>(worst - errors.error_m.begin());
    const bool is_outlier = *worst > kOfMedian * median(errors.error_m) && *worst > kOfRange * truths[index].position_m.norm();
    return is_outlier ? std::optional(index) : std::nullopt;
}

/// Throws InputError for a pose that does not fit the others, and for dipoles that increase the error.
void refuse_bad_fit(const ModelErrors& without, const ModelErrors& with, const std::vector<solver::RigidPose<double>>& truths) {
    const std::size_t poses = truths.size();
    if (const auto pose = find_outlier(with, truths)) {
        const double error_m = with.error_m[*pose];
        throw InputError(fmt::format(
            "pose {} of {} does not fit the others: {}; its data are wrong, or metal is too near: correct or remove it",
            *pose + 1, poses,
            std::isinf(error_m)
                ? "its couplings give no pose"
                : fmt::format("{:.1f} mm of error, RMS of all {:.1f} mm", 1e3 * error_m, 1e3 * with.position_rms_m)));
    }
    if (with.not_converged > without.not_converged ||
        (with.not_converged == without.not_converged && !(with.position_rms_m < without.position_rms_m))) {
        throw InputError(fmt::format(
            "the virtual dipoles make the poses worse: {:.3f} mm RMS without them, {:.3f} mm with them, {} of {} poses without "
            "a solution; use the calibration without surroundings",
            1e3 * without.position_rms_m, 1e3 * with.position_rms_m, with.not_converged, poses));
    }
}

}  // namespace

SurroundingsCalibration add_surroundings(const CalibrationFile& coils, const SurroundingsFit& fit, const SurroundingsData& data) {
    SurroundingsCalibration calibrated{coils, errors_of_model(coils.calibration.model, data, fit.truths), {}};
    calibrated.file.calibration.quadrature_floor = 1;  // the dipoles do not describe the quadrature of the surroundings
    set_surroundings(calibrated.file, fit.dipoles);
    calibrated.with = errors_of_model(calibrated.file.calibration.model, data, fit.truths);
    refuse_bad_fit(calibrated.without, calibrated.with, fit.truths);
    calibrated.file.calibration.misfit_floor = misfit_floor_of(calibrated.with.misfit_max);
    return calibrated;
}

}  // namespace tricoil::host
