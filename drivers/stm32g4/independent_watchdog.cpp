#include "drivers/stm32g4/independent_watchdog.hpp"

#include "drivers/stm32g4/wait.hpp"

namespace tricoil::stm32g4 {
namespace {

constexpr std::int64_t kTicksPerSecond = 32'000;
constexpr unsigned kMinShift = 2;                    // PR = 0 divides by 4
constexpr unsigned kMaxShift = 8;                    // PR = 6 divides by 256
constexpr std::uint32_t kWatchdogPolls = 2'000'000;  // a register update takes up to five cycles of the divided clock

}  // namespace

Status IndependentWatchdog::do_start(Microseconds timeout) {
    const std::int64_t ticks = timeout.count() * kTicksPerSecond / 1'000'000;
    unsigned shift = kMinShift;
    while (shift < kMaxShift && (ticks >> shift) > std::int64_t{iwdg::RLR_max} + 1) {
        ++shift;
    }
    const std::int64_t reload = (ticks >> shift) - 1;
    if (reload < 0 || reload > std::int64_t{iwdg::RLR_max}) {
        return {StatusCode::invalid_argument, "watchdog time-out must be between 125 us and 32 s"};
    }
    registers_.KR = iwdg::KR_start;
    registers_.KR = iwdg::KR_unlock;
    registers_.PR = shift - kMinShift;
    registers_.RLR = static_cast<std::uint32_t>(reload);
    is_started_ = true;
    const Status taken = wait_until([this] { return (registers_.SR & (iwdg::SR_PVU | iwdg::SR_RVU)) == 0; }, kWatchdogPolls,
                                    "the watchdog's oscillator does not run");
    feed();
    return taken;
}

void IndependentWatchdog::do_feed() {
    if (is_started_) {
        registers_.KR = iwdg::KR_feed;
    }
}

}  // namespace tricoil::stm32g4
