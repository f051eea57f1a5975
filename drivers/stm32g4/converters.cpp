#include "drivers/stm32g4/converters.hpp"

#include <algorithm>
#include <bit>

#include "drivers/stm32g4/wait.hpp"

namespace tricoil::stm32g4 {
namespace {

constexpr std::uint32_t kConverterPolls = 100'000;
constexpr Microseconds kLongestWait{1000};    // calibration: 116 cycles of 42.5 MHz (RM0440); everything else is faster
constexpr Microseconds kRegulatorStart{20};   // DS12288, ADC voltage regulator start-up time
constexpr Microseconds kAfterCalibration{1};  // RM0440: four ADC cycles before ADEN
constexpr std::int32_t kMiddleOfOneConversion = 2048;
constexpr std::int32_t kWatchdogShift = 4;  // with oversampling the watchdog compares the upper 12 of 16 bits
constexpr std::int32_t kWatchdogMax = 0xFFF;
constexpr unsigned kChannelsPerSampleRegister = 10;

}  // namespace

Status Converters::begin() {
    parts_.common_12.CCR = adc::CCR_CKMODE_HCLK_4 | adc::CCR_VREFEN | adc::CCR_VSENSESEL;
    parts_.common_345.CCR = adc::CCR_CKMODE_HCLK_4;
    for (Input& input : parts_.inputs) {
        if (const Status status = switch_on(input.adc); !status.ok()) {
            return status;
        }
    }
    return {};
}

Status Converters::switch_on(AdcRegisters& adc) {
    adc.CR = 0;  // out of deep power-down
    adc.CR = adc::CR_ADVREGEN;
    pause(kRegulatorStart);
    adc.CR = adc::CR_ADVREGEN | adc::CR_ADCAL;
    if (!await(adc.CR, adc::CR_ADCAL, 0)) {
        return {StatusCode::timed_out, "calibration of an ADC timed out"};
    }
    pause(kAfterCalibration);
    adc.ISR = adc::ISR_ADRDY;
    adc.CR = adc::CR_ADVREGEN | adc::CR_ADEN;
    return await(adc.ISR, adc::ISR_ADRDY, adc::ISR_ADRDY) ? Status{}
                                                          : Status{StatusCode::timed_out, "an ADC does not become ready"};
}

/// Waits by the clock; the poll limit applies if the clock does not run.
void Converters::pause(Microseconds time) const {
    const DeviceTime end = clock_.now() + time;
    static_cast<void>(wait_until([&] { return clock_.now() > end; }, kConverterPolls, ""));
}

/// False if the bits of `mask` do not become `value` in time.
bool Converters::await(const volatile std::uint32_t& target, std::uint32_t mask, std::uint32_t value) const {
    const DeviceTime deadline = clock_.now() + kLongestWait;
    const auto is_there = [&] { return (target & mask) == value; };
    static_cast<void>(wait_until([&] { return clock_.now() > deadline || is_there(); }, kConverterPolls, ""));
    return is_there();
}

Status Converters::start(std::size_t block_samples, int oversampling, std::int32_t limit_codes) {
    if (const Status status = stop(); !status.ok()) {
        return status;
    }
    block_samples_ = block_samples;
    middle_ = kMiddleOfOneConversion * oversampling;
    for (std::size_t n = 0; n < parts_.inputs.size(); ++n) {
        const Input& input = parts_.inputs[n];
        configure(input, oversampling);
        input.dma.start(DmaChannel::Direction::from_converter, input.adc.DR, memory_[n].data(), 2 * block_samples,
                        n == kSensorCoils - 1);
    }
    const std::int32_t high = std::min((middle_ + limit_codes) >> kWatchdogShift, kWatchdogMax);
    const std::int32_t low = std::max((middle_ - limit_codes) >> kWatchdogShift, std::int32_t{0});
    reference().TR1 = static_cast<std::uint32_t>(high) << adc::TR1_HT1_Pos | static_cast<std::uint32_t>(low);
    reference().ISR = adc::ISR_AWD1;
    reference().IER = adc::IER_AWD1IE;
    for (Input& input : parts_.inputs) {
        // A result that was not read would make the first new one an overrun.
        input.adc.ISR = adc::ISR_EOC | adc::ISR_EOS | adc::ISR_OVR;
        input.adc.CR = adc::CR_ADVREGEN | adc::CR_ADSTART;
    }
    return {};
}

void Converters::configure(const Input& input, int oversampling) const {
    AdcRegisters& adc = input.adc;
    const bool watched = &adc == &reference();
    const auto ratio = static_cast<std::uint32_t>(std::bit_width(static_cast<unsigned>(oversampling)) - 2);
    adc.CFGR = adc::CFGR_JQDIS | adc::CFGR_DMAEN | adc::CFGR_DMACFG_circular | adc::CFGR_EXTSEL_TIM6 | adc::CFGR_EXTEN_rising |
               adc::CFGR_OVRMOD_overwrite |
               (watched ? adc::CFGR_AWD1EN | adc::CFGR_AWD1SGL | std::uint32_t{input.channel} << adc::CFGR_AWD1CH_Pos : 0U);
    adc.CFGR2 = adc::CFGR2_ROVSE | adc::CFGR2_TROVS | ratio << adc::CFGR2_OVSR_Pos;
    select(adc, input.channel, adc::SMPR_47_5_cycles);
}

void Converters::select(AdcRegisters& adc, std::uint8_t channel, std::uint32_t sampling) {
    const bool upper = channel >= kChannelsPerSampleRegister;
    (upper ? adc.SMPR2 : adc.SMPR1) = sampling << (3 * (channel - (upper ? kChannelsPerSampleRegister : 0U)));
    adc.SQR1 = std::uint32_t{channel} << adc::SQR1_SQ1_Pos;
}

Status Converters::stop() {
    Status status;
    for (Input& input : parts_.inputs) {
        AdcRegisters& adc = input.adc;
        adc.IER = 0;
        if ((adc.CR & adc::CR_ADSTART) != 0) {
            adc.CR = adc::CR_ADVREGEN | adc::CR_ADSTP;
            if (!await(adc.CR, adc::CR_ADSTP, 0)) {
                status = {StatusCode::timed_out, "an ADC does not stop"};
            }
        }
        input.dma.stop();
        // Discards a result, and its DMA request, that a stalled DMA left. Otherwise the next start would transfer it first.
        static_cast<void>(adc.DR);
    }
    return status;
}

/// The first conversion after a pause may be wrong (ES0430 2.7.9), so the second one counts.
Result<std::uint16_t> Converters::measure_one(std::uint8_t channel) {
    AdcRegisters& adc = reference();
    if ((adc.CR & adc::CR_ADSTART) != 0) {
        return Status{StatusCode::not_ready, "not possible while the converter takes samples"};
    }
    adc.CFGR = adc::CFGR_JQDIS | adc::CFGR_OVRMOD_overwrite;
    adc.CFGR2 = 0;
    select(adc, channel, adc::SMPR_640_5_cycles);
    std::uint16_t code = 0;
    for (int n = 0; n < 2; ++n) {
        adc.ISR = adc::ISR_EOC | adc::ISR_EOS | adc::ISR_OVR;
        adc.CR = adc::CR_ADVREGEN | adc::CR_ADSTART;
        if (!await(adc.ISR, adc::ISR_EOC, adc::ISR_EOC)) {
            return Status{StatusCode::timed_out, "a conversion does not end"};
        }
        code = static_cast<std::uint16_t>(adc.DR);
    }
    return code;
}

Converters::BlockEnd Converters::take_block_end() {
    constexpr std::uint32_t kHalves = dma::ISR_HTIF | dma::ISR_TCIF;
    const std::uint32_t flags = parts_.inputs[kSensorCoils - 1].dma.take_flags();
    BlockEnd end{(flags & dma::ISR_HTIF) != 0, (flags & dma::ISR_TCIF) != 0, (flags & dma::ISR_TEIF) != 0};
    for (std::size_t n = 0; n < parts_.inputs.size(); ++n) {
        if (n != kSensorCoils - 1) {
            const std::uint32_t others = parts_.inputs[n].dma.take_flags();
            end.failed = end.failed || (others & dma::ISR_TEIF) != 0;
            end.uneven = end.uneven || (others & kHalves) != (flags & kHalves);
        }
    }
    return end;
}

bool Converters::take_overrun() {
    bool overrun = false;
    for (Input& input : parts_.inputs) {
        if ((input.adc.ISR & adc::ISR_OVR) != 0) {
            input.adc.ISR = adc::ISR_OVR;
            overrun = true;
        }
    }
    return overrun;
}

bool Converters::take_over_limit() {
    AdcRegisters& adc = reference();
    if ((adc.ISR & adc::ISR_AWD1) == 0) {
        return false;
    }
    adc.IER = 0;
    adc.ISR = adc::ISR_AWD1;
    return true;
}

void Converters::copy(int half, std::span<Sample> to) const {
    for (std::size_t channel = 0; channel < memory_.size(); ++channel) {
        const volatile std::uint16_t* from = memory_[channel].data() + static_cast<std::size_t>(half) * block_samples_;
        for (Sample& sample : to) {
            sample[channel] = std::int32_t{*from++} - middle_;
        }
    }
}

}  // namespace tricoil::stm32g4
