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
// In two bands the high carriers have 0.8 of that, and each low carrier 0.27 (0.35 A): limit of the exposure of people
// (board/nucleo_g474re/circuits/SAFETY.md).
constexpr float kHighShare = 0.8F * kShareOfThree;
constexpr float kLowShare = 0.27F;

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
    std::span<std::uint16_t> memory = parts_.memory;
    for (std::size_t n = 0; n < channels_.size(); ++n) {
        Channel& channel = channels_[n];
        channel.period = period_of(plan, updates_per_sample, n);
        const auto length = static_cast<std::size_t>(channel.period.updates);
        if (length < 1 || length > memory.size()) {
            return {StatusCode::invalid_argument,
                    "the carriers' period is too long for this board's tables; choose carriers that divide the rate"};
        }
        channel.table = memory.first(length);
        memory = memory.subspan(length);
        const float first = static_cast<float>(plan.window_cycles[0]) / static_cast<float>(plan.window_cycles[n]);
        channel.share = plan.is_tdm() ? 1 : (plan.has_low_band() ? kHighShare : kShareOfThree) * first;
    }
    set_amplitude(amplitude_codes);
    volatile std::uint32_t* const outputs[] = {&parts_.pair.DHR12R1, &parts_.pair.DHR12R2, &parts_.single.DHR12R1};
    for (std::size_t n = 0; n < channels_.size(); ++n) {
        const std::span<std::uint16_t> table = channels_[n].table;
        parts_.dma[n].start(DmaChannel::Direction::to_converter, *outputs[n], table.data(), table.size());
    }
    set_channels(kPlaying);
    return {};
}

void CarrierPlayer::set_amplitude(float amplitude_codes) {
    for (const Channel& channel : channels_) {
        write_carriers(channel.period, channel.share * amplitude_codes, kLowShare * amplitude_codes, channel.table);
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
