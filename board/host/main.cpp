// The `tricoil` program: parses the command line, runs one subcommand, prints errors as one line.
#include <fmt/format.h>

#include <csignal>
#include <exception>
#include <new>

#include "board/host/commands/commands.hpp"
#include "board/support/errors.hpp"
#include "board/support/memory_reserve.hpp"
#include "board/support/nearest_name.hpp"
#include "board/support/terminal_text.hpp"

namespace {

using tricoil::host::ExitCode;
using tricoil::host::to_int;

constexpr int kSignalled = 128;  // the exit code is this plus the signal number

constexpr const char* kDescription =
    "tricoil: an open AC electromagnetic tracker.\n"
    "Computes position and attitude of a sensor from the nine couplings of three source and three sensor coils.";
constexpr const char* kFooter =
    "Exit codes: 0 success, 1 check failed, 2 bad usage or input, 3 device error;\n"
    "128 + signal: interrupted without a result.";

/// Names an unknown subcommand and the nearest valid one. CLI11 reports it as an extra argument.
void refuse_unknown_command(const CLI::App& program, int argc, char** argv) {
    if (argc < 2 || argv[1][0] == '-') {
        return;
    }
    std::vector<std::string> names;
    for (const CLI::App* command : program.get_subcommands({})) {
        names.push_back(command->get_name());
    }
    tricoil::host::index_of_name("command", argv[1], names);
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

int run_program(int argc, char** argv) {
    CLI::App program{kDescription, "tricoil"};
    program.footer(kFooter);
    program.set_version_flag("--version", "tricoil " TRICOIL_VERSION);
    program.require_subcommand(1);
    tricoil::host::Action action;
    tricoil::host::add_run_command(program, action);
    tricoil::host::add_demodulate_command(program, action);
    tricoil::host::add_figures_command(program, action);
    tricoil::host::add_motion_command(program, action);
    tricoil::host::add_selfcheck_command(program, action);
    tricoil::host::add_calibrate_command(program, action);
    tricoil::host::add_evaluate_command(program, action);
    tricoil::host::add_protocol_command(program, action);
    tricoil::host::add_device_command(program, action);
    tricoil::host::add_replay_command(program, action);
    tricoil::host::add_convert_command(program, action);
    tricoil::host::add_couplings_command(program, action);
    tricoil::host::add_serve_command(program, action);
    refuse_unknown_command(program, argc, argv);
    try {
        program.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
        if (error.get_exit_code() == 0) {  // --help and --version arrive as exceptions too
            program.exit(error);
            return to_int(ExitCode::fine);
        }
        throw tricoil::host::InputError(error.what() + what_is_expected(program, error) + "; see tricoil --help");
    }
    return action();
}

int report(int code, const char* line) {
    tricoil::host::print_notice("tricoil: {}\n", line);
    return code;
}

int run_to_the_end(int argc, char** argv) {
    tricoil::host::ignore_broken_pipe();
    const int code = run_program(argc, argv);
    tricoil::host::end_standard_output();
    return code;
}

}  // namespace

int main(int argc, char** argv) {
    tricoil::host::set_memory_aside();
    try {
        return run_to_the_end(argc, argv);
    } catch (const std::invalid_argument& error) {
        return report(to_int(ExitCode::bad_input), error.what());
    } catch (const tricoil::host::Interrupted& interrupt) {
        return report(interrupt.exit_code(), interrupt.what());
    } catch (const std::bad_alloc&) {
        return report(to_int(ExitCode::device_error), "out of memory; the input is too large for this machine");
    } catch (const std::exception& error) {
        if (tricoil::host::reader_is_gone()) {  // exit as if terminated by SIGPIPE
            return kSignalled + SIGPIPE;
        }
        return report(to_int(ExitCode::device_error), error.what());
    }
}
