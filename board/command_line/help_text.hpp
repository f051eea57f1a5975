// Help of a command, from its table of options.
#pragma once

#include <string>

#include "board/command_line/option_words.hpp"

namespace tricoil::host {

/// Description, usage, arguments, options in their groups, commands, examples. Lines have at most `width` columns; an example is
/// never broken.
std::string help_text(const CLI::App& command, std::size_t width);

/// Breaks each line of the text between words. All lines but the first are indented.
std::string wrapped(const std::string& text, std::size_t indent, std::size_t width);

/// Words of the usage line, without options: "COMMAND", "DATA...".
std::string usage_arguments(const CLI::App& command);
/// "--out FILE"; "POSES" for an argument.
std::string option_heading(const CLI::Option& option);
/// Description, default and whether it is required.
std::string option_meaning(const CLI::Option& option);

/// Groups of the options or commands, in the order of their first member.
template <typename Member>
std::vector<std::string> groups_of(const std::vector<const Member*>& members) {
    std::vector<std::string> groups;
    for (const Member* member : members) {
        if (std::find(groups.begin(), groups.end(), member->get_group()) == groups.end()) {
            groups.push_back(member->get_group());
        }
    }
    return groups;
}

}  // namespace tricoil::host
