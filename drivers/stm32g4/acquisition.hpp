// Carrier output and sampling, block by block. Coils and gain are switched at block boundaries.
#pragma once

#include <array>
#include <cstdint>

#include "drivers/stm32g4/carrier_player.hpp"
#include "drivers/stm32g4/clocks.hpp"
#include "drivers/stm32g4/converters.hpp"
#include "drivers/stm32g4/enable_lines.hpp"
#include "drivers/stm32g4/gain_measurement.hpp"
#include "drivers/stm32g4/range_steps.hpp"
#include "drivers/stm32g4/registers/tim.hpp"
#include "hal/clock.hpp"
#include "hal/coil_driver.hpp"
#include "hal/coil_sampler.hpp"
#include "hal/gain_control.hpp"

namespace tricoil::stm32g4 {

struct AcquisitionParams {
    float carrier_amplitude_codes = 1792;  // of 2048: a buffered DAC output does not reach the rails
    float volts_per_conversion_code = 3.3F / 4096;
    float most_reference_v = 1.5F;  // if the reference exceeds this magnitude, the enable lines drop at once
    void (*sleep)() = nullptr;      // sleeps until any interrupt, at most a millisecond; called with interrupts disabled
};

/// The sampler; coils() and gain() are its two other interfaces. Sampling starts with the first poll() after start(), so that the
/// first block already has the excitation state set by excite(). The first conversion after a stop, or after 1 ms without
/// conversions, may be wrong (ES0430 2.7.9, 2.7.10): users drop the first samples while the coils settle. excite() and
/// gain().choose() take effect at the end of the running block; a change of the drive skips one block; excite(Excitation::off)
/// clears the enable lines at once. After an over-current, poll() and excite() return over_current until the next start().
class Acquisition final : public hal::CoilSampler {
public:
    /// Core clock cycles from one trigger to the next. Each trigger converts every input and updates every carrier. 574.3 kHz; an
    /// ADC at 42.5 MHz with 47.5 cycles of sampling needs 60 of the 74 ADC clock cycles.
    static constexpr std::uint32_t kTriggerTicks = 296;
    /// Otherwise each conversion would wait for the next edge of the ADC's clock, and the phase between the ADCs would vary,
    /// which disturbs their results (ES0430 2.7.11).
    static_assert(kTriggerTicks % Converters::kClockTicks == 0);

    /// Sample rates that a plan may use; `oversampling` is 2, 4, 8 or 16.
    static constexpr double sample_rate_hz(int oversampling) {
        return static_cast<double>(kFullSpeedHz) / (static_cast<int>(kTriggerTicks) * oversampling);
    }

    struct Parts {
        TimRegisters& trigger;  // TIM6
        CarrierPlayer& carriers;
        CarrierPlayer& test_carriers;  // connected to the amplifiers on the chip
        Converters& converters;
        EnableLines lines;
        SensorAmplifiers amplifiers;
        const hal::Clock& clock;
    };

    Acquisition(const Parts& parts, const AcquisitionParams& params);
    ~Acquisition() override;

    /// Call once, after the clocks are on. Switches the converters on and the coils off. ok; timed_out: a converter does not
    /// respond; start() then returns device_lost.
    Status begin();

    [[nodiscard]] hal::CoilDriver& coils() { return coils_; }
    [[nodiscard]] TestInputGain& gain() { return gain_; }

    /// Call from the interrupt of the DMA channel that ends a block.
    void on_block_end();
    /// Call from the interrupt of the reference channel's converter.
    void on_over_current();

private:
    class Coils final : public hal::CoilDriver {
    public:
        explicit Coils(Acquisition& all) : all_(all) {}

    private:
        Status do_excite(Excitation state) override { return all_.excite(state); }
        void do_switch_off() override { all_.switch_off(); }
        Acquisition& all_;
    };

    class Gain final : public TestInputGain {
    public:
        explicit Gain(Acquisition& all) : all_(all) {}

    private:
        [[nodiscard]] std::uint8_t do_steps() const override { return kRangeSteps; }
        Status do_choose(std::uint8_t step) override { return all_.choose(step); }
        Status do_measure(const signal::AcquisitionPlan& plan, signal::GainSteps<float>& steps) override {
            return measure_gain(all_, *this, plan, steps);
        }
        void do_set_test_carrier(float amplitude_codes) override {
            all_.has_test_carrier_ = amplitude_codes > 0;
            all_.test_carrier_codes_ = amplitude_codes;
        }
        Acquisition& all_;
    };

    /// Excitation state and gain of a block.
    struct Conditions {
        Excitation state = Excitation::off;
        std::uint8_t gain_step = kDriveSteps;
    };

    Status do_start(const signal::AcquisitionPlan& plan) override;
    Status do_poll(SampleBlock& block) override;
    void do_stop() override;

    Status excite(Excitation state);
    void switch_off();
    Status choose(std::uint8_t step);

    void run();
    [[nodiscard]] bool has_block() const;
    bool wait_for_block();
    bool copy_newest(std::uint32_t& block, Conditions& conditions);
    void switch_over();
    CarrierPlayer& player() { return has_test_carrier_ ? parts_.test_carriers : parts_.carriers; }
    void set_amplifiers();

    Parts parts_;
    AcquisitionParams params_;
    Coils coils_{*this};
    Gain gain_{*this};
    bool is_usable_ = false;
    bool is_armed_ = false;
    bool is_running_ = false;
    bool has_test_carrier_ = false;  // otherwise the amplifiers are connected to the sensor coils
    float test_carrier_codes_ = 0;

    int oversampling_ = 0;
    std::uint32_t block_samples_ = 0;
    DeviceTime start_{};           // of the first block
    std::uint64_t delivered_ = 0;  // number of blocks, lost ones included

    // Shared with the interrupt handlers.
    volatile std::uint32_t completed_ = 0;  // blocks
    volatile std::uint32_t overruns_ = 0;   // since the last poll()
    volatile bool has_failed_ = false;
    volatile bool has_tripped_ = false;
    volatile Excitation wanted_state_ = Excitation::off;
    volatile std::uint8_t wanted_step_ = kDriveSteps;
    Conditions now_;                       // of the running block
    std::array<Conditions, 2> of_half_{};  // of the newest complete block in each half of the converters' buffer

    std::array<Sample, Converters::kLongestBlock> samples_{};
};

}  // namespace tricoil::stm32g4
