#include "board/linux/text_name.hpp"

#include <fmt/format.h>

#include <cmath>

#include "board/support/errors.hpp"
#include "board/support/nearest_name.hpp"
#include "board/support/text_table.hpp"
#include "core/tracking/tracker_params.hpp"

namespace tricoil::linux_board {
namespace {

double positive(const std::string& device, const std::string& key, const std::string& text) {
    const auto value = host::number_from<double>(text);
    if (!value || !std::isfinite(*value) || *value <= 0) {
        throw host::InputError(fmt::format("{}: {}={}: must be a positive number", device, key, text));
    }
    return *value;
}

void set_key(TextName& name, const std::string& device, const std::string& key, const std::string& value) {
    switch (host::index_of_name("key of " + device, key, {"mux", "rate_hz", "sigma", "sensors"})) {
        case 0:
            name.multiplexing = static_cast<signal::Multiplexing>(host::index_of_name(device + ": mux", value, {"tdm", "fdm"}));
            break;
        case 1:
            name.rate_hz = positive(device, key, value);
            host::refuse_if(*name.rate_hz < TextName::kSlowest_hz || *name.rate_hz > TextName::kFastest_hz,
                            "{}: rate_hz={}: must be {} to {}", device, value, TextName::kSlowest_hz, TextName::kFastest_hz);
            break;
        case 2:
            name.sigma = positive(device, key, value);
            break;
        default:
            name.sensors = host::number_from<int>(value).value_or(0);
            host::refuse_if(name.sensors < 1 || name.sensors > tracking::kMaxSensors, "{}: sensors={}: must be 1 to {}", device,
                            value, tracking::kMaxSensors);
    }
}

}  // namespace

TextName parse_text_name(const std::string& device) {
    TextName name;
    const std::size_t colon = device.find(':');
    const auto parts = host::split(std::string_view(device).substr(colon + 1), ',');
    name.where = parts.front();
    host::refuse_if(name.where.empty(), "device '{}': needs -, tcp:PORT, udp:PORT or a file", device);
    for (std::size_t i = 1; i < parts.size(); ++i) {
        const auto [key, value] = host::key_and_value(parts[i], "device '" + device + "'");
        set_key(name, device.substr(0, colon), key, value);
    }
    return name;
}

}  // namespace tricoil::linux_board
