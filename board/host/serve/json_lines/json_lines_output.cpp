#include "board/host/serve/json_lines/json_lines_output.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <csignal>

#include "board/host/serve/tcp_service.hpp"
#include "board/host/serve/udp_service.hpp"
#include "board/pose_text/served_pose.hpp"
#include "board/support/errors.hpp"

namespace tricoil::host::json_lines {
namespace {

constexpr const char* kOption = "--json-lines";

/// Session of one client. Sends every new pose, valid or not, and the stale pose that SilenceWatch adds. Input from the client is
/// ignored. A client that reads too slowly misses whole lines.
class Session {
public:
    Session(Stream& stream, const PoseUnits& units) : stream_(stream), units_(units) {}

    void receive(std::span<const char> /*bytes*/) {}
    void take(std::span<const ServedPose> poses) {
        for (const ServedPose& served : poses) {
            stream_.send(served_pose_line(served, units_));
        }
    }

private:
    Stream& stream_;
    PoseUnits units_;
};

}  // namespace

Output make_output(const std::string& where, const PoseUnits& units) {
    const bool is_udp = where.starts_with("udp:");
    refuse_if(!is_udp && !where.starts_with("tcp:"), "{} {}: must be tcp:[ADDRESS:]PORT, udp:[HOST:]PORT or - (standard output)",
              kOption, where);
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

StdoutSender::StdoutSender(const PoseUnits& units) : units_(units), pump_(STDOUT_FILENO, "standard output") {}

void StdoutSender::take(std::span<const ServedPose> poses) {
    for (const ServedPose& served : poses) {
        pump_.push(served_pose_line(served, units_));
    }
    if (pump_.has_failed() && !has_ended_) {
        has_ended_ = true;
        (void)std::raise(SIGTERM);
    }
}

void StdoutSender::finish() {
    const std::string error = pump_.close();
    if (!error.empty() && !pump_.is_unread()) {
        throw DeviceError(error);
    }
}

}  // namespace tricoil::host::json_lines
