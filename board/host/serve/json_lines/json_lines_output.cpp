#include "board/host/serve/json_lines/json_lines_output.hpp"

#include <fmt/format.h>

#include "board/host/serve/json_lines/session.hpp"
#include "board/host/serve/tcp_service.hpp"
#include "board/host/serve/udp_service.hpp"
#include "board/pose_text/served_pose.hpp"
#include "board/support/errors.hpp"

namespace tricoil::host::json_lines {
namespace {

constexpr const char* kOption = "--json-lines";

}  // namespace

Output make_output(const std::string& where, const PoseUnits& units) {
    const bool is_udp = where.starts_with("udp:");
    if (!is_udp && !where.starts_with("tcp:")) {
        throw InputError(
            fmt::format("{} {}: must be tcp:[ADDRESS:]PORT, udp:[HOST:]PORT or - (standard output)", kOption, where));
    }
    const TcpAddress address = parse_tcp_address(kOption, where.substr(4));
    if (is_udp) {
        const std::string text = "udp:" + address.text(std::stoi(address.port));
        return {std::make_unique<UdpService>(fmt::format("{} {}", kOption, text), address,
                                             [units](const ServedPose& served) { return served_pose_line(served, units); }),
                address, text};
    }
    auto service = std::make_unique<TcpService<Session>>(
        kOption, address, [units](Stream& stream) { return std::make_unique<Session>(stream, units); });
    const std::string text = address.text(service->port());
    return {std::move(service), address, text};
}

}  // namespace tricoil::host::json_lines
