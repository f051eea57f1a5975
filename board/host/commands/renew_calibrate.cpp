// The spelling of the last version of tricoil calibrate, in which each kind was an option.
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "board/host/commands/commands.hpp"
#include "board/support/errors.hpp"
#include "board/support/terminal_text.hpp"

namespace tricoil::host {
namespace {

/// A kind as the last version spelled it, and today.
struct OldKind {
    std::string_view option;
    std::string_view kind;
    std::string_view use;
};
constexpr OldKind kOldKinds[] = {
    {"", "stage", "stage"},
    {"--grid", "grid", "grid"},
    {"--free-motion", "free-motion", "free-motion"},
    {"--surroundings", "surroundings", "surroundings (with --spacing-mm, the data are of a grid)"},
    {"--low-band", "low-band", "low-band"},
    {"--pivot", "pivot", "pivot"},
    {"--wiring", "wiring", "wiring --at X,Y,Z"},
    {"--converters", "converters", "converters"},
};

const OldKind* old_kind(std::string_view option) {
    const auto* const found = std::ranges::find(kOldKinds, option.substr(0, option.find('=')), &OldKind::option);
    return option.empty() || found == std::end(kOldKinds) ? nullptr : found;
}

/// Neither help nor a kind of today, but an old kind or, without one, data. A bare word that names no file may be a mistyped
/// kind.
bool is_old_spelling(const std::vector<std::string>& words) {
    const std::vector<std::string> given(words.begin() + 1, std::find(words.begin(), words.end(), "--"));
    const auto is_of_today = [](const std::string& word) {
        return word == "--help" || word == "-h" || std::ranges::find(kOldKinds, word, &OldKind::kind) != std::end(kOldKinds);
    };
    if (given.empty() || std::ranges::any_of(given, is_of_today)) {
        return false;
    }
    const auto is_file = [](const std::string& word) { return std::filesystem::exists(word); };
    return std::ranges::any_of(given, old_kind) || is_file(given[0]) ||
           (given[0].starts_with('-') && std::any_of(words.begin() + 1, words.end(), is_file));
}

/// The kind of both; a grid is also data of surroundings. Throws InputError for any other two.
const OldKind* combined(const OldKind* one, const OldKind* other) {
    const auto is_pair = [&](std::string_view a, std::string_view b) { return one->kind == a && other->kind == b; };
    if (one->option.empty() || one == other || is_pair("grid", "surroundings")) {
        return other;
    }
    if (is_pair("surroundings", "grid")) {
        return one;
    }
    throw InputError(
        fmt::format("{} and {}: each is a calibration of its own; choose tricoil calibrate {} or tricoil calibrate {}",
                    one->option, other->option, one->kind, other->kind));
}

}  // namespace

std::vector<std::string> renew_calibrate(const std::vector<std::string>& words) {
    if (!is_old_spelling(words)) {
        return words;
    }
    const OldKind* kind = std::begin(kOldKinds);
    std::vector<std::string> renewed{words[0], ""};
    const auto end = std::find(words.begin(), words.end(), "--");
    for (auto word = words.begin() + 1; word != words.end(); ++word) {
        const OldKind* const named = word < end ? old_kind(*word) : nullptr;
        kind = named == nullptr ? kind : combined(kind, named);
        if (named == nullptr) {
            renewed.push_back(*word);
        } else if (named->kind == "wiring") {
            renewed.push_back("--at" + word->substr(named->option.size()));
        }
    }
    renewed[1] = kind->kind;
    print_hint("tricoil: calibrate {}: the next version refuses this spelling; use tricoil calibrate {}\n",
               kind->option.empty() ? "without a kind" : kind->option, kind->use);
    return renewed;
}

}  // namespace tricoil::host
