// tricoil calibrate: calibrates with a stage, from free motion or on a grid, or identifies the wiring.
#include <fmt/format.h>

#include <Eigen/Dense>
#include <memory>
#include <nlohmann/json.hpp>
#include <numbers>

#include "board/host/calibration/calibration_fit.hpp"
#include "board/host/calibration/evaluation.hpp"
#include "board/host/calibration/frame_file.hpp"
#include "board/host/calibration/grid_calibration.hpp"
#include "board/host/calibration/self_calibration.hpp"
#include "board/host/calibration/wiring.hpp"
#include "board/host/commands/commands.hpp"
#include "board/host/commands/json_rows.hpp"
#include "board/host/run/statistics.hpp"
#include "board/support/calibration_file.hpp"
#include "board/support/errors.hpp"
#include "board/support/nearest_name.hpp"
#include "board/support/terminal_text.hpp"
#include "board/support/whole_file.hpp"
#include "core/base/angle_units.hpp"
#include "core/calibration/blob.hpp"

namespace tricoil::host {
namespace {

using Json = nlohmann::ordered_json;

const std::vector<std::string> kModels{"concentric", "general", "finite"};
const std::vector<std::string> kFixtures{"free", "named"};

struct CalibrateCommand {
    std::string model = "general";
    std::string fixtures = "free";
    std::string out;
    std::string blob;
    std::vector<std::string> data;
    bool affine = false;
    bool free_motion = false;
    bool grid = false;
    double spacing_mm = 0;
    double column_skew = 0;
    std::vector<double> hemisphere{1, 0, 0};
    std::vector<double> wiring;
    bool json = false;
};

/// Collects text output and JSON output.
struct Report {
    std::string text;
    Json json;
    std::vector<std::string> warnings;
};

Json list_of(const Vec3<double>& v) { return {v(0), v(1), v(2)}; }

/// Writes the blob first, so that a new TOML file never exists with an old blob. Each file is complete or absent.
void write_files(const CalibrateCommand& command, const CalibrationFile& file) {
    const Status status = calibration::check(file.calibration);
    if (!status.ok()) {
        throw InputError(status.message());
    }
    const std::string text = to_toml(file);
    if (!command.blob.empty()) {
        const auto blob = calibration::encode(file.calibration);
        write_whole_file(command.blob, std::string(blob.begin(), blob.end()));
    }
    if (!command.out.empty()) {
        write_whole_file(command.out, text);
    }
}

ErrorSummary position_summary(const std::vector<EvaluatedPose>& errors) {
    std::vector<double> sizes;
    for (const EvaluatedPose& e : errors) {
        sizes.push_back(e.error_m.norm());
    }
    return summarise(sizes);
}

ErrorSummary orientation_summary(const std::vector<EvaluatedPose>& errors) {
    std::vector<double> sizes;
    for (const EvaluatedPose& e : errors) {
        sizes.push_back(kDegrees * e.rotation_error_rad.norm());
    }
    return summarise(sizes);
}

Vec3<double> mean_direction(const std::vector<PoseFile>& files, const CalibrationFit& fit) {
    Vec3<double> sum = Vec3<double>::Zero();
    for (const PoseFile& file : files) {
        for (const MeasuredPose& pose : file.poses) {
            sum += true_pose(fit.source_stage.at(source_fixture_name(file)), pose, fit.mount_sensor.at(sensor_fixture_name(file)))
                       .position_m.normalized();
        }
    }
    return sum.normalized();
}

void describe_fit(const CalibrationFit& fit, const CalibrateCommand& command, Report& report) {
    report.text += fmt::format(
        "{} poses, model {}, fixtures {}; closed-form start {:.2f} mm, couplings left {:.3f} %, condition {:.0f}\n", fit.poses,
        command.model, command.fixtures, 1e3 * fit.start_position_rms_m, 100 * fit.residual_rms, fit.condition);
    report.text += fmt::format("  moments in units of C = {:.6g}\n", fit.coupling_constant);
    report.json["poses"] = fit.poses;
    report.json["model"] = command.model;
    report.json["fixtures"] = command.fixtures;
    report.json["start_position_rms_m"] = fit.start_position_rms_m;
    report.json["residual_rms"] = fit.residual_rms;
    report.json["condition"] = fit.condition;
    report.json["coupling_constant"] = fit.coupling_constant;
    report.json["parameters"] = Json::array();
    for (const FittedParameter& p : fit.parameters) {
        report.text += fmt::format("  {:<24} {:>12.6f} +- {:.6f}\n", p.name, p.value, p.deviation);
        report.json["parameters"].push_back({{"name", p.name}, {"value", p.value}, {"deviation", p.deviation}});
    }
    for (const auto& [path, rms] : fit.residual_rms_by_file) {
        report.text += fmt::format("  {}: couplings left {:.3f} %\n", path, 100 * rms);
        report.json["residual_rms_by_file"][path] = rms;
    }
    report.json["outliers"] = fit.outliers;
    for (const std::string& place : fit.outliers) {
        report.warnings.push_back(place + ": outlier, not used");
    }
    report.warnings.insert(report.warnings.end(), fit.warnings.begin(), fit.warnings.end());
    if (fit.stage_turns_left_handed) {
        report.warnings.emplace_back("the stage counts angles in the left-handed sense; they are inverted");
    }
}

void add_output_correction(CalibrationFile& file, const std::vector<PoseFile>& files, EvaluationSolver solver, Report& report) {
    fit_output_correction(file, evaluate(file, files, solver));
    const auto after = position_summary(evaluate(file, files, solver));
    report.text += fmt::format("  affine output correction: {:.4f} mm RMS on the same poses\n", 1e3 * after.rms);
    report.json["affine_position_rms_m"] = after.rms;
}

CalibrationFile calibrate_on_stage(const CalibrateCommand& command, Report& report) {
    FitOptions options;
    options.model = static_cast<FitModel>(index_of_name("model", command.model, kModels));
    options.fixtures = static_cast<FixtureModel>(index_of_name("fixtures", command.fixtures, kFixtures));
    const auto files = read_pose_files(command.data);
    const CalibrationFit fit = fit_calibration(files, options);
    describe_fit(fit, command, report);
    CalibrationFile file;
    file.calibration.model = fit.model;
    file.model = command.model;
    file.source_stage = fit.source_stage;
    file.mount_sensor = fit.mount_sensor;
    file.stage_turns_left_handed = fit.stage_turns_left_handed;
    file.residual_rms = fit.residual_rms;
    file.calibration.hemisphere = mean_direction(files, fit);
    for (const PoseFile& one : files) {
        file.calibration.phase_rad += one.phase_rad / static_cast<double>(files.size());
    }
    const auto solver = options.model == FitModel::concentric ? EvaluationSolver::direct : EvaluationSolver::refined;
    const auto errors = evaluate(file, files, solver);
    const ErrorSummary position = position_summary(errors);
    const ErrorSummary orientation = orientation_summary(errors);
    report.text += fmt::format("  on these poses: {:.4f} mm, {:.4f} deg RMS (95 % {:.4f} mm, {:.4f} deg)\n", 1e3 * position.rms,
                               orientation.rms, 1e3 * position.p95, orientation.p95);
    report.json["position_rms_m"] = position.rms;
    report.json["orientation_rms_deg"] = orientation.rms;
    if (command.affine) {
        add_output_correction(file, files, solver, report);
    }
    return file;
}

CalibrationFile calibrate_free_motion(const CalibrateCommand& command, Report& report) {
    std::vector<Mat3<double>> frames;
    for (const std::string& path : command.data) {
        auto part = read_frames(path);
        if (command.column_skew != 0) {
            part = deskewed(part, command.column_skew);
        }
        frames.insert(frames.end(), part.begin(), part.end());
    }
    const SelfCalibration found = self_calibrate(frames);
    report.text += fmt::format("{} frames; share of the couplings that no dipole explains: {:.3f} % before, {:.3f} % after\n",
                               frames.size(), 100 * found.misfit_before, 100 * found.misfit_after);
    report.text += fmt::format("  singular ratios {:.4f} : {:.4f} : 1 before, {:.4f} : {:.4f} : 1 after (ideal 2 : 1 : 1)\n",
                               found.ratios_before(0), found.ratios_before(1), found.ratios_after(0), found.ratios_after(1));
    report.text +=
        fmt::format("  spread over the frames: s1/(s2+s3) {:.4f} before, {:.4f} after; s2/s3 {:.4f} before, {:.4f} after\n",
                    found.spread_before(0), found.spread_after(0), found.spread_before(1), found.spread_after(1));
    const auto matrix = [&](const char* name, const Mat3<double>& m, const Mat3<double>& deviation) {
        for (Eigen::Index i = 0; i < 3; ++i) {
            report.text += fmt::format("  {:<7} {:>9.5f} {:>9.5f} {:>9.5f}   +- {:.5f} {:.5f} {:.5f}\n", i == 0 ? name : "",
                                       m(i, 0), m(i, 1), m(i, 2), deviation(i, 0), deviation(i, 1), deviation(i, 2));
        }
    };
    matrix("sensor", found.sensor, found.sensor_deviation);
    matrix("source", found.source, found.source_deviation);
    const std::string unseen =
        "not observable from free motion: the coupling constant C (scale of all lengths), a rotation of each triad as a whole, "
        "coils "
        "reversed or swapped in pairs, the hemisphere; offsets of the coils are not estimated";
    report.text += "  " + unseen + "\n";
    report.json = {{"frames", frames.size()},
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
                   {"not_observable", unseen}};
    if (!found.converged) {
        report.warnings.emplace_back("the fit stopped before it converged; record more motion");
    }
    CalibrationFile file;
    file.model = "free-motion";
    file.residual_rms = found.misfit_after;
    file.calibration.model.source_moment = found.source;
    file.calibration.model.sensor_sensitivity = found.sensor;
    return file;
}

Vec3<double> vector_of(const std::vector<double>& v) { return {v[0], v[1], v[2]}; }

CalibrationFile calibrate_grid(const CalibrateCommand& command, Report& report) {
    if (command.spacing_mm <= 0) {
        throw InputError("--grid needs --spacing-mm, the distance between neighbouring nodes");
    }
    std::vector<GridFrame> frames;
    for (const std::string& path : command.data) {
        const auto part = read_grid(path);
        frames.insert(frames.end(), part.begin(), part.end());
    }
    const Vec3<double> hemisphere = vector_of(command.hemisphere);
    const GridCalibration found = calibrate_on_grid(frames, 1e-3 * command.spacing_mm, hemisphere);
    const double c = found.source_moment.trace() / 3;
    report.text +=
        fmt::format("{} frames on the grid: positions fit to {:.3f} mm RMS; couplings left {:.3f} % before, {:.3f} % after\n",
                    frames.size(), 1e3 * found.position_rms_m, 100 * found.misfit_before, 100 * found.misfit_after);
    report.text +=
        fmt::format("  coupling constant {:.6g} +- {:.2f} %; pivot {:.2f} {:.2f} {:.2f} mm from the node\n", c,
                    100 * found.scale_deviation, 1e3 * found.pivot_m(0), 1e3 * found.pivot_m(1), 1e3 * found.pivot_m(2));
    report.json = {{"frames", frames.size()},
                   {"position_rms_m", found.position_rms_m},
                   {"misfit_before", found.misfit_before},
                   {"misfit_after", found.misfit_after},
                   {"coupling_constant", c},
                   {"coupling_constant_deviation", found.scale_deviation},
                   {"pivot_m", list_of(found.pivot_m)},
                   {"source_moment", rows_of(found.source_moment)},
                   {"sensor", rows_of(found.sensor)}};
    CalibrationFile file;
    file.model = "grid";
    file.residual_rms = found.misfit_after;
    file.calibration.model.source_moment = found.source_moment;
    file.calibration.model.sensor_sensitivity = found.sensor;
    file.calibration.hemisphere = hemisphere.normalized();
    return file;
}

int check_wiring(const CalibrateCommand& command) {
    std::vector<Mat3<double>> frames;
    for (const std::string& path : command.data) {
        const auto part = read_frames(path);
        frames.insert(frames.end(), part.begin(), part.end());
    }
    const Wiring wiring = identify_wiring(frames, vector_of(command.wiring));
    if (command.json) {
        const Json json = {
            {"sensor", to_text(wiring.sensor)}, {"source", to_text(wiring.source)},
            {"misfit", wiring.misfit},          {"second_misfit", wiring.second_misfit},
            {"certain", wiring.is_certain()},   {"straight", wiring.sensor.straight() && wiring.source.straight()}};
        print_text("{}\n", json.dump(2));
    } else {
        print_text("sensor: {}\nsource: {}\nmisfit {:.3f}, of the next best wiring {:.3f}\n", to_text(wiring.sensor),
                   to_text(wiring.source), wiring.misfit, wiring.second_misfit);
    }
    if (!wiring.is_certain()) {
        print_notice(
            "tricoil: no wiring fits clearly better than the others; is the sensor at the position given by --wiring, with axes "
            "parallel to those of the source?\n");
        return to_int(ExitCode::check_failed);
    }
    return to_int(wiring.sensor.straight() && wiring.source.straight() ? ExitCode::fine : ExitCode::check_failed);
}

void check_usage(const CalibrateCommand& c) {
    if ((c.free_motion ? 1 : 0) + (c.grid ? 1 : 0) + (c.wiring.empty() ? 0 : 1) > 1) {
        throw InputError("choose one of --free-motion, --grid and --wiring");
    }
    if (!(vector_of(c.hemisphere).norm() > 0)) {
        throw InputError("--hemisphere must not be zero");
    }
    if (!(std::abs(c.column_skew) < 1)) {
        throw InputError(fmt::format("--column-skew must lie between -1 and 1 frames; got {}", c.column_skew));
    }
    if (c.affine && (c.free_motion || c.grid)) {
        throw InputError("--affine needs poses from a stage");
    }
    if (c.wiring.empty() && c.out.empty()) {
        throw InputError("calibrate needs --out FILE.toml");
    }
}

int calibrate(const CalibrateCommand& command) {
    check_usage(command);
    if (!command.wiring.empty()) {
        return check_wiring(command);
    }
    Report report;
    const CalibrationFile file = command.free_motion ? calibrate_free_motion(command, report)
                                 : command.grid      ? calibrate_grid(command, report)
                                                     : calibrate_on_stage(command, report);
    write_files(command, file);
    report.json["warnings"] = report.warnings;
    report.json["out"] = command.out;
    for (const std::string& warning : report.warnings) {
        report.text += "warning: " + warning + "\n";
    }
    print_text(command.json ? report.json.dump(2) + "\n" : report.text + "wrote " + command.out + "\n");
    return to_int(ExitCode::fine);
}

}  // namespace

void add_calibrate_command(CLI::App& program, Action& action) {
    auto c = std::make_shared<CalibrateCommand>();
    CLI::App* sub = program.add_subcommand("calibrate", "Calibrate coils and fixtures from measured couplings");
    sub->add_option("data", c->data, "Couplings at stage poses (ILEMT text or CSV); frames or grid nodes (CSV)")->required();
    sub->add_option("--model", c->model, "concentric | general (a position for each coil) | finite (also a size)")
        ->capture_default_str();
    sub->add_option("--fixtures", c->fixtures,
                    "free (estimate the rotation of each sensor fixture) | named (rotation from the fixture's name)")
        ->capture_default_str();
    sub->add_flag("--affine", c->affine, "Also fit an affine correction of the positions");
    sub->add_option("--out", c->out, "Calibration as TOML");
    sub->add_option("--blob", c->blob, "Calibration as bytes for flash");
    sub->add_flag("--free-motion", c->free_motion, "Gains and angles from any motion, without ground truth");
    sub->add_option("--column-skew", c->column_skew,
                    "Free motion: time between columns, in frame periods (1/3 for TDM); columns are deskewed");
    sub->add_flag("--grid", c->grid, "Sensor placed on the nodes of a printed grid, in many attitudes");
    sub->add_option("--spacing-mm", c->spacing_mm, "Grid: distance of neighbouring nodes");
    sub->add_option("--hemisphere", c->hemisphere, "Grid: direction to the half space that contains it, source frame, X,Y,Z")
        ->expected(3)
        ->delimiter(',');
    sub->add_option("--wiring", c->wiring, "Check the wiring: sensor at X,Y,Z with its axes along the source's")
        ->expected(3)
        ->delimiter(',');
    sub->add_flag("--json", c->json, "Result as JSON");
    sub->callback([c, &action] { action = [c] { return calibrate(*c); }; });
}

}  // namespace tricoil::host
