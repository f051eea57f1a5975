#include "board/command_line/help_text.hpp"

#include <fmt/format.h>

#include <sstream>

namespace tricoil::host {
namespace {

constexpr std::size_t kIndent = 2;
constexpr std::size_t kColumn = 26;  // of the meanings
constexpr std::size_t kLeastWidth = 60;

/// A heading in lines of at most `width`, broken between the words of a list.
std::string heading_lines(std::string rest, std::size_t width) {
    std::string out;
    while (rest.size() > width) {
        const std::size_t bar = rest.rfind('|', width - 1);
        if (bar == std::string::npos) {
            break;
        }
        out += rest.substr(0, bar + 1) + "\n";
        rest = std::string(3 * kIndent, ' ') + rest.substr(bar + 1);
    }
    return out + rest;
}

/// A row of two columns; a long heading has its own lines.
std::string row(const std::string& heading, const std::string& meaning, std::size_t width) {
    std::string out = heading_lines(std::string(kIndent, ' ') + heading, width);
    if (out.size() + 2 > kColumn) {
        out += "\n" + std::string(kColumn, ' ');
    } else {
        out.resize(kColumn, ' ');
    }
    return out + wrapped(meaning, kColumn, width) + "\n";
}

std::string option_rows(const std::vector<const CLI::Option*>& options, std::size_t width) {
    std::string out;
    for (const std::string& group : groups_of(options)) {
        out += "\n" + group + ":\n";
        for (const CLI::Option* option : options) {
            out += option->get_group() == group ? row(option_heading(*option), option_meaning(*option), width) : "";
        }
    }
    return out;
}

std::string argument_rows(const CLI::App& command, std::size_t width) {
    std::string out;
    for (const CLI::Option* argument : arguments_of(command)) {
        out += row(option_heading(*argument), option_meaning(*argument), width);
    }
    return out.empty() ? out : "\nArguments:\n" + out;
}

std::string command_rows(const CLI::App& command, std::size_t width) {
    std::string out;
    const auto commands = commands_of(command);
    for (const std::string& group : groups_of(commands)) {
        out += "\n" + (group == "Subcommands" ? "Commands" : group) + ":\n";
        for (const CLI::App* one : commands) {
            out += one->get_group() == group ? row(one->get_name(), one->get_description(), width) : "";
        }
    }
    return out;
}

std::string example_rows(const CLI::App& command) {
    std::string out;
    for (const std::string& line : example_lines(command)) {
        out += std::string(kIndent, ' ') + line + "\n";
    }
    return out.empty() ? out : "\nExamples:\n" + out;
}

}  // namespace

std::string wrapped(const std::string& text, std::size_t indent, std::size_t width) {
    std::string out;
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) {
        std::size_t column = width + 1;  // a new line begins
        std::istringstream words(line);
        for (std::string word; words >> word; column += word.size() + 1) {
            if (column + word.size() > width) {
                out += out.empty() ? "" : "\n" + std::string(indent, ' ');
                column = indent;
            } else {
                out += ' ';
            }
            out += word;
        }
    }
    return out;
}

std::string usage_arguments(const CLI::App& command) {
    std::string out = commands_of(command).empty() ? "" : " COMMAND";
    for (const CLI::Option* argument : arguments_of(command)) {
        const std::string name = shown_name(*argument) + (argument->get_expected_max() > 1 ? "..." : "");
        out += argument->get_required() ? " " + name : " [" + name + "]";
    }
    return out;
}

std::string option_heading(const CLI::Option& option) {
    const std::string type = type_of(option);
    std::string short_names;
    for (const std::string& letter : option.get_snames()) {
        short_names += "-" + letter + ", ";
    }
    return short_names + shown_name(option) + (is_flag(option) || !option.nonpositional() ? "" : " " + type);
}

std::string option_meaning(const CLI::Option& option) {
    const std::string preset = option.get_default_str();
    const bool is_shown = !preset.empty() && preset != "[]" && preset != "\"\"";
    return option.get_description() + (is_shown && option.nonpositional() ? " (default: " + preset + ")" : "") +
           (option.get_required() && option.nonpositional() ? " (required)" : "");
}

std::string help_text(const CLI::App& command, std::size_t full_width) {
    const std::size_t width = std::max(full_width, kLeastWidth);
    std::string out = wrapped(command.get_description(), 0, width) + "\n";
    out += fmt::format("\nUsage: {}{} [OPTIONS]\n", command_path(command), usage_arguments(command));
    out += argument_rows(command, width) + command_rows(command, width);
    out += option_rows(options_of(command), width) + example_rows(command);
    const bool is_program = command.get_parent() == nullptr;
    const std::string more =
        commands_of(command).empty() ? "" : fmt::format("Help of a command: {} COMMAND --help\n", command_path(command));
    return out + (more.empty() ? "" : "\n" + more) +
           (is_program ? wrapped("Exit codes: 0 success, 1 check failed, 2 bad usage or input, 3 device error, 128 + signal: "
                                 "interrupted without a result.",
                                 0, width) +
                             "\n"
                       : "");
}

}  // namespace tricoil::host
