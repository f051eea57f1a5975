#include "board/host/program.hpp"

#include <fmt/format.h>

#include "board/host/commands/commands.hpp"
#include "board/support/errors.hpp"
#include "board/support/nearest_name.hpp"

namespace tricoil::host {
namespace {

constexpr const char* kDescription =
    "tricoil: an open AC electromagnetic tracker.\n"
    "Computes position and attitude of a sensor from the nine couplings of three source and three sensor coils.";
constexpr const char* kFooter =
    "Exit codes: 0 success, 1 check failed, 2 bad usage or input, 3 device error;\n"
    "128 + signal: interrupted without a result.";

/// Names an unknown subcommand and the nearest valid one. CLI11 reports it as an extra argument.
void refuse_unknown_command(const CLI::App& program, const std::vector<std::string>& arguments) {
    if (arguments.empty() || arguments.front().starts_with('-')) {
        return;
    }
    std::vector<std::string> names;
    for (const CLI::App* command : program.get_subcommands({})) {
        names.push_back(command->get_name());
    }
    index_of_name("command", arguments.front(), names);
}

/// Adds the expected type: CLI11 names only the value that it could not convert.
std::string what_is_expected(const CLI::App& program, const CLI::ParseError& error) {
    const std::string text = error.what();
    const auto begin = text.find("--");
    if (dynamic_cast<const CLI::ConversionError*>(&error) == nullptr || begin == std::string::npos) {
        return "";
    }
    const std::string name = text.substr(begin, text.find(' ', begin) - begin);
    const auto commands = program.get_subcommands();
    const CLI::Option* const option = commands.empty() ? nullptr : commands.front()->get_option_no_throw(name);
    if (option == nullptr) {
        return "";
    }
    std::string expected = option->get_type_name() == "FLOAT" ? "a number" : "a whole number";
    if (option->get_items_expected_max() > 1) {
        expected = fmt::format("{} comma-separated numbers", option->get_items_expected_max());
    }
    return fmt::format(" (expected: {})", expected);
}

}  // namespace

int run_program(const std::vector<std::string>& arguments) {
    CLI::App program{kDescription, "tricoil"};
    program.footer(kFooter);
    program.set_version_flag("--version", "tricoil " TRICOIL_VERSION);
    program.require_subcommand(1);
    Action action;
    add_run_command(program, action);
    add_demodulate_command(program, action);
    add_figures_command(program, action);
    add_motion_command(program, action);
    add_selfcheck_command(program, action);
    add_calibrate_command(program, action);
    add_evaluate_command(program, action);
    add_protocol_command(program, action);
    add_device_command(program, action);
    add_replay_command(program, action);
    add_smooth_command(program, action);
    add_convert_command(program, action);
    add_plot_command(program, action);
    add_couplings_command(program, action);
    add_serve_command(program, action);
    refuse_unknown_command(program, arguments);
    try {
        program.parse(std::vector<std::string>(arguments.rbegin(), arguments.rend()));  // CLI11 expects reverse order
    } catch (const CLI::ParseError& error) {
        if (error.get_exit_code() == 0) {  // --help and --version arrive as exceptions too
            program.exit(error);
            return to_int(ExitCode::fine);
        }
        throw InputError(error.what() + what_is_expected(program, error) + "; see tricoil --help");
    }
    return action();
}

}  // namespace tricoil::host
