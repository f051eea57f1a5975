#include "board/command_line/parse.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "board/command_line/completion.hpp"
#include "board/command_line/help_text.hpp"
#include "board/command_line/word_walk.hpp"
#include "board/support/errors.hpp"
#include "board/support/terminal_text.hpp"

namespace tricoil::host {
namespace {

constexpr std::size_t kWidestHelp = 120;

void print_help(const CLI::App& command) { print_text(help_text(command, std::min(terminal_width(stdout), kWidestHelp))); }

/// Executes a command line of scripts or the build. Returns false for any other command line.
bool serve_scripts(const CLI::App& program, const std::vector<std::string>& words, const CommandLineParams& params) {
    if (words.empty() || (words.front() != kCompleteWord && words.front() != kManualWord)) {
        return false;
    }
    if (words.front() == kCompleteWord) {
        print_text(candidates_for(program, std::span(words).subspan(1), params.sources));
    } else if (words.size() == 2) {
        write_manual_pages(program, words[1], params.manual_sections, params.without_manual);
    } else {
        throw InputError(std::string(kManualWord) + " needs a folder");
    }
    return true;
}

}  // namespace

bool parse_words(CLI::App& program, const std::vector<std::string>& words, const CommandLineParams& params) {
    if (serve_scripts(program, words, params)) {
        return false;
    }
    const WordWalk seen = walk_words(program, words);
    if ((seen.wants_help && !seen.unknown_command) || (words.empty() && !commands_of(program).empty())) {
        print_help(*seen.command);
        return false;
    }
    if (!seen.error.empty()) {
        throw InputError(seen.error);
    }
    if (seen.open_option != nullptr) {
        throw InputError(missing_value(*seen.command, *seen.open_option));
    }
    try {
        program.parse(std::vector<std::string>(words.rbegin(), words.rend()));  // CLI11 expects reverse order
    } catch (const CLI::ParseError& error) {
        if (error.get_exit_code() == 0) {  // --version is an exception too
            print_text(std::string(error.what()) + "\n");
            return false;
        }
        throw InputError(text_of(error, program, params.sources));
    }
    return true;
}

void print_help_of(const CLI::App& program, const std::vector<std::string>& words) {
    const WordWalk seen = walk_words(program, words);
    const bool has_more = seen.arguments > 0 && seen.error.empty();
    if (has_more || !seen.error.empty()) {
        throw InputError(has_more ? fmt::format("{} has no commands", command_path(*seen.command)) : seen.error);
    }
    print_help(*seen.command);
}

bool parse_command_line(CLI::App& program, int argc, char** argv) { return parse_words(program, {argv + 1, argv + argc}); }

}  // namespace tricoil::host
