// Kinds of `tricoil calibrate` that are not in Python, one file each, and the options and files that they share.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "board/command_line/option_words.hpp"
#include "board/host/calibration/calibration_fit.hpp"
#include "board/host/calibration/converter_errors.hpp"
#include "board/host/calibration/coupling_phases.hpp"
#include "board/host/calibration/frame_file.hpp"
#include "board/host/commands/calibration_files.hpp"
#include "board/host/commands/commands.hpp"
#include "board/host/commands/program.hpp"
#include "board/support/nearest_name.hpp"
#include "core/signal/converter_errors.hpp"

namespace tricoil::host {

// Each function adds a kind (two: stage and converters) to `calibrate`.
void add_stage_calibrations(CLI::App* calibrate, Action& action);
void add_grid_calibration(CLI::App* calibrate, Action& action);
void add_free_motion_calibration(CLI::App* calibrate, Action& action);

/// Adds a kind with its data and --json.
CLI::App* add_kind(CLI::App* calibrate, const std::string& name, const std::string& what, CalibrationFiles& files,
                   const std::string& data);
void add_out_and_blob(CLI::App* kind, CalibrationFiles& files);
void add_converters_from(CLI::App* kind, CalibrationFiles& files);
/// Distance between neighbouring nodes of a grid.
CLI::Option* add_spacing(CLI::App* kind, std::optional<double>& spacing_mm);
CLI::Option* add_nodes(CLI::App* kind, std::optional<GridSize>& nodes);
CLI::Option* add_hemisphere(CLI::App* kind, std::optional<Vec3<double>>& hemisphere);

/// Option whose values are the `names` of an enumeration, in its order. `value` must outlive the parsing.
template <typename Enum>
void add_named(CLI::App* kind, const std::string& option, Enum& value, const std::vector<std::string>& names,
               const std::string& what) {
    const auto read = [&value, names, option](const std::string& name) {
        value = static_cast<Enum>(index_of_name(option.substr(2), name, names));
    };
    one_of(kind->add_option_function<std::string>(option, read, what), names)
        ->default_str(names[static_cast<std::size_t>(value)]);
}
void add_model(CLI::App* kind, FitModel& model);
/// --fixture FILE=NAME.
void add_fixture_names(CLI::App* kind, std::vector<std::string>& names);

/// Makes the calibration, writes its files, and prints the result. Returns the exit code.
int run_calibration(const CalibrationFiles& files, const std::function<CalibrationFile(CalibrationReport&)>& fit,
                    std::string (*text)(const Json&));

/// Sets the action of a kind. `Command` has a member `files`.
template <typename Command>
void set_fit(CLI::App* kind, Action& action, const std::shared_ptr<Command>& command,
             CalibrationFile (*fit)(const Command&, CalibrationReport&), std::string (*text)(const Json&)) {
    kind->callback([=, &action] {
        action = [=] {
            return run_calibration(
                command->files, [&](CalibrationReport& report) { return fit(*command, report); }, text);
        };
    });
}

// Parameters of a calibration in the output of commands.

inline Json parameters_json(const CalibrationFit& fit) {
    Json list = Json::array();
    for (const FittedParameter& p : fit.parameters) {
        list.push_back({{"name", p.name}, {"value", p.value}, {"deviation", p.deviation}});
    }
    return list;
}

inline std::string parameters_text(const Json& list) {
    std::string text;
    for (const Json& p : list) {
        text += fill(p, "  {name:<24} {value:>12.6f} +- {deviation:.6f}\n");
    }
    return text;
}

}  // namespace tricoil::host
