// Texts of errors in a command line: one line that names the word and the remedy.
#pragma once

#include <string>

#include "board/command_line/option_words.hpp"

namespace tricoil::host {

std::string unknown_command(const CLI::App& command, const std::string& word);
std::string unknown_option(const CLI::App& command, const std::string& word);
std::string missing_value(const CLI::App& command, const CLI::Option& option);
std::string unexpected_value(const CLI::App& command, const CLI::Option& flag);
std::string missing_command(const CLI::App& command);

/// Text of an error that CLI11 found in the words of `program`.
std::string text_of(const CLI::ParseError& error, const CLI::App& program, const ValueSources& sources);

}  // namespace tricoil::host
