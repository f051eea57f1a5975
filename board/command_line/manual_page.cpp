#include "board/command_line/manual_page.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>

#include "board/command_line/help_text.hpp"
#include "board/support/whole_file.hpp"

namespace tricoil::host {
namespace {

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

std::string entry(const std::string& heading, const std::string& meaning) {
    return fmt::format(".TP\n.B {}\n{}\n", escaped(heading), escaped(meaning));
}

std::string options(const CLI::App& command) {
    std::string out;
    const auto all = options_of(command);
    for (const std::string& group : groups_of(all)) {
        out += section(group);
        for (const CLI::Option* option : all) {
            out += option->get_group() == group ? entry(option_heading(*option), option_meaning(*option)) : "";
        }
    }
    return out;
}

std::string arguments(const CLI::App& command) {
    std::string out;
    for (const CLI::Option* argument : arguments_of(command)) {
        out += entry(shown_name(*argument), argument->get_description());
    }
    return out.empty() ? out : section("Arguments") + out;
}

std::string commands(const CLI::App& command) {
    std::string out;
    for (const CLI::App* one : commands_of(command)) {
        out += entry(one->get_name(), one->get_description());
    }
    return out.empty() ? out : section("Commands") + out;
}

/// Subcommands of a command have no page of their own.
std::string subcommand_details(const CLI::App& command) {
    std::string out;
    if (command.get_parent() == nullptr) {
        return out;
    }
    for (const CLI::App* one : commands_of(command)) {
        out += section(command_path(*one) + usage_arguments(*one)) + escaped(one->get_description()) + "\n";
        for (const CLI::Option* argument : arguments_of(*one)) {
            out += entry(shown_name(*argument), argument->get_description());
        }
        for (const CLI::Option* option : options_of(*one)) {
            out += entry(option_heading(*option), option_meaning(*option));
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
    return section("Exit status") + entry("0", "success") + entry("1", "a check failed") + entry("2", "bad usage or input") +
           entry("3", "device error") + entry("128 + signal", "interrupted without a result");
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

std::string manual_page(const CLI::App& command, const std::vector<ManualSection>& further) {
    const std::string name = page_name(command);
    std::string out = fmt::format(".TH {} 1 \"\" tricoil \"User commands\"\n", escaped(in_capitals(name)));
    out += section("Name") + fmt::format("{} \\- {}\n", escaped(name), escaped(summary(command)));
    out += section("Synopsis") +
           fmt::format(".B {}{}\n[OPTIONS]\n", escaped(command_path(command)), escaped(usage_arguments(command)));
    out += section("Description") + escaped(command.get_description()) + "\n";
    out += commands(command) + subcommand_details(command) + arguments(command) + options(command);
    for (const ManualSection& one : further) {
        out += section(one.title);
        for (const Candidate& what : one.entries) {
            out += entry(what.word, what.meaning);
        }
    }
    return out + examples(command) + exit_status() + see_also(command);
}

void write_manual_pages(const CLI::App& program, const std::string& folder, const std::vector<ManualSection>& further,
                        const std::set<std::string>& without) {
    write_whole_file(fmt::format("{}/{}.1", folder, page_name(program)), manual_page(program, further));
    for (const CLI::App* command : commands_of(program)) {
        if (!without.contains(command->get_name())) {
            write_whole_file(fmt::format("{}/{}.1", folder, page_name(*command)), manual_page(*command));
        }
    }
}

}  // namespace tricoil::host
