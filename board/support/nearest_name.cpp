#include "board/support/nearest_name.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <numeric>

#include "board/support/errors.hpp"

namespace tricoil::host {
namespace {

/// Levenshtein distance: number of insertions, deletions and substitutions that change a to b.
std::size_t edit_distance(std::string_view a, std::string_view b) {
    std::vector<std::size_t> row(b.size() + 1);
    std::iota(row.begin(), row.end(), std::size_t{0});
    for (std::size_t i = 0; i < a.size(); ++i) {
        std::size_t diagonal = row[0];
        row[0] = i + 1;
        for (std::size_t j = 0; j < b.size(); ++j) {
            const std::size_t substituted = diagonal + (a[i] == b[j] ? 0 : 1);
            diagonal = row[j + 1];
            row[j + 1] = std::min({row[j + 1] + 1, row[j] + 1, substituted});
        }
    }
    return row.back();
}

}  // namespace

std::string nearest_name(std::string_view typed, const std::vector<std::string>& choices) {
    const auto begins = [&](const std::string& choice) { return !typed.empty() && choice.starts_with(typed); };
    if (std::count_if(choices.begin(), choices.end(), begins) == 1) {
        return *std::find_if(choices.begin(), choices.end(), begins);
    }
    std::string best;
    bool tied = false;
    std::size_t best_distance = std::max<std::size_t>(2, typed.size() / 2) + 1;
    for (const std::string& choice : choices) {
        const std::size_t distance = edit_distance(typed, choice);
        if (distance < best_distance) {
            best = choice;
            best_distance = distance;
            tied = false;
        } else if (distance == best_distance) {
            tied = true;
        }
    }
    return tied ? "" : best;
}

std::size_t index_of_name(std::string_view what, std::string_view typed, const std::vector<std::string>& choices) {
    const auto found = std::find(choices.begin(), choices.end(), typed);
    if (found != choices.end()) {
        return static_cast<std::size_t>(found - choices.begin());
    }
    const std::string nearest = nearest_name(typed, choices);
    const std::string hint = nearest.empty() ? "" : fmt::format("did you mean '{}'? ", nearest);
    throw InputError(fmt::format("unknown {} '{}'; {}choices: {}", what, typed, hint, fmt::join(choices, ", ")));
}

}  // namespace tricoil::host
