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
class PagePort final : public drivers::ReportingPort {
public:
    void put(std::span<const std::uint8_t> bytes) { received_.assign(bytes.begin(), bytes.end()); }
    std::vector<std::uint8_t> take_unsent() { return std::exchange(unsent_, {}); }
    [[nodiscard]] bool has_received() const { return !received_.empty(); }

private:
    Status do_open() override { return {}; }
    void do_close() override { received_.clear(); }
    Status do_send(std::span<const std::uint8_t> message) override {
        const std::size_t begin = unsent_.size();
        unsent_.resize(begin + protocol::kMaxFramedBytes);
        unsent_.resize(begin + protocol::frame(message, std::span(unsent_).subspan(begin)));
        return {};
    }
    Status do_receive(hal::ReceivedMessage& message) override {
        for (std::size_t n = 0; n < received_.size(); ++n) {
            if (reader_.push(received_[n])) {
                received_.erase(received_.begin(), received_.begin() + static_cast<std::ptrdiff_t>(n) + 1);
                message = {reader_.message(), drivers::host_now(), 0};
                return {};
            }
            damaged().count(reader_.error());
        }
        received_.clear();
        return {StatusCode::not_ready, "no message"};
    }
    Status do_wait(Microseconds /*timeout*/) override { return {}; }

    std::vector<std::uint8_t> received_;
    std::vector<std::uint8_t> unsent_;
    protocol::StreamReader reader_;
};

struct Board {
    Board() { status.controls = "open"; }

    std::string event(const nlohmann::ordered_json& hello) {
        const auto& session = loop.session();
        status.health.counts.serial = session.identity().serial;
        status.health.counts.firmware = session.identity().firmware;
        status.now = utc_now();
        for (ServedPose& served : poses) {
            served.utc = status.now - (poses.back().pose.time - served.pose.time);
        }
        return web::pose_event(std::exchange(poses, {}), status, hello);
    }

    PagePort port;
    tracking::TrackerTap<double> ignored;
    std::vector<ServedPose> poses;
    ExpectedError expected;
    web::PageStatus status;
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

/// Begins with a port that was opened. Returns the first event.
const char* tricoil_board_begin() {
    board.emplace();
    text = board->event(web::greeting({{"kind", "device"}, {"device", "serial port"}}));
    return text.c_str();
}

/// Takes bytes from the port; is_running: false switches the coils off. Returns the event that a server would send, or why there
/// is none.
const char* tricoil_board_advance(const std::uint8_t* bytes, int count, bool is_running) {
    try {
        board->status.running = is_running;
        board->port.put({bytes, static_cast<std::size_t>(count)});
        if (!is_running) {
            board->loop.stop();
        }
        do {
            is_running ? board->loop.step(tricoil::Microseconds{}) : board->port.put({});
        } while (board->port.has_received());
        text = board->event(nullptr);
    } catch (const std::exception& error) {
        text = error.what();
    }
    return text.c_str();
}

/// Bytes for the port, as hexadecimal digits.
const char* tricoil_board_unsent() {
    text = fmt::format("{:02x}", fmt::join(board->port.take_unsent(), ""));
    return text.c_str();
}

void tricoil_board_set_hemisphere(int sensor, double x, double y, double z) {
    board->loop.set_hemisphere(static_cast<std::size_t>(sensor), {x, y, z});
}
}
