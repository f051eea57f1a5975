// Parses a command line: help, version, and errors of one line.
#pragma once

#include <set>
#include <string>
#include <vector>

#include "board/command_line/help_text.hpp"
#include "board/command_line/option_words.hpp"

namespace tricoil::host {

/// First words of command lines that are for scripts and the build, not for people.
constexpr const char* kCompleteWord = "__complete";  // candidates for the last of the words that follow
constexpr const char* kManualWord = "__manual";      // writes the manual pages into the folder that follows

/// Texts that the table of options does not contain.
struct CommandLineParams {
    ValueSources sources;
    std::vector<HelpSection> manual_sections;
    std::set<std::string> without_manual = {};  // commands of other executables
};

/// Parses the words. Prints what was asked for (help, version) and returns false then. Throws InputError for wrong words.
bool parse_words(CLI::App& program, const std::vector<std::string>& words, const CommandLineParams& params = {});

/// Prints the help of the command that the words name. Throws InputError for an unknown command.
void print_help_of(const CLI::App& program, const std::vector<std::string>& words);

/// parse_words() for the arguments of main().
bool parse_command_line(CLI::App& program, int argc, char** argv);

}  // namespace tricoil::host
