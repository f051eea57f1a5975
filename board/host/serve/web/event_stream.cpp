#include "board/host/serve/web/event_stream.hpp"

#include "board/host/serve/web/pose_event.hpp"

namespace tricoil::host::web {
namespace {

constexpr std::chrono::milliseconds kPeriod{33};
constexpr std::chrono::milliseconds kIdlePeriod{500};

}  // namespace

EventStream::EventStream(ServedPage& page)
    : page_(page), cursor_(page.hub.cursor()), hello_(greeting(page.recordings.source())) {}

std::string EventStream::next() {
    const auto now = Clock::now();
    if (now - last_ < kPeriod) {
        return {};
    }
    poses_.clear();
    page_.hub.read(cursor_, poses_);
    silence_.check(utc_now(), poses_);
    if (poses_.empty() && now - last_ < kIdlePeriod) {
        return {};
    }
    last_ = now;
    LinkHealth health = page_.hub.health();
    health.counts.dropped += cursor_.missed;  // by this page
    const std::string event = pose_event(poses_,
                                         {page_.control.running(), page_.recordings.status(), to_text(page_.access.controls),
                                          static_cast<int>(page_.streams.size()), utc_now(), health, page_.hub.confinement()},
                                         hello_);
    hello_ = nullptr;
    return event;
}

}  // namespace tricoil::host::web
