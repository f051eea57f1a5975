// Assigns the words of a command line to commands, options and values before CLI11 parses them, for help, errors and completion.
#pragma once

#include <span>
#include <string>

#include "board/command_line/option_words.hpp"

namespace tricoil::host {

struct WordWalk {
    const CLI::App* command = nullptr;         // the last command that was named
    const CLI::Option* open_option = nullptr;  // its value is missing at the end of the words
    std::size_t arguments = 0;                 // number of the command's words without dashes
    bool options_ended = false;                // after the word --
    bool wants_help = false;                   // --help or -h
    bool unknown_command = false;              // the first wrong word is no command
    std::string error;                         // about the first wrong word, one line; empty: none
};

WordWalk walk_words(const CLI::App& program, std::span<const std::string> words);

// Texts of errors in a command line: one line that names the word and the remedy.

std::string unknown_command(const CLI::App& command, const std::string& word);
std::string unknown_option(const CLI::App& command, const std::string& word);
std::string missing_value(const CLI::App& command, const CLI::Option& option);
std::string unexpected_value(const CLI::App& command, const CLI::Option& flag);
std::string missing_command(const CLI::App& command);

/// Text of an error that CLI11 found in the words of `program`.
std::string text_of(const CLI::ParseError& error, const CLI::App& program, const ValueSources& sources);

}  // namespace tricoil::host
