#include "board/command_line/help_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <sstream>

#include "board/support/output_file.hpp"

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

std::string rows(const std::vector<HelpSection>& sections, std::size_t width) {
    std::string out;
    for (const HelpSection& section : sections) {
        out += "\n" + section.title + ":\n";
        for (const Candidate& entry : section.entries) {
            out += row(entry.word, entry.meaning, width);
        }
    }
    return out;
}

/// Words of the usage line, without options: "COMMAND", "DATA...".
std::string usage_arguments(const CLI::App& command) {
    std::string out = commands_of(command).empty() ? "" : " COMMAND";
    for (const CLI::Option* argument : arguments_of(command)) {
        const std::string name = shown_name(*argument) + (argument->get_expected_max() > 1 ? "..." : "");
        out += argument->get_required() ? " " + name : " [" + name + "]";
    }
    return out;
}

/// "--out FILE" and the description, with default and whether it is required; "POSES" for an argument.
Candidate entry_of(const CLI::Option& option) {
    std::string heading;
    for (const std::string& letter : option.get_snames()) {
        heading += "-" + letter + ", ";
    }
    heading += shown_name(option);
    if (!option.nonpositional()) {
        return {heading, option.get_description()};
    }
    const std::string preset = option.get_default_str();
    const bool is_shown = !preset.empty() && preset != "[]" && preset != "\"\"";
    return {
        heading + (is_flag(option) ? "" : " " + type_of(option)),
        option.get_description() + (is_shown ? " (default: " + preset + ")" : "") + (option.get_required() ? " (required)" : "")};
}
Candidate entry_of(const CLI::App& command) { return {command.get_name(), command.get_description()}; }

/// Sections of the options or commands by their groups, in the order of their first member.
template <typename Member>
std::vector<HelpSection> by_group(const std::vector<const Member*>& members) {
    std::vector<HelpSection> sections;
    for (const Member* member : members) {
        const std::string title = member->get_group() == "Subcommands" ? "Commands" : member->get_group();
        auto section = std::find_if(sections.begin(), sections.end(), [&](const HelpSection& one) { return one.title == title; });
        if (section == sections.end()) {
            section = sections.insert(section, HelpSection{title, {}});
        }
        section->entries.push_back(entry_of(*member));
    }
    return sections;
}

/// One section of all members; none without members.
template <typename Member>
std::vector<HelpSection> as_one(const std::string& title, const std::vector<const Member*>& members) {
    HelpSection section{title, {}};
    for (const Member* member : members) {
        section.entries.push_back(entry_of(*member));
    }
    return section.entries.empty() ? std::vector<HelpSection>{} : std::vector<HelpSection>{section};
}

std::string example_rows(const CLI::App& command) {
    std::string out;
    for (const std::string& line : example_lines(command)) {
        out += std::string(kIndent, ' ') + line + "\n";
    }
    return out.empty() ? out : "\nExamples:\n" + out;
}

/// Escapes what man would interpret: backslashes, hyphens, and a dot or quote at the start of a line.
std::string escaped(const std::string& text) {
    std::string out;
    for (const char c : text) {
        const bool starts_line = out.empty() || out.back() == '\n';
        if (starts_line && (c == '.' || c == '\'')) {
            out += "\\&";
        }
        out += c == '\\' ? std::string("\\e") : c == '-' ? std::string("\\-") : std::string(1, c);
    }
    return out;
}

std::string page_name(const CLI::App& command) {
    std::string name = command_path(command);
    std::replace(name.begin(), name.end(), ' ', '-');
    return name;
}

std::string in_capitals(std::string text) {
    std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
    return text;
}

std::string section(const std::string& title) { return ".SH " + in_capitals(title) + "\n"; }

std::string entries(const std::vector<Candidate>& all) {
    std::string out;
    for (const Candidate& one : all) {
        out += fmt::format(".TP\n.B {}\n{}\n", escaped(one.word), escaped(one.meaning));
    }
    return out;
}

std::string paragraphs(const std::vector<HelpSection>& sections) {
    std::string out;
    for (const HelpSection& one : sections) {
        out += section(one.title) + entries(one.entries);
    }
    return out;
}

