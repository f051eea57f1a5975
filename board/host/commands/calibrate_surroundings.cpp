#include <fmt/format.h>

#include "board/host/calibration/converter_errors.hpp"
#include "board/host/calibration/coupling_phases.hpp"
#include "board/host/calibration/grid_calibration.hpp"
#include "board/host/calibration/surroundings_calibration.hpp"
#include "board/host/commands/calibrations.hpp"
#include "board/support/errors.hpp"
#include "board/support/json_text.hpp"

namespace tricoil::host {
namespace {

struct SurroundingsCommand {
    CalibrationFiles files;
    bool refit_fixtures = false;
    std::optional<double> spacing_mm;  // none: the data are poses of a stage
    std::optional<GridSize> nodes;
    std::optional<Vec3<double>> hemisphere;  // of the grid, if the calibration has none; default: +x
};

/// Reads the calibration of the coils and removes its surroundings.
CalibrationFile read_coils(const std::string& path) {
    CalibrationFile coils = read_calibration(path);
    const auto& c = coils.calibration;
    refuse_if(!c.output_linear.isIdentity(0) || !c.output_offset_m.isZero(0),
              "{}: has an affine output correction; calibrate the coils again", path);
    refuse_if(has_free_scale(coils),
              "{}: has no scale of lengths; give --coupling-constant to calibrate free-motion, or calibrate the coils on a stage "
              "or a grid",
              path);
    set_surroundings(coils, {});
    coils.stage_errors.stray.setZero();  // the surroundings replace it
    return coils;
}

SurroundingsData read_data(const SurroundingsCommand& command, const CalibrationFile& coils, Json& result) {
    if (command.spacing_mm) {
        check_spacing(1e-3 * *command.spacing_mm);
        const auto& known = coils.calibration.hemisphere;
        auto frames = read_grids(command.files.data, command.nodes, read_wiring(command.files.wiring));
        result["unknown_levels"] = correct_board(frames, coils.calibration).unknown;
        return data_on_grid(coils, frames, 1e-3 * *command.spacing_mm,
                            known.isZero(0) ? command.hemisphere.value_or(Vec3<double>::UnitX()) : known);
    }
    auto files = read_pose_files(command.files.data, {}, read_wiring(command.files.wiring));
    result["unknown_levels"] = correct_board(files, coils.calibration).unknown;
    return command.refit_fixtures ? data_at_unknown_fixtures(coils, std::move(files))
                                  : data_at_known_fixtures(coils, std::move(files));
}

Json json_of(const ModelErrors& errors) {
    return {{"position_rms_m", errors.position_rms_m},
            {"position_max_m", errors.position_max_m},
            {"not_converged", errors.not_converged}};
}

std::string dipole_count(std::size_t dipoles) { return fmt::format("{} virtual dipole{}", dipoles, dipoles == 1 ? "" : "s"); }

CalibrationFile calibrate_surroundings(const SurroundingsCommand& command, CalibrationReport& report) {
    refuse_if(command.spacing_mm && command.refit_fixtures,
              "--refit-fixtures and --spacing-mm: the place of a grid is always estimated; remove --refit-fixtures");
    Json& result = report.json;
    const CalibrationFile coils = read_coils(command.files.calibration);
    const SurroundingsData data = read_data(command, coils, result);
    const SurroundingsFit fit = fit_surroundings(coils.calibration.model, data);
    SurroundingsCalibration calibrated = add_surroundings(coils, fit, data);
    CalibrationFile& file = calibrated.file;
    if (command.refit_fixtures) {
        const PoseFile named = read_pose_file(command.files.data.front());
        file.source_stage = {{source_fixture_name(named), fit.frame}};
        file.mount_sensor = {{sensor_fixture_name(named), fit.mount}};
    }
    result["poses"] = data.poses.size();
    result["dipoles"] = Json::array();
    for (const VirtualDipole& dipole : fit.dipoles) {
        result["dipoles"].push_back(
            {{"position_m", list_of(dipole.position_m)}, {"polarisability_m3", rows_of(dipole.polarisability_m3)}});
    }
    result["residual_before_m"] = fit.residual_before_m;
    result["residual_m"] = fit.residual_m;
    result["without_surroundings"] = json_of(calibrated.without);
    result["with_surroundings"] = json_of(calibrated.with);
    result["misfit_floor"] = file.calibration.misfit_floor;
    if (file.quadrature.dipoles.empty()) {
        report.warnings.emplace_back(
            "no quadratures of the surroundings, or too small ones: poses do not show metal that moves by a few centimetres");
    } else {
        result["quadrature_deviation"] = file.quadrature.deviation;
    }
    if (!command.spacing_mm && !command.refit_fixtures) {
        return std::move(file);
    }
    result["frame_source"] = {{"translation_m", list_of(fit.frame.translation_m)}, {"rotation", rows_of(fit.frame.rotation)}};
    result["sensor_m"] = list_of(fit.mount.translation_m);
    return std::move(file);
}

std::string surroundings_text(const Json& r) {
    std::string text = fill(r, "{poses} poses; ") + dipole_count(r["dipoles"].size()) +
                       fill(r,
                            "; residuals as pose errors {residual_before_m in mm:.3f} mm without them, {residual_m in mm:.3f} "
                            "mm with them (RMS)\n");
    for (const Json& dipole : r["dipoles"]) {
        text += fill(dipole, "  dipole at {position_m/0 in mm:>8.1f} {position_m/1 in mm:>8.1f} {position_m/2 in mm:>8.1f} mm\n");
    }
    return text +
           fill(r,
                "  on these poses: {without_surroundings/position_rms_m in mm:.3f} mm RMS without surroundings, "
                "{with_surroundings/position_rms_m in mm:.3f} mm with them (maximum "
                "{with_surroundings/position_max_m in mm:.3f} mm)\n") +
           (r.contains("quadrature_deviation")
                ? fill(r, "  their quadratures fit within {quadrature_deviation in %:.1f} % (standard deviation)\n")
                : "");
}

}  // namespace

void add_surroundings_calibration(CLI::App* calibrate, Action& action) {
    auto c = std::make_shared<SurroundingsCommand>();
    CLI::App* const kind = add_kind(
        calibrate, "surroundings", "Metal at rest relative to the source: virtual dipoles, added to the calibration of the coils",
        c->files, "Couplings at stage poses, or with --spacing-mm of nodes of a grid on several levels");
    wiring_file(kind, c->files.wiring);
    add_coils(kind, c->files);
    CLI::Option* const spacing = add_spacing(kind, c->spacing_mm);
    add_nodes(kind, c->nodes)->needs(spacing);
    add_hemisphere(kind, c->hemisphere)->needs(spacing);
    kind->add_flag("--refit-fixtures", c->refit_fixtures,
                   "Estimate the fixtures again, because the source or the sensor was moved on the stage");
    add_out_and_blob(kind, c->files);
    set_examples(kind, {{"couplings above a simulated metal table",
                         "tricoil run --scenario table --fidelity columns --couplings soYoutZup_seYoutZup_table.csv"},
                        {"the table, as virtual dipoles",
                         "tricoil calibrate surroundings --calibration cal.toml --out room.toml soYoutZup_seYoutZup_table.csv"}});
    set_fit(kind, action, c, calibrate_surroundings, surroundings_text);
}

}  // namespace tricoil::host
