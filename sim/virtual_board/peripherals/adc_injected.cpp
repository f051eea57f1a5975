// The injected group of a converter: up to four conversions that interrupt the regular sequence (RM0440, "Injected channel
// management").
#include <utility>

#include "sim/virtual_board/peripherals/adc.hpp"

namespace tricoil::virtual_board {

void Adc::start_injected() {
    fail_if(is_automatic(), "CR: JADSTART (bit 3) while CFGR.JAUTO starts the injected sequence");
    state_.control |= 1U << adc::kStartInjected;
    state_.injected_rank = 0;
    if (field(registers_[adc::kJsqr], 7, 2) == 0) {
        inject();
    }
}

void Adc::stop_injected() {
    state_.control &= ~(1U << adc::kStartInjected);
    state_.injected_rank = 0;
    if (state_.injects) {
        finished_.cancel();
        resume();
    }
}

/// Starts an injected conversion. A regular one that runs is lost, and starts again after the injected sequence. Without ROVSM
/// the codes that are already summed for it stay, unless the injected sequence needs the oversampler.
void Adc::inject() {
    const std::uint32_t cfgr = registers_[adc::kCfgr];
    const std::uint32_t cfgr2 = registers_[adc::kCfgr2];
    fail_if(!is_set(cfgr, adc::kQueueOff), "CFGR: bit 31 (JQDIS) is clear; the queue of injected sequences is not in this model");
    fail_if(is_set(cfgr, adc::kSingleInjected) && (is_automatic() || field(registers_[adc::kJsqr], 7, 2) == 0),
            "CFGR: bit 20 (JDISCEN) without a trigger in JSQR is not in this model");
    state_.postponed = state_.postponed || finished_.is_due();
    if (is_set(cfgr2, adc::kResumed) || is_set(cfgr2, adc::kOversampleInjected)) {
        state_.sums[0] = {};
    }
    state_.sums[1] = {};
    state_.injects = true;
    convert();
}

void Adc::store_injected(std::uint32_t result) {
    registers_.at(adc::kJdr1 + 4 * state_.injected_rank) = result;
    const std::uint32_t jsqr = registers_[adc::kJsqr];
    const bool last = state_.injected_rank == field(jsqr, 0, 2);
    state_.injected_rank = last ? 0 : state_.injected_rank + 1;
    state_.flags |= 1U << adc::kEndOfInjectedConversion | flag(last, adc::kEndOfInjectedSequence);
    if (!last && !is_set(registers_[adc::kCfgr], adc::kSingleInjected)) {
        convert();
        return;
    }
    if (field(jsqr, 7, 2) == 0) {
        state_.control &= ~(1U << adc::kStartInjected);
    }
    resume();
}

/// Goes on with the regular conversion that the injected sequence interrupted or postponed.
void Adc::resume() {
    state_.injects = false;
    if (std::exchange(state_.postponed, false)) {
        convert();
    }
}

}  // namespace tricoil::virtual_board
