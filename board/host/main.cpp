// The `tricoil` program: parses the line, runs one subcommand, prints one line for an error.
#include <fmt/format.h>

#include <exception>

#include "board/host/commands/commands.hpp"
#include "board/host/errors.hpp"

namespace {

constexpr int to_int(tricoil::host::ExitCode code) { return static_cast<int>(code); }

int run_program(int argc, char** argv) {
    CLI::App program{
        "tricoil: an open AC electromagnetic tracker. Exit codes: 0 fine, 1 check failed, 2 bad usage or input, 3 device "
        "trouble."};
    program.set_version_flag("--version", "tricoil " TRICOIL_VERSION);
    program.require_subcommand(1);
    tricoil::host::Action action;
    try {
        program.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
        const bool is_answer = error.get_exit_code() == 0;  // --help and --version arrive as exceptions too
        program.exit(error);
        return to_int(is_answer ? tricoil::host::ExitCode::fine : tricoil::host::ExitCode::bad_input);
    }
    return action();
}

}  // namespace

int main(int argc, char** argv) {
    try {
        return run_program(argc, argv);
    } catch (const tricoil::host::CommandError& error) {
        fmt::print(stderr, "tricoil: {}\n", error.what());
        return to_int(error.code());
    } catch (const std::exception& error) {
        fmt::print(stderr, "tricoil: unexpected: {}\n", error.what());
        return to_int(tricoil::host::ExitCode::device_trouble);
    }
}
