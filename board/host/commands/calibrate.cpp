// tricoil calibrate: calibrates with a stage, from free motion or on a grid, identifies the wiring, or calibrates a tip.
#include <fmt/format.h>

#include <filesystem>
#include <memory>

#include "board/command_line/option_words.hpp"
#include "board/host/calibration/wiring.hpp"
#include "board/host/commands/calibrations.hpp"
#include "board/host/commands/commands.hpp"
#include "board/host/commands/hemisphere_option.hpp"
#include "board/support/distinct_files.hpp"
#include "board/support/errors.hpp"
#include "board/support/nearest_name.hpp"
#include "board/support/output_file.hpp"
#include "board/support/terminal_text.hpp"
#include "core/calibration/blob.hpp"
#include "core/tracking/tracker_params.hpp"

namespace tricoil::host {
namespace {

const std::vector<std::string> kModels{to_string(FitModel::concentric), to_string(FitModel::general),
                                       to_string(FitModel::finite)};
const std::vector<std::string> kFixtures{to_string(FixtureModel::free), to_string(FixtureModel::named)};
const std::vector<std::string> kStages{"ideal", "turning", "room"};

struct CalibrateCommand {
    std::string model;  // empty: general on a stage, otherwise concentric
    std::string fixtures = "free";
    std::string stage = "ideal";
    std::string out;
    std::string blob;
    std::vector<std::string> data;
    bool affine = false;
    bool converters = false;
    std::string converters_from;  // calibration with errors of the board's converters
    bool free_motion = false;
    bool grid = false;
    bool pivot = false;
    bool surroundings = false;
    bool low_band = false;
    bool refit_fixtures = false;
    std::string calibration;  // of the coils, for --surroundings and --low-band
    std::optional<std::uint8_t> sensor;
    double spacing_mm = 0;
    std::vector<int> nodes;  // of the grid, if the data are rests
    double column_skew = 0;
    std::optional<double> coupling_constant;
    std::vector<double> hemisphere;
    std::vector<double> wiring;
    bool json = false;
};

/// Without --model: what the data usually determine.
FitModel model_of(const CalibrateCommand& command) {
    if (command.model.empty()) {
        return command.free_motion || command.grid ? FitModel::concentric : FitModel::general;
    }
    return static_cast<FitModel>(index_of_name("model", command.model, kModels));
}

/// Result as JSON, with the warnings so far.
struct Report {
    Json json;
    std::vector<std::string> warnings;
};

/// Replaces older files only when both new ones are complete.
void write_files(const CalibrateCommand& command, const CalibrationFile& file) {
    const Status status = calibration::check(file.calibration);
    if (!status.ok()) {
        throw InputError(status.message());
    }
    OutputFile out(command.out);
    out.write(to_toml(file));
    if (!command.blob.empty()) {
        const auto bytes = calibration::encode(file.calibration);
        OutputFile blob(command.blob);
        blob.write(std::string(bytes.begin(), bytes.end()));
        out.flush();
        blob.commit();
    }
    out.commit();
}

Vec3<double> vector_of(const std::vector<double>& v) { return {v[0], v[1], v[2]}; }

std::optional<Vec3<double>> given_hemisphere(const CalibrateCommand& command) {
    return command.hemisphere.empty() ? std::nullopt : std::optional(hemisphere_of(command.hemisphere));
}

Vec3<double> hemisphere_or_default(const CalibrateCommand& command) {
    return given_hemisphere(command).value_or(Vec3<double>::UnitX());
}

std::optional<GridSize> grid_size(const CalibrateCommand& command) {
    const auto& n = command.nodes;
    return n.empty() ? std::nullopt : std::optional(GridSize{n[0], n[1], n[2]});
}

CalibrationFile calibrate_with_surroundings(const CalibrateCommand& command, Report& report) {
    const SurroundingsCommand surroundings{
        command.calibration,       command.data,       command.refit_fixtures,        command.grid,
        1e-3 * command.spacing_mm, grid_size(command), hemisphere_or_default(command)};
    return calibrate_surroundings(surroundings, report.json);
}

int check_wiring(const CalibrateCommand& command) {
    const Wiring wiring = identify_wiring(in_phase_of(read_all(command.data, read_frames)), vector_of(command.wiring));
    const bool straight = wiring.sensor.straight() && wiring.source.straight();
    const Json result = {{"sensor", to_text(wiring.sensor)},      {"source", to_text(wiring.source)}, {"misfit", wiring.misfit},
                         {"second_misfit", wiring.second_misfit}, {"certain", wiring.is_certain()},   {"straight", straight}};
    print_result(result, command.json, [](const Json& r) {
        return fill(r, "sensor: {sensor}\nsource: {source}\nmisfit {misfit:.3f}; next best wiring {second_misfit:.3f}\n");
    });
    if (!wiring.is_certain()) {
        print_notice(
            "tricoil: no wiring fits clearly better than the others; is the sensor at the position given by --wiring, with axes "
            "parallel to those of the source?\n");
        return to_int(ExitCode::check_failed);
    }
    return to_int(straight ? ExitCode::fine : ExitCode::check_failed);
}

void check_surroundings_usage(const CalibrateCommand& c) {
    if (!c.surroundings && ((!c.calibration.empty() && !c.low_band) || c.refit_fixtures)) {
        throw InputError("--calibration and --refit-fixtures: only with --surroundings (--calibration also with --low-band)");
    }
    if (!c.surroundings) {
        return;
    }
    if (c.calibration.empty()) {
        throw InputError("--surroundings needs --calibration FILE.toml: the coils, calibrated where there is no metal");
    }
    if (c.free_motion || c.pivot || !c.wiring.empty() || c.affine || c.stage != "ideal") {
        throw InputError(
            "--surroundings works with poses of a stage or, with --grid, of a grid; remove the other kind of calibration");
    }
    if (!c.model.empty() || c.fixtures != "free") {
        throw InputError("--model and --fixtures: not with --surroundings, which keeps the coils and fixtures of --calibration");
    }
    if (c.grid && c.refit_fixtures) {
        throw InputError("--refit-fixtures: not with --grid, whose place is always estimated");
    }
}

void check_low_band_usage(const CalibrateCommand& c) {
    if (c.low_band && c.calibration.empty()) {
        throw InputError("--low-band needs --calibration FILE.toml: the coils, calibrated in the high band");
    }
    if (c.low_band && (c.free_motion || c.grid || c.pivot || c.surroundings || !c.wiring.empty() || !c.model.empty() ||
                       c.affine || c.stage != "ideal" || c.fixtures != "free" || !c.blob.empty())) {
        throw InputError("--low-band takes recordings, --calibration and --out alone; remove the other options");
    }
}

void check_files(const CalibrateCommand& c) {
    for (const std::vector<std::string>& inputs : {c.data, {c.calibration}, {c.converters_from}}) {
        refuse_input_as_output("--out", c.out, inputs);
        refuse_input_as_output("--blob", c.blob, inputs);
    }
    std::error_code error;
    const auto place = [&](const std::string& path) {
        return std::filesystem::weakly_canonical(std::filesystem::absolute(path), error);
    };
    if (!c.blob.empty() && place(c.blob) == place(c.out)) {
        throw InputError("--out and --blob name the same file; choose two files");
    }
}

void check_usage(const CalibrateCommand& c) {
    if ((c.free_motion ? 1 : 0) + (c.grid ? 1 : 0) + (c.wiring.empty() ? 0 : 1) + (c.pivot ? 1 : 0) > 1) {
        throw InputError("choose one of --free-motion, --grid, --wiring and --pivot");
    }
    check_surroundings_usage(c);
    check_low_band_usage(c);
    if (!c.grid && !c.nodes.empty()) {
        throw InputError("--nodes: only with --grid");
    }
    if (c.grid && c.spacing_mm <= 0) {
        throw InputError("--grid needs --spacing-mm, the distance between neighbouring nodes");
    }
    if (c.sensor && !c.pivot) {
        throw InputError("--sensor: only with --pivot");
    }
    if (c.pivot && (c.data.size() != 1 || !c.blob.empty())) {
        throw InputError("--pivot takes one file or folder of poses, and no --blob");
    }
    if (c.converters && (c.free_motion || c.grid || c.pivot || c.surroundings || c.low_band || !c.wiring.empty())) {
        throw InputError("--converters needs poses of a stage; remove the option of the other kind of calibration");
    }
    if (!c.converters_from.empty() && (c.converters || c.pivot || c.surroundings || c.low_band || !c.wiring.empty())) {
        throw InputError("--converters-from: only with a new calibration of the coils, and not with --converters");
    }
    if (c.coupling_constant && !c.free_motion) {
        throw InputError("--coupling-constant: only with --free-motion; a stage or a grid gives the scale of the lengths");
    }
    if (c.coupling_constant && !(*c.coupling_constant >= 1e-12 && *c.coupling_constant <= 1e12)) {
        throw InputError(fmt::format("--coupling-constant must lie between 1e-12 and 1e12; got {}", *c.coupling_constant));
    }
    if (c.free_motion && !c.coupling_constant && !c.blob.empty()) {
        throw InputError(
            "--blob: with --free-motion it needs --coupling-constant, because all positions of a tracker follow from it");
    }
    if (!c.free_motion && c.column_skew != 0) {
        throw InputError("--column-skew: only with --free-motion");
    }
    if (!c.grid && c.spacing_mm != 0) {
        throw InputError("--spacing-mm: only with --grid");
    }
    if (!c.hemisphere.empty() && !c.grid && !c.free_motion) {
        throw InputError("--hemisphere: only with --grid or --free-motion");
    }
    (void)given_hemisphere(c);
    if (!(std::abs(c.column_skew) < 1)) {
        throw InputError(fmt::format("--column-skew must lie between -1 and 1 frames; got {}", c.column_skew));
    }
    if ((c.affine || c.stage != "ideal" || c.fixtures != "free") && (c.free_motion || c.grid)) {
        throw InputError("--affine, --stage and --fixtures need poses from a stage; remove them or --free-motion and --grid");
    }
    if (c.wiring.empty() && !c.pivot && c.out.empty()) {
        throw InputError("calibrate needs --out FILE.toml");
    }
    check_files(c);
}

std::string calibration_text(const CalibrateCommand& command, const Json& result) {
    std::string text = command.surroundings  ? surroundings_result_text(result)
                       : command.low_band    ? low_band_text(result)
                       : command.free_motion ? free_motion_text(result)
                       : command.grid        ? grid_text(result)
                                             : stage_text(result);
    if (result.contains("quadrature_floor")) {
        text += fill(result, "  quadrature of the couplings, expected by trackers: {quadrature_floor in %:.3f} % per coupling\n");
    }
    for (const Json& warning : result["warnings"]) {
        text += "warning: " + warning.get<std::string>() + "\n";
    }
    return text + fill(result, "wrote {out}\n");
}

FreeMotionCommand free_motion_of(const CalibrateCommand& command, const signal::ConverterErrors& stored) {
    return {command.data, model_of(command), command.column_skew, command.coupling_constant, given_hemisphere(command), stored};
}

GridCommand grid_of(const CalibrateCommand& command, const signal::ConverterErrors& stored) {
    return {command.data, model_of(command), 1e-3 * command.spacing_mm, grid_size(command), hemisphere_or_default(command),
            stored};
}

StageCommand stage_of(const CalibrateCommand& command, const signal::ConverterErrors& stored) {
    return {command.data,
            model_of(command),
            static_cast<FixtureModel>(index_of_name("fixtures", command.fixtures, kFixtures)),
            static_cast<StageModel>(index_of_name("--stage", command.stage, kStages)),
            command.affine,
            command.converters,
            stored};
}

signal::ConverterErrors stored_converters(const CalibrateCommand& command) {
    if (command.converters_from.empty()) {
        return {};
    }
    const signal::ConverterErrors stored = read_calibration(command.converters_from).calibration.converters;
    if (stored == signal::ConverterErrors{}) {
        throw InputError(command.converters_from +
                         ": does not contain errors of converters; give the calibration that was made with --converters");
    }
    return stored;
}

/// A blob without errors of the converters ends the correction by a board that stores some. Such a board sends no levels; there
/// are none in FDM either.
void warn_of_lost_converters(const CalibrateCommand& command, const CalibrationFile& file, Report& report) {
    if (!command.blob.empty() && file.calibration.converters == signal::ConverterErrors{} &&
        report.json.value("unknown_levels", 0) > 0) {
        report.warnings.push_back(command.blob +
                                  ": does not contain errors of converters; a board that stores some would no longer correct "
                                  "them: calibrate the coils with --converters-from CAL.toml to keep them");
    }
}

int calibrate(const CalibrateCommand& command) {
    check_usage(command);
    if (!command.wiring.empty()) {
        return check_wiring(command);
    }
    if (command.pivot) {
        return calibrate_pivot_command(command.data.front(), command.sensor, command.out, command.json);
    }
    const signal::ConverterErrors stored = stored_converters(command);
    Report report;
    CalibrationFile file = command.surroundings ? calibrate_with_surroundings(command, report)
                           : command.low_band   ? calibrate_low_band(command.calibration, command.data, report.json)
                           : command.free_motion
                               ? calibrate_free_motion(free_motion_of(command, stored), report.json, report.warnings)
                           : command.grid ? calibrate_grid(grid_of(command, stored), report.json, report.warnings)
                                          : calibrate_on_stage(stage_of(command, stored), report.json, report.warnings);
    if (!command.converters_from.empty()) {
        file.calibration.converters = stored;
    }
    warn_of_lost_converters(command, file, report);
    write_files(command, file);
    if (file.calibration.quadrature_floor < 1) {
        report.json["quadrature_floor"] = file.calibration.quadrature_floor;
    }
    report.json["warnings"] = report.warnings;
    report.json["out"] = command.out;
    print_text(command.json ? report.json.dump(2) + "\n" : calibration_text(command, report.json));
    return to_int(ExitCode::fine);
}

}  // namespace

void add_calibrate_command(CLI::App* sub, Action& action) {
    auto c = std::make_shared<CalibrateCommand>();
    sub->add_option("data", c->data,
                    "Couplings at stage poses (ILEMT text or CSV), or of column frames or grid nodes (CSV); with --pivot: poses")
        ->required()
        ->type_name(kFileType);
    one_of(
        sub->add_option("--model", c->model,
                        "concentric: gains and angles (default of --free-motion and --grid); general: also a position for each "
                        "coil (default with a stage); finite: also a size"),
        kModels);
    one_of(sub->add_option("--fixtures", c->fixtures,
                           "Estimate the rotation of each sensor fixture (free), or take it from the fixture's name (named)"),
           kFixtures)
        ->capture_default_str();
    one_of(
        sub->add_option(
            "--stage", c->stage,
            "Errors of the stage to estimate: none (ideal), linear in the position in the turning frame (turning), also linear "
            "in the position in the room, and a uniform stray field (room)"),
        kStages)
        ->capture_default_str();
    sub->add_flag("--converters", c->converters,
                  "Also find the non-linearity of the board's converters and the errors of its gain steps (TDM; needs a11 to a33 "
                  "and gain_step, as convert --to rests gives them)");
    sub->add_option(
           "--converters-from", c->converters_from,
           "Calibration with errors of the board's converters, which the new one keeps. Couplings with levels (a11 to a33) are "
           "corrected, others are taken as corrected by the board")
        ->type_name(kFileType);
    sub->add_flag("--affine", c->affine, "Also fit an affine correction of the positions");
    sub->add_option("--out", c->out, "Calibration or tip as TOML")->type_name(kFileType);
    sub->add_option("--blob", c->blob, "Calibration as bytes for flash")->type_name(kFileType);
    sub->add_flag("--free-motion", c->free_motion, "Coils from any motion, without ground truth");
    sub->add_option(
        "--coupling-constant", c->coupling_constant,
        "Free motion: coupling constant C, mean moment of the source coils (coupling units times m^3); the scale of all "
        "lengths, which free motion does not determine (default 1)");
    sub->add_option("--column-skew", c->column_skew,
                    "Free motion: time between columns, in frame periods (1/3 for TDM); columns are deskewed");
    sub->add_flag("--grid", c->grid, "Sensor placed on the nodes of a printed grid, in many attitudes");
    sub->add_option("--spacing-mm", c->spacing_mm, "Grid: distance between neighbouring nodes, mm");
    sub->add_option("--nodes", c->nodes,
                    "Grid: columns,rows,levels, if the data are rests of a recording (convert --to rests) in this order of nodes")
        ->expected(3)
        ->delimiter(',')
        ->check(CLI::Range(1, 1000));
    sub->add_option("--hemisphere", c->hemisphere,
                    "Grid, free motion: direction to the half space of most positions, source frame (default 1,0,0)")
        ->type_name("X,Y,Z")
        ->expected(3)
        ->delimiter(',');
    sub->add_option("--wiring", c->wiring, "Check the wiring: sensor at X,Y,Z, its axes parallel to those of the source")
        ->type_name("X,Y,Z")
        ->expected(3)
        ->delimiter(',');
    sub->add_flag(
        "--surroundings", c->surroundings,
        "Metal at rest relative to the source: adds virtual dipoles to the calibration of the coils. Data: couplings at "
        "stage poses, or with --grid of nodes on several levels");
    sub->add_option("--calibration", c->calibration,
                    "Surroundings, low band: calibration of the coils (TOML), made where there is no metal")
        ->check(refuse_empty);
    sub->add_flag("--refit-fixtures", c->refit_fixtures,
                  "Surroundings: estimate the fixtures again, because the source or the sensor was moved on the stage");
    sub->add_flag("--low-band", c->low_band,
                  "Ratio of the low to the high band of each coupling, and phases of the low band. Data: recordings in two "
                  "bands, without metal, with the sensor turned about all its axes, and at rest for the phases");
    sub->add_flag(
        "--pivot", c->pivot,
        "Calibrate the tip of a pointer for --tip. Poses: recording, CSV of run --out, or JSON lines, with the pointer tilted to "
        "all sides and its tip at rest");
    sub->add_option("--sensor", c->sensor, "Pivot: number of the sensor on the pointer, if there are several")
        ->check(CLI::Range(0, tracking::kMaxSensors - 1));
    sub->add_flag("--json", c->json, "Result as JSON");
    set_examples(
        sub, {{"coils and fixtures from couplings at known poses",
               "tricoil calibrate --model finite --out cal.toml --blob cal.bin stage/*.dat"},
              {"gains and angles without ground truth", "tricoil calibrate --free-motion --out gains.toml motion.csv"},
              {"also positions and sizes of the coils, with a known coupling constant",
               "tricoil calibrate --free-motion --model finite --coupling-constant 2.5e-3 --out coils.toml motion.csv"},
              {"sensor placed by hand on a printed grid", "tricoil calibrate --grid --spacing-mm 50 --out by_hand.toml grid.csv"},
              {"coil and polarity of each channel", "tricoil calibrate --wiring 0.4,0.2,0.1 frames.csv"},
              {"a recording in two bands, without metal", "tricoil run --mux dual-band --record turned"},
              {"the ratio of both bands, from that recording",
               "tricoil calibrate --low-band --calibration cal.toml --out both.toml turned"},
              {"a pointer that is tilted with its tip at rest", "tricoil run --scenario pointer --record pivot"},
              {"its tip, from that recording", "tricoil calibrate --pivot pivot --out tip.toml"}});
    sub->callback([c, &action] { action = [c] { return calibrate(*c); }; });
}

}  // namespace tricoil::host
