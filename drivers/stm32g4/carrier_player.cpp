#include "drivers/stm32g4/carrier_player.hpp"

#include "drivers/stm32g4/wait.hpp"

namespace tricoil::stm32g4 {
namespace {

constexpr std::uint32_t kReadyPolls = 10'000;                       // at most 8 us (DS12288, DAC wake-up time)
constexpr std::uint32_t kQuiet = dac::CR_EN1 | dac::CR_TSEL1_TIM6;  // without trigger: a written value is output at once
constexpr std::uint32_t kPlaying = kQuiet | dac::CR_TEN1 | dac::CR_DMAEN1;
constexpr std::uint32_t kUnderruns = dac::SR_DMAUDR1 | dac::SR_DMAUDR1 << dac::kChannel2Shift;

// Share of the first carrier when three are active at once, relative to a single carrier. A sensor coil's signal grows with the
// frequency, so the other carriers get less and all three couplings have equal noise.
constexpr float kShareOfThree = 0.65F;

constexpr std::uint32_t both(std::uint32_t channel1) { return channel1 | channel1 << dac::kChannel2Shift; }

}  // namespace

Status CarrierPlayer::begin() {
    for (DacRegisters* converter : {&parts_.pair, &parts_.single}) {
        converter->CR = 0;
        converter->MCR = dac::MCR_HFSEL_above_160MHz | both(parts_.output);
    }
    stop();
    const auto ready = [this] {
        return (parts_.pair.SR & both(dac::SR_DAC1RDY)) == both(dac::SR_DAC1RDY) && (parts_.single.SR & dac::SR_DAC1RDY) != 0;
    };
    return wait_until(ready, kReadyPolls, "a DAC does not become ready");
}

Status CarrierPlayer::load(const signal::AcquisitionPlan& plan, int updates_per_sample, float amplitude_codes) {
    stop();
    for (std::size_t n = 0; n < periods_.size(); ++n) {
        periods_[n] = shortest_period(plan.window_samples * updates_per_sample, plan.window_cycles[n]);
        if (periods_[n].updates < 1 || periods_[n].updates > static_cast<int>(kLongestTable)) {
            return {StatusCode::invalid_argument,
                    "the carrier's period is too long for this board's tables; choose a carrier that divides the rate"};
        }
        shares_[n] = plan.is_tdm()
                         ? 1
                         : kShareOfThree * static_cast<float>(plan.window_cycles[0]) / static_cast<float>(plan.window_cycles[n]);
    }
    set_amplitude(amplitude_codes);
    volatile std::uint32_t* const outputs[] = {&parts_.pair.DHR12R1, &parts_.pair.DHR12R2, &parts_.single.DHR12R1};
    for (std::size_t n = 0; n < periods_.size(); ++n) {
        parts_.dma[n].start(DmaChannel::Direction::to_converter, *outputs[n], tables_[n].data(),
                            static_cast<std::size_t>(periods_[n].updates));
    }
    set_channels(kPlaying);
    return {};
}

void CarrierPlayer::set_amplitude(float amplitude_codes) {
    for (std::size_t n = 0; n < periods_.size(); ++n) {
        write_carrier(periods_[n], shares_[n] * amplitude_codes, tables_[n]);
    }
}

void CarrierPlayer::stop() {
    set_channels(kQuiet);
    for (const DmaChannel& channel : parts_.dma) {
        channel.stop();
    }
    parts_.pair.DHR12R1 = kDacMiddle;
    parts_.pair.DHR12R2 = kDacMiddle;
    parts_.single.DHR12R1 = kDacMiddle;
}

bool CarrierPlayer::take_underrun() {
    bool late = false;
    for (DacRegisters* converter : {&parts_.pair, &parts_.single}) {
        const std::uint32_t flags = converter->SR & kUnderruns;
        if (flags != 0) {
            converter->SR = flags;
            late = true;
        }
    }
    return late;
}

void CarrierPlayer::set_channels(std::uint32_t channel1) const {
    parts_.pair.CR = both(channel1);
    parts_.single.CR = channel1;
}

}  // namespace tricoil::stm32g4
