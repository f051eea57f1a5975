#include "board/host/calibration/converter_errors.hpp"
#include "board/host/calibration/coupling_phases.hpp"
#include "board/host/calibration/grid_calibration.hpp"
#include "board/host/commands/calibrations.hpp"
#include "board/support/json_text.hpp"

namespace tricoil::host {
namespace {

struct GridCommand {
    CalibrationFiles files;
    FitModel model = FitModel::concentric;
    std::optional<double> spacing_mm;        // required
    std::optional<GridSize> nodes;           // if the data are rests
    std::optional<Vec3<double>> hemisphere;  // default: +x
};

std::string grid_text(const Json& r) {
    std::string text =
        fill(r,
             "{frames} frames on the grid: positions fit to {position_rms_m in mm:.3f} mm RMS; couplings unexplained "
             "{misfit_before in %:.3f} % before, {misfit_after in %:.3f} % after\n"
             "  coupling constant {coupling_constant:.6g} +- {coupling_constant_deviation in %:.2f} %\n");
    for (const Json& pivot : r["pivots_m"]) {
        text += fill(pivot, "  pivot {0 in mm:.2f} {1 in mm:.2f} {2 in mm:.2f} mm from the node\n");
    }
    if (r.contains("position_error_share")) {
        text += fill(r,
                     "  {outliers} outliers; estimated error of positions from these coils {position_error_share in %:.3f} % of "
                     "the range\n");
    }
    return text + parameters_text(r["parameters"]);
}

CalibrationFile calibrate_grid(const GridCommand& command, CalibrationReport& report) {
    Json& result = report.json;
    const calibration::Calibration<double> stored = stored_board(command.files);
    const Vec3<double> hemisphere = command.hemisphere.value_or(Vec3<double>::UnitX());
    auto frames = read_grids(command.files.data, command.nodes, read_wiring(command.files.wiring));
    const LevelCount levels = correct_board(frames, stored);
    const Mat3<double> phase_rad = remove_own_phases(frames);
    const GridCalibration found = calibrate_on_grid(frames, 1e-3 * command.spacing_mm.value(), hemisphere, command.model);
    result = {{"frames", frames.size()},
              {"unknown_levels", levels.unknown},
              {"position_rms_m", found.position_rms_m},
              {"misfit_before", found.misfit_before},
              {"misfit_after", found.misfit_after},
              {"coupling_constant", found.coils.model.source_moment.trace() / 3},
              {"coupling_constant_deviation", found.scale_deviation},
              {"pivots_m", Json::array()},
              {"source_moment", rows_of(found.coils.model.source_moment)},
              {"sensor", rows_of(found.coils.model.sensor_sensitivity)},
              {"parameters", parameters_json(found.coils)}};
    for (const Vec3<double>& pivot : found.pivot_m) {
        result["pivots_m"].push_back(list_of(pivot));
    }
    if (command.model != FitModel::concentric) {
        result["position_error_share"] = found.position_error_share;
        result["outliers"] = found.outliers;
    }
    report.warnings.insert(report.warnings.end(), found.coils.warnings.begin(), found.coils.warnings.end());
    CalibrationFile file;
    file.calibration = stored;
    file.model = "grid";
    file.residual_rms = found.misfit_after;
    file.calibration.model = found.coils.model;
    file.calibration.errors = found.coils.errors;
    file.calibration.misfit_floor = found.misfit_floor;
    file.calibration.phase_rad = phase_rad;
    file.calibration.quadrature_floor = quadrature_floor_of(quadrature_shares(file.calibration, frames));
    file.calibration.hemisphere = hemisphere.stableNormalized();
    return file;
}

}  // namespace

void add_grid_calibration(CLI::App* calibrate, Action& action) {
    auto c = std::make_shared<GridCommand>();
    CLI::App* const kind = add_kind(calibrate, "grid", "Coils from a sensor on the nodes of a printed grid, in many attitudes",
                                    c->files, "Couplings of grid nodes (CSV), or rests of a recording with --nodes");
    add_model(kind, c->model);
    add_spacing(kind, c->spacing_mm)->required();
    add_nodes(kind, c->nodes);
    add_hemisphere(kind, c->hemisphere);
    wiring_file(kind, c->files.wiring);
    add_converters_from(kind, c->files);
    add_out_and_blob(kind, c->files);
    set_examples(kind, {{"sensor placed by hand on a printed grid",
                         "tricoil calibrate grid --spacing-mm 50 --out by_hand.toml grid.csv"}});
    set_fit(kind, action, c, calibrate_grid, grid_text);
}

}  // namespace tricoil::host
