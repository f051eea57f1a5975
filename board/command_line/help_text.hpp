// Help and manual pages (man) of a command, from its table of options.
#pragma once

#include <set>
#include <string>
#include <vector>

#include "board/command_line/option_words.hpp"

namespace tricoil::host {

/// A section of a help or manual page: its paragraphs begin with a heading.
struct HelpSection {
    std::string title;
    std::vector<Candidate> entries;
};

/// Description, usage, arguments, options in their groups, commands, examples. Lines have at most `width` columns; an example is
/// never broken.
std::string help_text(const CLI::App& command, std::size_t width);

/// Breaks each line of the text between words. All lines but the first are indented.
std::string wrapped(const std::string& text, std::size_t indent, std::size_t width);

/// Page of a command; of a program if it has no parent. Source text for man.
std::string manual_page(const CLI::App& command, const std::vector<HelpSection>& further = {});

/// Writes the pages of the program and of its commands into an existing folder: tricoil.1, tricoil-run.1, ..., but not of the
/// commands `without`.
void write_manual_pages(const CLI::App& program, const std::string& folder, const std::vector<HelpSection>& further = {},
                        const std::set<std::string>& without = {});

}  // namespace tricoil::host
