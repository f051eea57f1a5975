#include "board/app/fixed_chain.hpp"

namespace tricoil::app {

/// The tracker finds gaps itself.
bool FixedChain::update(const SampleBlock& block, bool& /*after_gap*/, const Devices& devices, MainLoopCounters& counters) {
    const std::uint32_t accepted = tracker_.counters().accepted;
    const auto estimate = tracker_.update(block);
    counters.refused_blocks += tracker_.counters().accepted == accepted ? 1U : 0U;
    if (estimate) {
        counters.unsent_poses += devices.link.send(*estimate).ok() ? 0U : 1U;
    }
    return estimate.has_value();
}

void FixedChain::tick(std::uint8_t /*sensor*/, const Devices& devices, MainLoopCounters& counters) {
    if (const auto estimate = tracker_.tick(devices.clock.now())) {
        counters.unsent_poses += devices.link.send(*estimate).ok() ? 0U : 1U;
    }
}

Status FixedChain::set_hemisphere(std::uint8_t /*sensor*/, const Direction& towards, const Devices& /*devices*/) {
    tracker_.set_hemisphere(towards);
    return {};
}

}  // namespace tricoil::app
