#include "board/linux/device_config.hpp"
#include "board/support/checked_table.hpp"
#include "board/support/json_text.hpp"
#include "board/support/text_table.hpp"
#include "core/protocol/command_arguments.hpp"

namespace tricoil::linux_board {
namespace {

using protocol::ParameterValues;

std::string quoted(const std::string& text) { return host::Json(text).dump(-1, ' ', true, host::Json::error_handler_t::replace); }

}  // namespace

std::string parameters_toml(const ParameterValues& values) {
    std::string text = fmt::format("version = {}\n", protocol::kParametersVersion);
    for (std::size_t n = 0; n < protocol::kHemisphere; ++n) {
        text += fmt::format("{} = {}\n", protocol::kPlainParameters[n][0], values[n]);
    }
    const Vec3<float> towards = protocol::hemisphere_of_argument(values[protocol::kHemisphere]).towards;
    std::string name;
    for (std::size_t n = 0; n < protocol::kLongestName; ++n) {
        name.push_back(static_cast<char>(values[protocol::kName + n / 4] >> 8U * (n % 4)));
    }
    const bool is_known = !towards.isZero(0);
    return text + fmt::format("hemisphere = \"{}\"\nname = {}\n", is_known ? fmt::format("{}", fmt::join(towards, "/")) : "",
                              quoted(name.c_str()));
}

std::string parameters_toml(std::span<const std::string> words) {
    std::string text;
    for (const std::string& word : words) {
        const auto [key, value] = host::key_and_value(word, "device config set");
        const bool is_number = key != "name" && host::number_from<std::int64_t>(value);
        text += fmt::format("{} = {}\n", key, is_number ? value : quoted(value));
    }
    return text;
}

ParameterValues parameters_of(const std::string& file, const std::string& text, ParameterValues values, bool is_whole) {
    const toml::table parsed = host::parse_toml(file, text);
    host::CheckedTable table(file, "", parsed);
    const auto has = [&](const char* key) {
        table.require(!is_whole || table.has(key), key, "is missing; is the file cut short?");
        return table.has(key);
    };
    table.require(!has("version") || table.whole("version", 0, 255) == protocol::kParametersVersion, "version",
                  fmt::format("must be {}; the file is for other firmware", protocol::kParametersVersion));
    for (std::size_t n = 0; n < protocol::kHemisphere; ++n) {
        const auto [key, range] = protocol::kPlainParameters[n];
        values[n] = has(key) ? static_cast<std::uint32_t>(table.whole(key, 0, ~std::uint32_t{0})) : values[n];
        table.require(protocol::is_possible(n, values[n]), key, fmt::format("must be {}", range));
    }
    if (has("hemisphere")) {
        const std::string towards = table.text("hemisphere", "");
        values[protocol::kHemisphere] =
            towards.empty() ? 0 : protocol::hemisphere_argument({0, direction_of(file, towards).normalized().cast<float>()});
    }
    if (has("name")) {
        const std::string name = table.text("name", "");
        bool is_name = name.size() <= protocol::kLongestName;
        std::fill_n(values.begin() + protocol::kName, 4, 0U);
        for (std::size_t n = 0; n < name.size() && is_name; ++n) {
            is_name = name[n] > ' ' && name[n] < 0x7F;
            values[protocol::kName + n / 4] |= static_cast<std::uint32_t>(name[n]) << 8U * (n % 4);
        }
        table.require(is_name, "name", "must have at most 16 ASCII characters, without blanks");
    }
    table.finish();
    return values;
}

}  // namespace tricoil::linux_board
