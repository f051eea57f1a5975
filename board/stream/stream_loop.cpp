#include "board/stream/stream_loop.hpp"

#include <algorithm>
#include <thread>

#include "board/support/interrupt.hpp"

namespace tricoil::host {
namespace {

constexpr Microseconds kPause{20'000};
constexpr Microseconds kOutputPause{2'000};

void sleep_for(Microseconds duration) { std::this_thread::sleep_for(Pacer::Duration(duration.count())); }

}  // namespace

void StreamLoop::run() {
    const InterruptGuard guard;
    if (params_.ready) {
        params_.ready();
    }
    while (!guard.interrupted() && step(kPause)) {
    }
    interrupted_ = guard.interrupted();
    source_.rest();
}

bool StreamLoop::step(Microseconds patience) {
    const auto asks = [](const std::function<bool()>& question) { return question && question(); };
    if (asks(params_.is_over)) {
        return false;
    }
    if (asks(params_.is_paused)) {
        source_.rest();
        sleep_for(std::min(kPause, patience));
        return true;
    }
    if (asks(params_.must_wait)) {
        sleep_for(std::min(kOutputPause, patience));
        return true;
    }
    if (params_.realtime && !source_.is_live()) {
        if (const Microseconds left{pacer_.left(source_.elapsed()).count()}; left.count() > 0) {
            sleep_for(std::min(left, patience));
            return true;
        }
    }
    if ((params_.duration_s > 0 && to_seconds(source_.elapsed()) >= params_.duration_s) || !source_.advance(patience)) {
        return false;
    }
    check_health();
    if (params_.each_step) {
        params_.each_step(source_);
    }
    return true;
}

void run_to_end(Source& source, const std::function<void()>& each_step) {
    LoopParams params;
    params.each_step = [&](Source&) { each_step(); };
    StreamLoop loop(source, params);
    const InterruptGuard guard;
    while (loop.step()) {
        guard.check();
    }
}

void StreamLoop::check_health() {
    auto link = source_.link_state();
    if (!link) {
        return;
    }
    if (params_.add_outputs) {
        params_.add_outputs(link->counts);
    }
    if (monitor_.update(link->counts, link->time) && params_.each_health) {
        params_.each_health(monitor_.health());
    }
}

}  // namespace tricoil::host
