// Command line of a program without subcommands.
#pragma once

#include <CLI/CLI.hpp>

#include "board/support/errors.hpp"

namespace tricoil::host {

/// Returns false if help was requested and printed. Throws InputError if the command line is invalid.
inline bool parse_command_line(CLI::App& program, int argc, char** argv) {
    try {
        program.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
        if (error.get_exit_code() == 0) {  // help is reported as an exception too
            program.exit(error);
            return false;
        }
        throw InputError(error.what());
    }
    return true;
}

}  // namespace tricoil::host
