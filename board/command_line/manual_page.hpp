// Manual pages (man) from the table of options.
#pragma once

#include <set>
#include <string>
#include <vector>

#include "board/command_line/option_words.hpp"

namespace tricoil::host {

/// A further section, for example FILES: its paragraphs begin with a heading.
struct ManualSection {
    std::string title;
    std::vector<Candidate> entries;
};

/// Page of a command; of a program if it has no parent. Source text for man.
std::string manual_page(const CLI::App& command, const std::vector<ManualSection>& further = {});

/// Writes the pages of the program and of its commands into an existing folder: tricoil.1, tricoil-run.1, ..., but not of the
/// commands `without`.
void write_manual_pages(const CLI::App& program, const std::string& folder, const std::vector<ManualSection>& further = {},
                        const std::set<std::string>& without = {});

}  // namespace tricoil::host
