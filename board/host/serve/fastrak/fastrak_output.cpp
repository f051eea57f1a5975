#include "board/host/serve/fastrak/fastrak_output.hpp"

#include <fmt/format.h>

#include "board/host/serve/fastrak/session.hpp"
#include "board/host/serve/tcp_service.hpp"
#include "board/host/serve/terminal_service.hpp"
#include "board/support/errors.hpp"
#include "board/support/text_table.hpp"

namespace tricoil::host::fastrak {
namespace {

constexpr const char* kOption = "--fastrak";

/// Records have no time stamps, so a slow client must not receive old ones.
constexpr StreamLimits kUnstamped{std::chrono::milliseconds(250), 4096};

struct SerialPlace {
    std::string path;
    int baud = 115200;
};

SerialPlace parse_serial(const std::string& text) {
    SerialPlace place{text};
    const auto colon = text.rfind(':');
    if (colon != std::string::npos) {
        place.path = text.substr(0, colon);
        place.baud = number_from<int>(std::string_view(text).substr(colon + 1)).value_or(0);
        refuse_if(!is_baud(place.baud), "{} serial:{}: the speed must be 2400, 4800, 9600, 19200, 38400, 57600, 115200 or 230400",
                  kOption, text);
    }
    return place;
}

}  // namespace

Output make_output(const std::string& where, bool continuous, Controls controls, const PoseHub& hub, TrackerControl& control,
                   const StylusButton& button) {
    auto memory = std::make_shared<Memory>();
    memory->saved.continuous = continuous;
    const bool is_tcp = where.starts_with("tcp:");
    const bool may_control = controls == Controls::open || (controls == Controls::by_token && !is_tcp);
    memory->is_shared = controls == Controls::open || !is_tcp;
    auto make_session = [memory, may_control, &hub, &control, &button](std::function<void(std::string_view)> send,
                                                                       const std::function<void(int)>& line_speed = {},
                                                                       std::function<void(std::string_view)> notice = {}) {
        SessionLinks links{
            std::move(send), {}, [&hub] { return hub.sensors(); }, line_speed, [&button] { return button.state(); }};
        if (may_control) {
            links.hemisphere = [&control](std::uint8_t sensor, const Vec3<double>& towards) {
                control.set_hemisphere(sensor, towards);
            };
        }
        if (notice) {
            links.notice = std::move(notice);
        }
        auto session =
            std::make_unique<Session>(std::move(links), memory->is_shared ? memory : std::make_shared<Memory>(*memory));
        session->set_newest(hub.newest());
        return session;
    };
    using Terminal = TerminalService<Session>;
    const auto colon = where.find(':');
    const std::string kind = where.substr(0, colon);
    const std::string rest = colon == std::string::npos ? "" : where.substr(colon + 1);
    if (kind == "pty") {
        auto terminal = std::make_shared<PseudoTerminal>(rest);
        const std::string path = terminal->path();
        return {std::make_unique<Terminal>([terminal] { return terminal->duplicate(); }, Terminal::HangUp::no_client,
                                           [make_session](auto send) { return make_session(std::move(send)); }),
                path};
    }
    if (kind == "serial" && !rest.empty()) {
        const SerialPlace place = parse_serial(rest);
        std::string reason;
        const int first = open_serial(place.path, place.baud, reason);
        if (first < 0) {
            throw DeviceError(fmt::format("{} {}", kOption, reason));
        }
        auto baud = std::make_shared<int>(place.baud);  // present speed
        auto open = [path = place.path, baud, first = std::make_shared<int>(first)] {
            std::string ignored;
            return *first >= 0 ? std::exchange(*first, -1) : open_serial(path, *baud, ignored);
        };
        const auto line_speed = [place, baud](int wanted) {
            *baud = wanted == 0 ? place.baud : wanted;
            set_serial_speed(place.path, *baud);
        };
        return {std::make_unique<Terminal>(
                    open, Terminal::HangUp::line_lost,
                    [make_session, line_speed](auto send) { return make_session(std::move(send), line_speed); }),
                place.path};
    }
    if (kind == "tcp" && !rest.empty()) {
        const TcpAddress address = parse_tcp_address(kOption, rest);
        auto notice = std::make_shared<LimitedNotice>(kOption);
        auto service = std::make_unique<TcpService<Session>>(
            kOption, address,
            [make_session, notice](Stream& stream) {
                return make_session([&stream](std::string_view record) { stream.send(record); }, {},
                                    [notice, client = peer_text(stream.descriptor())](std::string_view what) {
                                        notice->print(fmt::format("client {} {}", client, what));
                                    });
            },
            kUnstamped);
        const int port = service->port();
        return {std::move(service), address.text(port)};
    }
    throw InputError(fmt::format("{} {}: must be pty, pty:LINK, serial:PATH[:BAUD] or tcp:[ADDRESS:]PORT", kOption, where));
}

}  // namespace tricoil::host::fastrak
