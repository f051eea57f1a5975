#include "board/host/commands/program.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <optional>

#include "board/command_line/parse.hpp"
#include "board/host/commands/command_list.hpp"
#include "board/host/commands/option_values.hpp"
#include "board/host/commands/user_defaults.hpp"
#include "board/support/components.hpp"
#include "board/support/errors.hpp"
#include "board/support/python_part.hpp"
#include "board/support/terminal_text.hpp"

namespace tricoil::host {
namespace {

constexpr const char* kDescription =
    "tricoil: an open AC electromagnetic tracker.\n"
    "Computes position and attitude of a sensor from the nine couplings of three source and three sensor coils.";

const std::vector<Example> kExamples{
    {"track a simulated hand, then look at it in a browser", "tricoil run"},
    {"the live page", "tricoil serve --web 8080"},
    {"track a device", "tricoil run --device can:can0 --out poses.csv"},
};

const std::vector<HelpSection> kHelpSections{
    {"Files",
     {{"~/.config/tricoil.toml", "Defaults of the user: device = \"can:can0\", hemisphere = [1, 0, 0], units = \"mm\"."},
      {"/etc/tricoil/board.toml", "Configuration of tricoil.service."},
      {"/usr/share/doc/tricoil/examples/board.toml", "Example configuration with every key."}}},
};

constexpr const char* kHere = "tricoil";
constexpr const char* kServe = "tricoil-serve";
constexpr const char* kTools = "tricoil-tools";

struct ListedCommand {
    const char* group;
    const char* name;
    const char* description;
    const char* executable = kHere;
    std::optional<Component> component = {};
};

// In the order of the help.
constexpr ListedCommand kCommands[] = {
    {"Track", "run", "Track a simulated sensor (poses are compared with the truth) or a real device"},
    {"Track", "serve", "Track, and send poses to other programs", kServe},
    {"Track", "demo", "Open the live page on a tour: hand, motion error, filter, metal, unplugged sensor", kServe,
     Component::web},
    {"Recordings", "replay", "Track a recording again: bit for bit, or with another tracker", kTools},
    {"Recordings", "smooth", "Best estimate of a recorded motion: each pose from the columns before and after it", kTools},
    {"Recordings", "convert", "Convert the poses of a recording for other programs", kTools},
    {"Recordings", "plot", "Draw path, position errors or standard deviations, and flags of poses"},
    {"Calibration and evaluation", "design", "Signal to noise and error over range of planned coils; a printed grid"},
    {"Calibration and evaluation", "calibrate",
     "Calibrate coils and fixtures from measured couplings, or the tip of a pointer from poses", kHere, Component::calibration},
    {"Calibration and evaluation", "evaluate", "Pose errors of a calibrated tracker against ground truth", kHere,
     Component::calibration},
    {"Calibration and evaluation", "couplings", "Poses from recorded couplings of two bands, corrected for metal"},
    {"Calibration and evaluation", "demodulate", "Compute the signal matrix and its scatter from a raw ADC recording"},
    {"Calibration and evaluation", "bench", "A tracker on the bench: rest, pivot, distances on a board, hinge, pendulum"},
    {"Calibration and evaluation", "truth", "One reference path from optics, a robot's joints and an inertial sensor"},
    {"Calibration and evaluation", "generator",
     "Sensors of one coil in the field of up to 16 source coils: simulate, solve, calibrate"},
    {"Devices", "device", "List, identify, watch and configure front ends and tracker boards", kTools},
    {"Devices", "doctor", "Check udev rules, devices and ports of this machine; each failure with its mend", kTools},
    {"Devices", "selfcheck", "Run the self-check of the core: known answers, error model, arithmetic", kTools},
    {"Devices", "protocol", "Print the page of the wire protocol, or write it and a DBC file for CAN tools"},
    {"Error model", "motion", "Compare the movement-induced error model with a simulation"},
    {"Error model", "figures",
     "Write figures as CSV and SVG: 1 to 6 of the paper, comparison of closed and open loop, error budget, metal"},
    {"Help", "help", "Print the help of a command, with examples"},
    {"Help", "completion", "Print the completion script of a shell"},
};

/// Adds the options of a command that this executable contains, or that is in Python; null: another executable contains it.
auto find_own(std::span<const OwnCommand> own, const std::string& name) -> decltype(OwnCommand::add) {
    const auto found = std::find_if(own.begin(), own.end(), [&](const OwnCommand& one) { return one.name == name; });
    return found != own.end() ? found->add : is_in_python(name) ? add_python_command : nullptr;
}

/// The command that the words name, also behind `help` and in a request for candidates; null: none.
const ListedCommand* named_command(std::span<const std::string> words) {
    if (!words.empty() && words.front() == kCompleteWord) {  // the last word is still being typed
        words = words.subspan(1, std::max<std::size_t>(words.size(), 2) - 2);
    }
    const auto name = std::find_if(words.begin(), words.end(),
                                   [](const std::string& word) { return word != "help" && !word.starts_with('-'); });
    const auto* const listed = std::find_if(std::begin(kCommands), std::end(kCommands),
                                            [&](const ListedCommand& one) { return name != words.end() && one.name == *name; });
    return listed == std::end(kCommands) ? nullptr : listed;
}

/// The words without -q and -v, which take effect here; every command takes them.
std::vector<std::string> take_verbosity(std::vector<std::string> words) {
    set_verbosity(Verbosity::normal);
    const auto take = [&](const char* brief, const char* full, Verbosity verbosity) {
        const auto end = std::find(words.begin(), words.end(), "--");
        const auto rest =
            std::remove_if(words.begin(), end, [&](const std::string& word) { return word == brief || word == full; });
        if (rest != end) {
            set_verbosity(verbosity);
        }
        words.erase(rest, end);
    };
    if (words.empty() || words.front() != kCompleteWord) {
        take("-v", "--verbose", Verbosity::verbose);
        take("-q", "--quiet", Verbosity::quiet);
    }
    return words;
}

/// Does not return, unless it throws; `missing`: what is wrong if there is no such file.
int continue_as(const std::filesystem::path& path, const std::string& typed_name, const std::vector<std::string>& arguments,
                const std::string& missing) {
    std::vector<char*> words{const_cast<char*>(typed_name.c_str())};
    for (const std::string& argument : arguments) {
        words.push_back(const_cast<char*>(argument.c_str()));
    }
    words.push_back(nullptr);
    ::setenv("GLOG_minloglevel", "2", 0);  // no warnings of the library below Ceres: the command says what is wrong
    ::execv(path.c_str(), words.data());
    throw DeviceError(errno == ENOENT ? missing : fmt::format("{} does not start ({})", path.string(), std::strerror(errno)));
}

}  // namespace

int continue_in_python(const CLI::App& command) {
    const std::string& name = command.get_name();
    const auto script = program_part("_program.py", name);
    if (!std::filesystem::exists(script)) {
        throw DeviceError(fmt::format("{}: {} is not installed; install the package tricoil again", name, script.string()));
    }
    if (is_quiet()) {
        ::setenv(kQuietVariable, "1", 1);
    }
    std::vector<std::string> words{"-I", script, name};
    for (const CLI::Option* const option : options_of(command)) {
        const std::string word = "--" + option->get_lnames().front();
        if (is_flag(*option) && option->count() > 0) {
            words.push_back(word);
        } else if (option->get_delimiter() != '\0' && option->count() > 0) {
            words.push_back(fmt::format("{}={}", word, fmt::join(option->results(), ",")));
        } else if (option->count() > 0) {
            for (const std::string& value : option->results()) {
                words.push_back(fmt::format("{}={}", word, value));
            }
        }
    }
    words.emplace_back("--");
    for (const CLI::Option* const argument : arguments_of(command)) {
        words.insert(words.end(), argument->results().begin(), argument->results().end());
    }
    return continue_as(kPython, kPython, words, name + ": needs Python: install the package python3-tricoil");
}

int run_program(const std::vector<std::string>& arguments, std::span<const OwnCommand> own, const ProgramIdentity& identity) {
    const ListedCommand* const named = named_command(arguments);
    if (named != nullptr && named->component) {
        require(*named->component, named->name);
    }
    if (named != nullptr && find_own(own, named->name) == nullptr) {
        const auto path = program_part(named->executable, named->name);
        return continue_as(
            path, identity.typed_name, arguments,
            fmt::format("{}: {} is not built or not installed; build all of tricoil with cmake --build, or install "
                        "the package tricoil again",
                        named->name, path.string()));
    }
    CLI::App program{kDescription, identity.typed_name};
    program.set_version_flag("--version", identity.version, "Print the version and the commit");
    program.add_flag("-q,--quiet")->description("No hints and no progress");
    program.add_flag("-v,--verbose")->description("Also details, such as the defaults that were used");
    program.require_subcommand(1);
    Action action;
    CommandLineParams params{option_values(program), kHelpSections, {}};
    for (const ListedCommand& listed : kCommands) {
        CLI::App* const sub = program.add_subcommand(listed.name, listed.description);
        if (const auto add = find_own(own, listed.name); add != nullptr) {
            add(sub, action);
        } else {
            params.without_manual.insert(listed.name);
        }
        sub->group(listed.group);
    }
    set_examples(&program, kExamples);  // after the subcommands, which would inherit them
    std::vector<std::string> words = take_verbosity(arguments);
    if (!words.empty() && words.front() == "calibrate") {
        words = renew_calibrate(words);
    }
    if (identity.uses_defaults) {
        words = with_user_defaults(program, std::move(words));
    }
    if (!parse_words(program, words, params)) {
        return to_int(ExitCode::fine);
    }
    return action();
}

}  // namespace tricoil::host
