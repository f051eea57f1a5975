#include "board/support/json_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "board/support/terminal_text.hpp"
#include "core/base/angle_units.hpp"

namespace tricoil::host {
namespace {

const std::map<std::string_view, double> kPerSiUnit{{"mm", 1e3}, {"deg", kDegrees}, {"%", 100}};

/// A number that the format would show as zero has two digits instead, in the same width.
std::string number_text(const std::string& format, double value) {
    std::string text = fmt::format(fmt::runtime(format), value);
    const bool looks_zero = std::isfinite(value) && text.find_first_of("123456789") == std::string::npos;
    return looks_zero && value != 0 ? fmt::format("{:>{}.2g}", value, text.size()) : text;
}

std::string formatted(std::string_view field, const Json& values) {
    constexpr std::string_view kIn = " in ";
    const auto colon = std::min(field.find(':'), field.size());
    const auto key = field.substr(0, colon);
    const auto in = std::min(key.find(kIn), key.size());
    const Json& value = values.at(Json::json_pointer("/" + std::string(key.substr(0, in))));
    const std::string form = fmt::format("{{{}}}", field.substr(colon));
    const auto format = [&](const auto& v) { return fmt::format(fmt::runtime(form), v); };
    if (in < key.size()) {
        return number_text(form, kPerSiUnit.at(key.substr(in + kIn.size())) * value.get<double>());
    }
    if (value.is_string()) {
        return format(value.get_ref<const std::string&>());
    }
    if (value.is_object()) {
        std::uint64_t sum = 0;
        for (const Json& count : value) {
            sum += count.get<std::uint64_t>();
        }
        return format(sum);
    }
    return value.is_number_float() ? number_text(form, value.get<double>()) : format(value.get<std::int64_t>());
}

}  // namespace

std::string fill(const Json& values, std::string_view text) {
    std::string filled;
    for (auto begin = text.find('{'); begin != std::string_view::npos; begin = text.find('{')) {
        filled.append(text.substr(0, begin));
        text.remove_prefix(begin + 1);
        const auto end = text.find('}');
        filled.append(formatted(text.substr(0, end), values));
        text.remove_prefix(end + 1);
    }
    return filled.append(text);
}

std::string warnings_text(const Json& result) {
    std::string text;
    for (const Json& warning : result["warnings"]) {
        text += "warning: " + warning.get<std::string>() + "\n";
    }
    return text;
}

void print_result(const Json& result, bool as_json, std::string (*text_of)(const Json& result)) {
    print_text(as_json ? json_line(result, 2) + "\n" : text_of(result));
}

}  // namespace tricoil::host
