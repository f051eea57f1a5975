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
    const std::string rest = device.substr(colon + 1);
    const std::size_t comma = rest.find(',');
    name.where = rest.substr(0, comma);
    host::refuse_if(name.where.empty(), "device '{}': needs -, tcp:PORT, udp:PORT or a file", device);
    for (std::size_t begin = comma; begin != std::string::npos;) {
        const std::size_t end = rest.find(',', begin + 1);
        const std::string part = rest.substr(begin + 1, end == std::string::npos ? end : end - begin - 1);
        const std::size_t equals = part.find('=');
        host::refuse_if(equals == std::string::npos, "device '{}': '{}' is not KEY=VALUE", device, part);
        set_key(name, device.substr(0, colon), part.substr(0, equals), part.substr(equals + 1));
        begin = end;
    }
    return name;
}

}  // namespace tricoil::linux_board
