// What the standard library of Debian's emscripten lacks: numbers from text, and algorithms on ranges. Included before the units
// that use it.
#pragma once

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <iterator>
#include <string>

#if _LIBCPP_VERSION < 20000
namespace std {

inline from_chars_result from_chars(const char* first, const char* last, double& value) {
    const string text(first, last);
    char* end = nullptr;
    const double read = strtod(text.c_str(), &end);
    if (end == text.c_str() || text.find_first_of(" \t\n+xX") == 0) {
        return {first, errc::invalid_argument};
    }
    value = read;
    return {first + (end - text.c_str()), errc{}};
}
}  // namespace std
#endif

#if _LIBCPP_VERSION < 15000
namespace std::ranges {

constexpr auto any_of = [](const auto& range, const auto& test) { return std::any_of(std::begin(range), std::end(range), test); };
constexpr auto find_if = [](const auto& range, const auto& test) {
    return std::find_if(std::begin(range), std::end(range), test);
};
constexpr auto find = [](const auto& range, const auto& value) { return std::find(std::begin(range), std::end(range), value); };
constexpr auto count = [](const auto& range, const auto& value) { return std::count(std::begin(range), std::end(range), value); };

}  // namespace std::ranges
#endif
