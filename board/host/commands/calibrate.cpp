// tricoil calibrate: its kinds, and what they share.
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "board/host/commands/calibrations.hpp"
#include "board/host/commands/commands.hpp"
#include "board/support/errors.hpp"
#include "board/support/terminal_text.hpp"
#include "core/tracking/hemisphere.hpp"

namespace tricoil::host {
namespace {

/// A kind as the last version spelled it, and today.
struct OldKind {
    std::string_view option;
    std::string_view kind;
    std::string_view use;
};
constexpr OldKind kOldKinds[] = {
    {"", "stage", "stage"},
    {"--grid", "grid", "grid"},
    {"--free-motion", "free-motion", "free-motion"},
    {"--surroundings", "surroundings", "surroundings (with --spacing-mm, the data are of a grid)"},
    {"--low-band", "low-band", "low-band"},
    {"--pivot", "pivot", "pivot"},
    {"--wiring", "wiring", "wiring --at X,Y,Z"},
    {"--converters", "converters", "converters"},
};

const OldKind* old_kind(std::string_view option) {
    const auto* const found = std::ranges::find(kOldKinds, option.substr(0, option.find('=')), &OldKind::option);
    return option.empty() || found == std::end(kOldKinds) ? nullptr : found;
}

/// Neither help nor a kind of today, but an old kind or, without one, data. A bare word that names no file may be a mistyped
/// kind.
bool is_old_spelling(const std::vector<std::string>& words) {
    const std::vector<std::string> given(words.begin() + 1, std::find(words.begin(), words.end(), "--"));
    const auto is_of_today = [](const std::string& word) {
        return word == "--help" || word == "-h" || std::ranges::find(kOldKinds, word, &OldKind::kind) != std::end(kOldKinds);
    };
    if (given.empty() || std::ranges::any_of(given, is_of_today)) {
        return false;
    }
    const auto is_file = [](const std::string& word) { return std::filesystem::exists(word); };
    return std::ranges::any_of(given, old_kind) || is_file(given[0]) ||
           (given[0].starts_with('-') && std::any_of(words.begin() + 1, words.end(), is_file));
}

/// The kind of both; a grid is also data of surroundings. Throws InputError for any other two.
const OldKind* combined(const OldKind* one, const OldKind* other) {
    const auto is_pair = [&](std::string_view a, std::string_view b) { return one->kind == a && other->kind == b; };
    if (one->option.empty() || one == other || is_pair("grid", "surroundings")) {
        return other;
    }
    if (is_pair("surroundings", "grid")) {
        return one;
    }
    throw InputError(
        fmt::format("{} and {}: each is a calibration of its own; choose tricoil calibrate {} or tricoil calibrate {}",
                    one->option, other->option, one->kind, other->kind));
}

}  // namespace

std::vector<std::string> renew_calibrate(const std::vector<std::string>& words) {
    if (!is_old_spelling(words)) {
        return words;
    }
    const OldKind* kind = std::begin(kOldKinds);
    std::vector<std::string> renewed{words[0], ""};
    const auto end = std::find(words.begin(), words.end(), "--");
    for (auto word = words.begin() + 1; word != words.end(); ++word) {
        const OldKind* const named = word < end ? old_kind(*word) : nullptr;
        kind = named == nullptr ? kind : combined(kind, named);
        if (named == nullptr) {
            renewed.push_back(*word);
        } else if (named->kind == "wiring") {
            renewed.push_back("--at" + word->substr(named->option.size()));
        }
    }
    renewed[1] = kind->kind;
    print_hint("tricoil: calibrate {}: the next version refuses this spelling; use tricoil calibrate {}\n",
               kind->option.empty() ? "without a kind" : kind->option, kind->use);
    return renewed;
}

CLI::App* add_kind(CLI::App* calibrate, const std::string& name, const std::string& what, CalibrationFiles& files,
                   const std::string& data) {
    CLI::App* const kind = calibrate->add_subcommand(name, what);
    kind->add_option("data", files.data, data)->required()->type_name(kFileType);
    kind->add_flag("--json", files.json, "Result as JSON");
    return kind;
}

void add_out_and_blob(CLI::App* kind, CalibrationFiles& files) {
    kind->add_option("--out", files.out, "Calibration as TOML")->required()->type_name(kFileType);
    kind->add_option("--blob", files.blob, "Calibration as bytes for flash")->type_name(kFileType);
}

void add_converters_from(CLI::App* kind, CalibrationFiles& files) {
    kind->add_option("--converters-from", files.converters_from,
                     "Calibration with errors of the board's converters, or pick-up, which the new one keeps. Couplings with "
                     "levels (a11 to a33) are corrected, others are taken as corrected by the board")
        ->type_name(kFileType);
}

CLI::Option* add_spacing(CLI::App* kind, std::optional<double>& spacing_mm) {
    return kind->add_option("--spacing-mm", spacing_mm, "Distance between neighbouring nodes of the grid")->type_name("MM");
}

CLI::Option* add_nodes(CLI::App* kind, std::optional<GridSize>& nodes) {
    return numbers(kind->add_option_function<std::vector<int>>(
                       "--nodes",
                       [&nodes](const std::vector<int>& n) {
                           nodes = GridSize{n[0], n[1], n[2]};
                       },
                       "Numbers of columns, rows and levels, if the data are rests of a recording (convert --to rests) in this "
                       "order of nodes"),
                   "C,R,L", 3)
        ->check(CLI::Range(1, 1000));
}

CLI::Option* add_hemisphere(CLI::App* kind, std::optional<Vec3<double>>& hemisphere) {
    return vector_xyz(kind->add_option_function<std::vector<double>>(
        "--hemisphere",
        [&hemisphere](const std::vector<double>& given) {
            const Vec3<double> direction(given.at(0), given.at(1), given.at(2));
            refuse_if(!tracking::is_hemisphere(direction) || direction.isZero(0),
                      "--hemisphere must be a direction: three finite numbers, not all zero");
            hemisphere = direction;
        },
        "Direction to the half space of most positions, source frame (default 1,0,0)"));
}

void add_model(CLI::App* kind, FitModel& model) {
    add_named(kind, "--model", model,
              {to_string(FitModel::concentric), to_string(FitModel::general), to_string(FitModel::finite)},
              "concentric: gains and angles; general: also a position for each coil; finite: also a size");
}

void add_fixture_names(CLI::App* kind, std::vector<std::string>& names) {
    kind->add_option("--fixture", names,
                     "Fixtures of a file, instead of those in its name: FILE=soSOURCE_seSENSOR, or FILE=SOURCE (may be given "
                     "several times)")
        ->type_name("FILE=NAME")
        ->expected(1)
        ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
}

int run_calibration(const CalibrationFiles& files, const std::function<CalibrationFile(CalibrationReport&)>& fit,
                    std::string (*text)(const Json&)) {
    check_files(files);
    CalibrationReport report;
    write_calibration(files, fit(report), report);
    print_text(files.json ? json_line(report.json, 2) + "\n" : text(report.json) + common_text(report.json));
    return to_int(ExitCode::fine);
}

void add_calibrate_command(CLI::App* sub, Action& action) {
    add_stage_calibrations(sub, action);
    add_grid_calibration(sub, action);
    add_free_motion_calibration(sub, action);
    add_python_command(sub, action);  // the other kinds
}

}  // namespace tricoil::host
