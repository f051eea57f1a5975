#include <fmt/format.h>

#include "board/host/calibration/converter_errors.hpp"
#include "board/host/calibration/coupling_phases.hpp"
#include "board/host/calibration/free_motion_fit.hpp"
#include "board/host/calibration/misfit_floor.hpp"
#include "board/host/calibration/self_calibration.hpp"
#include "board/host/commands/calibrations.hpp"
#include "board/pose_text/pose_table.hpp"
#include "board/support/errors.hpp"
#include "board/support/json_text.hpp"
#include "board/support/progress.hpp"

namespace tricoil::host {
namespace {

struct FreeMotionCommand {
    CalibrationFiles files;
    FitModel model = FitModel::concentric;
    const CLI::Option* model_option = nullptr;  // not given: general, if the concentric model does not explain the couplings
    double column_skew = 0;                     // see deskewed()
    std::optional<double> coupling_constant;    // gives the scale of all lengths
    std::optional<Vec3<double>> hemisphere;     // default: +x
};

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
void fit_coils(const FreeMotionCommand& command, FitModel model, const std::vector<Mat3<double>>& frames, CalibrationFile& file,
               CalibrationReport& report) {
    Json& result = report.json;
    std::vector<std::string>& warnings = report.warnings;
    Progress progress("calibrate");
    const Vec3<double> hemisphere = command.hemisphere.value_or(Vec3<double>::UnitX());
    const FreeMotionFit found =
        fit_free_motion(frames, model, command.coupling_constant.value_or(1), hemisphere, progress.part(0, 1));
    warnings.insert(warnings.end(), found.coils.warnings.begin(), found.coils.warnings.end());
    file.calibration.model = found.coils.model;
    file.calibration.errors = found.coils.errors;
    file.calibration.hemisphere = hemisphere.stableNormalized();
    if (!command.coupling_constant) {
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

std::string free_motion_text(const Json& r) {
    std::string text =
        fill(r,
             "{frames} frames; share of the couplings that no dipole explains: {misfit_before in %:.3f} % before, "
             "{misfit_after in %:.3f} % after\n"
             "  singular ratios {ratios_before/0:.4f} : {ratios_before/1:.4f} : 1 before, "
             "{ratios_after/0:.4f} : {ratios_after/1:.4f} : 1 after (ideal 2 : 1 : 1)\n"
             "  spread over the frames: s1/(s2+s3) {ratio_spread_before/0:.4f} before, {ratio_spread_after/0:.4f} after; "
             "s2/s3 {ratio_spread_before/1:.4f} before, {ratio_spread_after/1:.4f} after\n");
    for (const std::string name : {"sensor", "source"}) {
        for (std::size_t i = 0; i < 3; ++i) {
            text += fmt::format("  {:<7}", i == 0 ? name : "");
            text += fill(r[name][i], " {0:>9.5f} {1:>9.5f} {2:>9.5f}   +-");
            text += fill(r[name + "_deviation"][i], " {0:.5f} {1:.5f} {2:.5f}\n");
        }
    }
    if (r.contains("parameters")) {
        text +=
            fill(r,
                 "  with positions and sizes of the coils: couplings unexplained {residual_rms in %:.3f} %, {outliers} outliers; "
                 "estimated error of positions from these coils {position_error_share in %:.3f} % of the range\n") +
            parameters_text(r["parameters"]);
    }
    return text + fill(r, "  {not_observable}\n");
}

void check_usage(const FreeMotionCommand& c) {
    if (c.coupling_constant && !(*c.coupling_constant >= 1e-12 && *c.coupling_constant <= 1e12)) {
        throw InputError(fmt::format("--coupling-constant must lie between 1e-12 and 1e12; got {}", *c.coupling_constant));
    }
    refuse_if(
        !c.coupling_constant && !c.files.blob.empty(),
        "--blob needs --coupling-constant: all positions of a tracker follow from it, and free motion does not determine it");
    refuse_if(!(std::abs(c.column_skew) < 1), "--column-skew must lie between -1 and 1 frames; got {}", c.column_skew);
}

CalibrationFile calibrate_free_motion(const FreeMotionCommand& command, CalibrationReport& report) {
    check_usage(command);
    Json& result = report.json;
    std::vector<std::string>& warnings = report.warnings;
    const calibration::Calibration<double> stored = stored_board(command.files);
    CalibrationFile file;
    file.calibration = stored;
    LevelCount levels;
    const ChannelWiring wiring = read_wiring(command.files.wiring);
    auto couplings = read_all(command.files.data, [&](const std::string& path) {
        std::vector<CouplingFrame> one = read_couplings(path, command.column_skew, wiring);
        levels += correct_board(one, stored);
        if (command.column_skew != 0) {
            one = deskewed(one, command.column_skew, wiring.source);
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
              {"identifiability", found.weakest},
              {"not_observable",
               "not observable from free motion: the coupling constant C (scale of all lengths), a rotation of each triad as a "
               "whole, coils reversed or swapped in pairs, the hemisphere"}};
    if (!found.converged) {
        warnings.emplace_back("the fit stopped before it converged; record more motion");
    }
    const double coupling_constant = command.coupling_constant.value_or(1);
    const bool richer = command.model_option->count() == 0 && found.misfit_after > kLargestMisfit;
    const FitModel model = richer ? FitModel::general : command.model;
    if (richer) {
        warnings.push_back(fmt::format("the concentric model leaves {:.1f} % of the couplings unexplained; took --model general",
                                       100 * found.misfit_after));
    }
    file.model = command.coupling_constant ? to_string(model) : kFreeMotionModel;
    file.residual_rms = found.misfit_after;
    file.calibration.model.source_moment = coupling_constant * found.source;
    file.calibration.model.sensor_sensitivity = found.sensor;
    file.calibration.errors.couplings = found.coupling_error();
    file.calibration.hemisphere = command.hemisphere.value_or(Vec3<double>::Zero()).stableNormalized();
    if (model != FitModel::concentric) {
        fit_coils(command, model, frames, file, report);
    }
    refuse_if(
        file.residual_rms > kLargestMisfit,
        "the {} model leaves {:.1f} % of the couplings unexplained, and no more than 1 % is a calibration; record more motion "
        "about all axes, without metal near{}",
        to_string(model), 100 * file.residual_rms, model == FitModel::finite ? "" : ", or use --model finite");
    return file;  // with an unknown quadrature floor, because motion causes quadratures too
}

}  // namespace

void add_free_motion_calibration(CLI::App* calibrate, Action& action) {
    auto c = std::make_shared<FreeMotionCommand>();
    CLI::App* const kind = add_kind(calibrate, "free-motion", "Coils from any motion, without ground truth", c->files,
                                    "Couplings of column frames (CSV), or at stage poses");
    add_model(kind, c->model);
    c->model_option = kind->get_option("--model");
    kind->add_option("--coupling-constant", c->coupling_constant,
                     "Coupling constant C, mean moment of the source coils (coupling units times m^3); the scale of all lengths, "
                     "which free motion does not determine (default 1)");
    kind->add_option("--column-skew", c->column_skew,
                     "Time between columns, in frame periods (1/3 for TDM); columns are deskewed");
    add_hemisphere(kind, c->hemisphere);
    wiring_file(kind, c->files.wiring);
    add_converters_from(kind, c->files);
    add_out_and_blob(kind, c->files);
    set_examples(kind, {{"gains and angles without ground truth", "tricoil calibrate free-motion --out gains.toml motion.csv"},
                        {"also positions and sizes of the coils, with a known coupling constant",
                         "tricoil calibrate free-motion --model finite --coupling-constant 2.5e-3 --out coils.toml motion.csv"}});
    set_fit(kind, action, c, calibrate_free_motion, free_motion_text);
}

}  // namespace tricoil::host
