// The command line of a program that is one command.
#pragma once

#include <CLI/CLI.hpp>

#include "board/support/errors.hpp"

namespace tricoil::host {

/// False if there is nothing more to do: help was asked for, and printed. Throws InputError for what cannot be parsed.
inline bool parse_command_line(CLI::App& program, int argc, char** argv) {
    try {
        program.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
        if (error.get_exit_code() == 0) {  // help arrives as an exception too
            program.exit(error);
            return false;
        }
        throw InputError(error.what());
    }
    return true;
}

}  // namespace tricoil::host
