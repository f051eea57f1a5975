#include "board/host/commands/see_it.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <string_view>

#include "board/command_line/option_words.hpp"

namespace tricoil::host {
namespace {

/// A negative number needs no quotes, and shell_word() would make it a path.
std::string value_word(const std::string& value) { return value.starts_with('-') ? value : shell_word(value); }

std::string option_words(const CLI::Option& option) {
    if (is_flag(option)) {
        return " " + shown_name(option);
    }
    if (option.get_delimiter() == ',') {  // the words of one value
        return fmt::format(" {} {}", shown_name(option), value_word(fmt::format("{}", fmt::join(option.results(), ","))));
    }
    std::string words;
    for (const std::string& value : option.results()) {
        words += fmt::format(" {} {}", shown_name(option), value_word(value));
    }
    return words;
}

}  // namespace

std::string see_it_command(const CLI::App& run, const std::vector<const CLI::Option*>& shared) {
    std::string words = shell_word(run.get_parent()->get_name()) + " serve --web 8080";
    for (const CLI::Option* option : shared) {
        constexpr std::array<std::string_view, 5> kNotOfThePage{"--duration", "--record", "--units", "--euler", "--align"};
        const bool is_of_page = std::ranges::find(kNotOfThePage, shown_name(*option)) == kNotOfThePage.end();
        words += option->count() > 0 && is_of_page ? option_words(*option) : "";
    }
    return words;
}

}  // namespace tricoil::host
