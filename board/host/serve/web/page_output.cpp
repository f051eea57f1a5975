#include "board/host/serve/web/page_output.hpp"

#include <utility>

#include "board/host/serve/tcp_service.hpp"
#include "board/host/serve/web/page_session.hpp"

namespace tricoil::host::web {
namespace {

constexpr std::size_t kShare = 1024;                  // bytes per read: 1 MB/s
constexpr std::chrono::milliseconds kReplaceable{0};  // a client without a stream; the next one may replace it at once

}  // namespace

Output make_output(const TcpAddress& address, Access access, const PoseHub& hub, TrackerControl& control,
                   RecordingSwitch& recordings, StylusButton& button) {
    const std::shared_ptr<ServedPage> page(new ServedPage{address, std::move(access), hub, control, recordings, button});
    auto service = std::make_unique<TcpService<PageSession>>(
        "--web", address, [page](Stream& stream) { return std::make_unique<PageSession>(stream, *page); },
        StreamLimits{std::chrono::hours(24), 0, kShare}, kReplaceable);
    page->port = service->port();
    const TcpAddress shown = address.is_any() ? TcpAddress{"localhost", ""} : address;
    const std::string url = "http://" + shown.text(page->port) + "/";
    const bool has_token = page->access.controls == Controls::by_token;
    return {std::move(service), url, has_token ? url + "#token=" + page->access.token : url};
}

}  // namespace tricoil::host::web
