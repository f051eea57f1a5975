#include "board/linux/text_timing.hpp"

#include <algorithm>
#include <cmath>

namespace tricoil::linux_board {
namespace {

constexpr std::size_t kPeriods = 5;  // whose median is the period

/// Exact rates are whole numbers; stamps in microseconds are rounded.
double rate_of(double period_us) {
    const double rate_hz = 1e6 / period_us;
    const double whole = std::round(rate_hz);
    return whole >= 1 && std::abs(rate_hz - whole) < 2e-3 * whole ? whole : rate_hz;
}

struct Intervals {
    std::vector<double> periods_us;  // from a coil of a sensor to the same coil
    std::size_t ties = 0;            // frames with the time of the one before, of another coil
};

Intervals intervals_of(const std::vector<TextFrame>& frames) {
    Intervals intervals;
    for (auto frame = frames.begin() + 1; frame != frames.end(); ++frame) {
        const auto newest_before = [&](bool is_same_coil) {
            return std::find_if(std::make_reverse_iterator(frame), frames.rend(), [&](const TextFrame& f) {
                return f.sensor == frame->sensor && (f.first_coil == frame->first_coil) == is_same_coil && f.time_us &&
                       frame->time_us;
            });
        };
        const auto same = newest_before(true);
        const auto other = newest_before(false);
        if (same != frames.rend() && *frame->time_us > *same->time_us) {
            intervals.periods_us.push_back(*frame->time_us - *same->time_us);
        }
        intervals.ties += other != frames.rend() && *frame->time_us == *other->time_us ? 1U : 0U;
    }
    return intervals;
}

}  // namespace

std::optional<TextTiming> timing_of(const std::vector<TextFrame>& frames, const TextName& name, bool is_all) {
    auto [periods_us, ties] = intervals_of(frames);
    const bool is_matrix = frames.front().coils > 1;
    if (!is_all && periods_us.size() < kPeriods && frames.size() < kFirstFrames && !(is_matrix && name.rate_hz)) {
        return std::nullopt;
    }
    TextTiming timing;
    const bool is_simultaneous = is_matrix || 2 * ties > frames.size() - 1;
    timing.multiplexing = name.multiplexing.value_or(is_simultaneous ? signal::Multiplexing::fdm : signal::Multiplexing::tdm);
    if (!periods_us.empty()) {
        const auto middle = periods_us.begin() + static_cast<std::ptrdiff_t>(periods_us.size() / 2);
        std::nth_element(periods_us.begin(), middle, periods_us.end());
        timing.rate_hz = std::clamp(rate_of(*middle), TextName::kSlowest_hz, TextName::kFastest_hz);
    }
    timing.rate_hz = name.rate_hz.value_or(timing.rate_hz);
    return timing;
}

}  // namespace tricoil::linux_board
