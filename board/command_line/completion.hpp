// Completion of command lines for shells, from the table of options.
#pragma once

#include <span>
#include <string>

#include "board/command_line/option_words.hpp"

namespace tricoil::host {

/// Shells for which there is a script.
const std::vector<std::string>& shell_names();
/// Script that makes the shell ask the program for candidates: `tricoil __complete WORD...`. Throws InputError for an unknown
/// shell.
std::string completion_script(const std::string& shell);

/// Candidates for the last word, one a line: word, tab, meaning. The lines ":file" and ":folder" ask the shell for names of files
/// or folders.
std::string candidates_for(const CLI::App& program, std::span<const std::string> words, const ValueSources& sources);

}  // namespace tricoil::host
