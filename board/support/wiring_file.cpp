#include "board/support/wiring_file.hpp"

#include <algorithm>
#include <cstdlib>

#include "board/support/checked_table.hpp"
#include "board/support/line_reader.hpp"

namespace tricoil::host {
namespace {

CoilOrder order_of(CheckedTable& table, const std::string& key) {
    CoilOrder order;
    const std::vector<int> channels = table.integers(key, order.coil.size(), 3);
    for (std::size_t c = 0; c < channels.size(); ++c) {
        order.coil[c] = std::max(std::abs(channels[c]) - 1, 0);
        order.sign[c] = (channels[c] > 0 ? 1 : 0) - (channels[c] < 0 ? 1 : 0);
    }
    table.require(std::abs(order.matrix().determinant()) == 1, key, "must name each coil once: 1, 2, 3, negative if reversed");
    return order;
}

}  // namespace

Mat3<double> CoilOrder::matrix() const {
    Mat3<double> m = Mat3<double>::Zero();
    for (std::size_t channel = 0; channel < 3; ++channel) {
        m(static_cast<Index>(channel), coil[channel]) = sign[channel];
    }
    return m;
}

MeasuredColumn<double> ChannelWiring::of_coils(const MeasuredColumn<double>& channels) const {
    MeasuredColumn<double> column = channels;
    if (coil_index(channels.state) < 0) {
        return column;  // trackers refuse it
    }
    const auto driven = static_cast<std::size_t>(coil_index(channels.state));
    column.state = single_coil(source.coil[driven]);
    for (std::size_t c = 0; c < sensor.coil.size(); ++c) {
        const auto from = static_cast<Index>(c);
        const auto to = static_cast<Index>(sensor.coil[c]);
        const int sign = sensor.sign[c] * source.sign[driven];
        column.in_phase(to) = sign * channels.in_phase(from);
        column.quadrature(to) = sign * channels.quadrature(from);
        column.sigma(to) = channels.sigma(from);
        column.level[static_cast<std::size_t>(to)] = from == to ? channels.level[c] : 0;  // of another channel: unknown
    }
    return column;
}

ChannelWiring read_wiring(const std::string& path) {
    ChannelWiring wiring;
    if (!path.empty()) {
        const toml::table parsed = parse_toml(path, read_text(path, kLongestToml));
        CheckedTable table(path, "", parsed);
        wiring = {order_of(table, "sensor"), order_of(table, "source")};
        table.finish();
    }
    return wiring;
}

}  // namespace tricoil::host