/// Subcommands of a command have no page of their own.
std::string subcommand_details(const CLI::App& command) {
    std::string out;
    if (command.get_parent() == nullptr) {
        return out;
    }
    for (const CLI::App* one : commands_of(command)) {
        out += section(command_path(*one) + usage_arguments(*one)) + escaped(one->get_description()) + "\n";
        for (const auto& options : {arguments_of(*one), options_of(*one)}) {
            for (const CLI::Option* option : options) {
                out += entries({entry_of(*option)});
            }
        }
    }
    return out;
}

std::string examples(const CLI::App& command) {
    std::string out;
    for (const std::string& line : example_lines(command)) {
        out += line.starts_with("# ") ? ".PP\n" + escaped(line.substr(2)) + ":\n"
                                      : fmt::format(".PP\n.RS 4\n.EX\n{}\n.EE\n.RE\n", escaped(line));
    }
    return out.empty() ? out : section("Examples") + out;
}

std::string exit_status() {
    return paragraphs({{"Exit status",
                        {{"0", "success"},
                         {"1", "a check failed"},
                         {"2", "bad usage or input"},
                         {"3", "device error"},
                         {"128 + signal", "interrupted without a result"}}}});
}

std::string see_also(const CLI::App& command) {
    std::string out;
    const CLI::App* const parent = command.get_parent();
    if (parent != nullptr) {
        out = fmt::format(".BR {} (1)\n", escaped(page_name(*parent)));
    } else {
        for (const CLI::App* one : commands_of(command)) {
            out += fmt::format("{}.BR {} (1)", out.empty() ? "" : ",\n", escaped(page_name(*one)));
        }
        out += out.empty() ? "" : "\n";
    }
    return out.empty() ? out : section("See also") + out;
}

/// The first sentence of the description: man and apropos show it on one line.
std::string summary(const CLI::App& command) {
    const std::string& text = command.get_description();
    const std::string line = text.substr(0, text.find('\n'));
    const std::string name = command_path(command) + ": ";
    return line.starts_with(name) ? line.substr(name.size()) : line;
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

std::string help_text(const CLI::App& command, std::size_t full_width) {
    const std::size_t width = std::max(full_width, kLeastWidth);
    std::string out = wrapped(command.get_description(), 0, width) + "\n";
    out += fmt::format("\nUsage: {}{} [OPTIONS]\n", command_path(command), usage_arguments(command));
    out += rows(as_one("Arguments", arguments_of(command)), width) + rows(by_group(commands_of(command)), width);
    out += rows(by_group(options_of(command)), width) + example_rows(command);
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

std::string manual_page(const CLI::App& command, const std::vector<HelpSection>& further) {
    const std::string name = page_name(command);
    std::string out = fmt::format(".TH {} 1 \"\" tricoil \"User commands\"\n", escaped(in_capitals(name)));
    out += section("Name") + fmt::format("{} \\- {}\n", escaped(name), escaped(summary(command)));
    out += section("Synopsis") +
           fmt::format(".B {}{}\n[OPTIONS]\n", escaped(command_path(command)), escaped(usage_arguments(command)));
    out += section("Description") + escaped(command.get_description()) + "\n";
    out += paragraphs(as_one("Commands", commands_of(command))) + subcommand_details(command);
    out +=
        paragraphs(as_one("Arguments", arguments_of(command))) + paragraphs(by_group(options_of(command))) + paragraphs(further);
    return out + examples(command) + exit_status() + see_also(command);
}

void write_manual_pages(const CLI::App& program, const std::string& folder, const std::vector<HelpSection>& further,
                        const std::set<std::string>& without) {
    write_whole_file(fmt::format("{}/{}.1", folder, page_name(program)), manual_page(program, further));
    for (const CLI::App* command : commands_of(program)) {
        if (!without.contains(command->get_name())) {
            write_whole_file(fmt::format("{}/{}.1", folder, page_name(*command)), manual_page(*command));
        }
    }
}

}  // namespace tricoil::host
