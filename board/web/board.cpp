// A board on a serial port of the browser: C interface for page/board_server.js, with the events of a server.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <exception>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>
#include <vector>

#include "board/linux/device_loop.hpp"
#include "board/page/pose_event.hpp"
#include "board/support/tracker_choice.hpp"
#include "core/protocol/stream_framing.hpp"
#include "drivers/posix/monotonic_clock.hpp"
#include "drivers/posix/reporting_port.hpp"

namespace tricoil::host {
namespace {

/// Framed messages; the page passes their bytes on.
struct PagePort final : drivers::ReportingPort {
    std::vector<std::uint8_t> unsent;
    std::span<const std::uint8_t> received;

private:
    Status do_open() override { return {}; }
    void do_close() override {}
    Status do_send(std::span<const std::uint8_t> message) override {
        const std::size_t begin = unsent.size();
        unsent.resize(begin + protocol::kMaxFramedBytes);
        unsent.resize(begin + protocol::frame(message, std::span(unsent).subspan(begin)));
        return {};
    }
    Status do_receive(hal::ReceivedMessage& message) override {
        while (!received.empty()) {
            const bool is_complete = reader_.push(received.front());
            received = received.subspan(1);
            if (is_complete) {
                message = {reader_.message(), drivers::host_now(), 0};
                return {};
            }
            damaged().count(reader_.error());
        }
        return {StatusCode::not_ready, "no message"};
    }
    Status do_wait(Microseconds /*timeout*/) override { return {}; }
    protocol::StreamReader reader_;
};

struct Board {
    PagePort port;
    tracking::TrackerTap<double> ignored;
    std::vector<ServedPose> poses;
    ExpectedError expected;
    web::PageStatus status{.recording = {}, .controls = "open", .now = {}, .health = {}, .confinement = {}};
    linux_board::DeviceLoop loop{port, {}, {.method = method_of_name("direct")}, ignored, [this](const auto& pose) {
                                     poses.push_back({pose, {}, expected.after(pose)});
                                 }};
};

std::optional<Board> board;
std::string text;  // of the last answer

}  // namespace
}  // namespace tricoil::host

extern "C" {
using namespace tricoil::host;

void tricoil_board_begin() { board.emplace(); }

/// Takes bytes from the port; is_running: false switches the coils off. Returns the event that a server would send, or why there
/// is none.
const char* tricoil_board_advance(const std::uint8_t* bytes, int count, bool is_running) {
    try {
        auto& [port, ignored, poses, expected, status, loop] = *board;
        port.received = {bytes, static_cast<std::size_t>(count)};
        do {
            is_running ? loop.step(tricoil::Microseconds{}) : loop.stop();
        } while (is_running && !port.received.empty());
        status.running = is_running;
        status.health.counts.serial = loop.session().identity().serial;
        status.health.counts.firmware = loop.session().identity().firmware;
        status.now = utc_now();
        for (ServedPose& served : poses) {
            served.utc = status.now - (poses.back().pose.time - served.pose.time);
        }
        text = web::pose_event(std::exchange(poses, {}), status,
                               web::greeting({{"kind", "device"}, {"device", "serial port, not yet tested with hardware"}}));
    } catch (const std::exception& error) {
        text = error.what();
    }
    return text.c_str();
}

/// Bytes for the port, as hexadecimal digits.
const char* tricoil_board_unsent() {
    text = fmt::format("{:02x}", fmt::join(std::exchange(board->port.unsent, {}), ""));
    return text.c_str();
}

void tricoil_board_set_hemisphere(int sensor, double x, double y, double z) {
    board->loop.set_hemisphere(static_cast<std::size_t>(sensor), {x, y, z});
}
}
