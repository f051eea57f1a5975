// Coils from any motion, without ground truth, for `tricoil calibrate free-motion`.
#include <fmt/format.h>

#include "board/host/calibration/calibrations.hpp"
#include "board/host/calibration/converter_errors.hpp"
#include "board/host/calibration/coupling_phases.hpp"
#include "board/host/calibration/free_motion_fit.hpp"
#include "board/host/calibration/misfit_floor.hpp"
#include "board/host/calibration/self_calibration.hpp"
#include "board/pose_text/pose_table.hpp"
#include "board/support/errors.hpp"
#include "board/support/json_text.hpp"

namespace tricoil::host {
namespace {

constexpr double kLargestMisfit = 0.01;       // share of the couplings
constexpr std::size_t kLeftHandedShare = 10;  // one column frame in ten may be left-handed

/// Column frames, or the couplings of poses of a stage.
std::vector<CouplingFrame> read_couplings(const std::string& path, double column_skew, const ChannelWiring& wiring) {
    Table table(path);
    if (table.has_names() && !PoseTable::in(table)) {
        return read_frames(table, wiring);
    }
    refuse_if(column_skew != 0, "{}: holds poses of a stage; --column-skew is only for column frames in sequence", path);
    const PoseFile file = read_pose_file(table, wiring);
    return {file.poses.begin(), file.poses.end()};
}

/// Removes the few left-handed couplings that noise can cause, with a warning. Throws InputError if there are more.
void remove_left_handed(const std::string& path, std::vector<CouplingFrame>& frames, std::vector<std::string>& warnings) {
    const std::size_t all = frames.size();
    const std::size_t removed = std::erase_if(frames, [](const CouplingFrame& frame) { return frame.x.determinant() <= 0; });
    refuse_if(kLeftHandedShare * removed > all,
              "{}: {} of {} column frames are left-handed; correct the wiring or the signs (tricoil calibrate wiring)", path,
              removed, all);
    if (removed > 0) {
        warnings.push_back(fmt::format("{}: {} of {} column frames are left-handed, not used", path, removed, all));
    }
}

/// Positions and sizes of the coils, in addition to the gains.
void fit_coils(const FreeMotionOptions& options, FitModel model, const std::vector<Mat3<double>>& frames, CalibrationFile& file,
               CalibrationReport& report) {
    Json& result = report.json;
    std::vector<std::string>& warnings = report.warnings;
    const Vec3<double> hemisphere = options.hemisphere.value_or(Vec3<double>::UnitX());
    const FreeMotionFit found =
        fit_free_motion(frames, model, options.coupling_constant.value_or(1), hemisphere, options.progress);
    warnings.insert(warnings.end(), found.coils.warnings.begin(), found.coils.warnings.end());
    file.calibration.model = found.coils.model;
    file.calibration.errors = found.coils.errors;
    file.calibration.hemisphere = hemisphere.stableNormalized();
    if (!options.coupling_constant) {
        warnings.emplace_back(
            "all lengths are for a coupling constant of 1; give --coupling-constant, or calibrate on a grid or a stage");
    }
    file.calibration.misfit_floor = misfit_floor_of(found.misfit_shares, found.outliers);
    file.residual_rms = found.coils.residual_rms;
    result["residual_rms"] = found.coils.residual_rms;
    result["outliers"] = found.outliers;
    result["condition"] = found.coils.condition;
    result["misfit_floor"] = file.calibration.misfit_floor;
    result["position_error_share"] = found.position_error_share;
    result["parameters"] = parameters_json(found.coils);
}

}  // namespace

CalibrationFile calibrate_by_motion(const CalibrationFiles& of, const FreeMotionOptions& options, CalibrationReport& report) {
    Json& result = report.json;
    std::vector<std::string>& warnings = report.warnings;
    const calibration::Calibration<double> stored = stored_board(of);
    CalibrationFile file;
    file.calibration = stored;
    LevelCount levels;
    const ChannelWiring wiring = read_wiring(of.wiring);
    auto couplings = read_all(of.data, [&](const std::string& path) {
        std::vector<CouplingFrame> one = read_couplings(path, options.column_skew, wiring);
        levels += correct_board(one, stored);
        if (options.column_skew != 0) {
            one = deskewed(one, options.column_skew, wiring.source);
        }
        remove_left_handed(path, one, warnings);
        return one;
    });
    refuse_mixed_levels(levels, stored.converters);
    file.calibration.phase_rad = remove_own_phases(couplings);
    const std::vector<Mat3<double>> frames = in_phase_of(couplings);
    const SelfCalibration found = self_calibrate(frames);
    result = {{"frames", frames.size()},
              {"unknown_levels", levels.unknown},
              {"misfit_before", found.misfit_before},
              {"misfit_after", found.misfit_after},
              {"ratios_before", list_of(found.ratios_before)},
              {"ratios_after", list_of(found.ratios_after)},
              {"ratio_spread_before", {found.spread_before(0), found.spread_before(1)}},
              {"ratio_spread_after", {found.spread_after(0), found.spread_after(1)}},
              {"sensor", rows_of(found.sensor)},
              {"sensor_deviation", rows_of(found.sensor_deviation)},
              {"source", rows_of(found.source)},
              {"source_deviation", rows_of(found.source_deviation)},
              {"identifiability", found.weakest}};
    if (!found.converged) {
        warnings.emplace_back("the fit stopped before it converged; record more motion");
    }
    const double coupling_constant = options.coupling_constant.value_or(1);
    const bool richer = !options.model && found.misfit_after > kLargestMisfit;
    const FitModel model = richer ? FitModel::general : options.model.value_or(FitModel::concentric);
    if (richer) {
        warnings.push_back(fmt::format("the concentric model leaves {:.1f} % of the couplings unexplained; took --model general",
                                       100 * found.misfit_after));
    }
    file.model = options.coupling_constant ? to_string(model) : kFreeMotionModel;
    file.residual_rms = found.misfit_after;
    file.calibration.model.source_moment = coupling_constant * found.source;
    file.calibration.model.sensor_sensitivity = found.sensor;
    file.calibration.errors.couplings = found.coupling_error();
    file.calibration.hemisphere = options.hemisphere.value_or(Vec3<double>::Zero()).stableNormalized();
    if (model != FitModel::concentric) {
        fit_coils(options, model, frames, file, report);
    }
    refuse_if(
        file.residual_rms > kLargestMisfit,
        "the {} model leaves {:.1f} % of the couplings unexplained, and no more than 1 % is a calibration; record more motion "
        "about all axes, without metal near{}",
        to_string(model), 100 * file.residual_rms, model == FitModel::finite ? "" : ", or use --model finite");
    return file;  // with an unknown quadrature floor, because motion causes quadratures too
}

}  // namespace tricoil::host
