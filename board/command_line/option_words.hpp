// Names and values of the options of a CLI::App, which is the only table of commands and options: help, errors, completion and
// manual pages are made from it.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <map>
#include <string>
#include <vector>

namespace tricoil::host {

/// A word that completion offers, with its meaning.
struct Candidate {
    std::string word;
    std::string meaning;  // may be empty
};

/// Values of options whose type name is the key, for example SCENARIO.
using ValueSources = std::map<std::string, std::function<std::vector<Candidate>()>>;

/// Type names of files and folders, which the shell completes.
constexpr const char* kFileType = "FILE";
constexpr const char* kFolderType = "FOLDER";
/// The word of a candidate that stands for all files.
constexpr const char* kFiles = ":file";

/// The value is one of `words`.
CLI::Option* one_of(CLI::Option* option, const std::vector<std::string>& words);

/// An example of a command's help. The command line can be pasted.
struct Example {
    std::string what;
    std::string line;
};
void set_examples(CLI::App* command, const std::vector<Example>& examples);
/// Lines of a command's examples; of its commands' examples if it has none.
std::vector<std::string> example_lines(const CLI::App& command);

/// "tricoil device list": the program and its commands.
std::string command_path(const CLI::App& command);
/// "--out", or the name of an argument without dashes, in capitals.
std::string shown_name(const CLI::Option& option);
/// "FILE", "tdm|fdm", "NUMBER"; empty for a flag.
std::string type_of(const CLI::Option& option);
/// Words of one_of(); empty for another option.
std::vector<std::string> choices_of(const CLI::Option& option);
/// Candidates for the value of an option, without files and folders.
std::vector<Candidate> values_of(const CLI::Option& option, const ValueSources& sources);

bool is_flag(const CLI::Option& option);
bool is_help(const CLI::Option& option);
/// Options with dashes, without help, in the order of their definition.
std::vector<const CLI::Option*> options_of(const CLI::App& command);
/// Arguments without dashes.
std::vector<const CLI::Option*> arguments_of(const CLI::App& command);
/// Subcommands in the order of their definition.
std::vector<const CLI::App*> commands_of(const CLI::App& command);

/// `text` quoted as one word for the shell. A text that begins with - becomes a path, so that it is not an option.
std::string shell_word(const std::string& text);

/// The option with this name, --name or -n; null: none.
const CLI::Option* find_option(const CLI::App& command, const std::string& name);

}  // namespace tricoil::host
