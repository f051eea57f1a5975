#include "drivers/stm32g4/acquisition.hpp"

#include <bit>
#include <span>

#include "drivers/stm32g4/interrupts_off.hpp"

namespace tricoil::stm32g4 {
namespace {

/// Wait beyond the block time, because interrupts of higher priority may delay the end of a block.
constexpr Microseconds kPollMargin{300};
constexpr std::int32_t kTopOfOneConversion = 2047;
constexpr Status kTripped{StatusCode::over_current, "over-current: a power stage is faulty"};

struct Rate {
    std::uint64_t bits;
    int oversampling;
};

constexpr Rate rate_of(int oversampling) {
    return {std::bit_cast<std::uint64_t>(Acquisition::sample_rate_hz(oversampling)), oversampling};
}

/// Oversampling of a sample rate; 0: unsupported rate. Compares bits, because a plan contains exactly this quotient and this
/// processor has no double-precision hardware.
int oversampling_of(double sample_rate_hz) {
    constexpr std::array kRates{rate_of(2), rate_of(4), rate_of(8), rate_of(16)};
    for (const Rate& rate : kRates) {
        if (rate.bits == std::bit_cast<std::uint64_t>(sample_rate_hz)) {
            return rate.oversampling;
        }
    }
    return 0;
}

/// Nearest microsecond to a number of half triggers.
constexpr Microseconds time_of_half_triggers(std::uint64_t half_triggers) {
    constexpr std::uint64_t kTwoMegahertz = kFullSpeedHz / 500'000;  // core ticks in two microseconds
    return Microseconds{
        static_cast<std::int64_t>((half_triggers * Acquisition::kTriggerTicks + kTwoMegahertz / 2) / kTwoMegahertz)};
}

}  // namespace

Acquisition::Acquisition(const Parts& parts, const AcquisitionParams& params) : parts_(parts), params_(params) {}

Acquisition::~Acquisition() {
    switch_off();
    stop();
}

Status Acquisition::begin() {
    switch_off();
    parts_.trigger.CR1 = 0;
    parts_.trigger.CR2 = tim::CR2_MMS_update;
    parts_.trigger.PSC = 0;
    parts_.trigger.ARR = kTriggerTicks - 1;
    set_amplifiers();
    Status status = parts_.carriers.begin();
    if (status.ok()) {
        status = parts_.test_carriers.begin();
    }
    if (status.ok()) {
        status = parts_.converters.begin();
    }
    is_usable_ = status.ok();
    return status;
}

Status Acquisition::do_start(const signal::AcquisitionPlan& plan) {
    stop();
    if (!is_usable_) {
        return {StatusCode::device_lost, "the converters do not work"};
    }
    const int oversampling = oversampling_of(plan.params.sample_rate_hz);
    if (oversampling == 0) {
        return {StatusCode::invalid_argument, "unsupported sample rate; use Acquisition::sample_rate_hz()"};
    }
    if (plan.block_samples < 1 || plan.block_samples > static_cast<int>(Converters::kLongestBlock)) {
        return {StatusCode::invalid_argument, "block is empty or longer than this board's buffer"};
    }
    oversampling_ = oversampling;
    block_samples_ = static_cast<std::uint32_t>(plan.block_samples);
    const float codes = has_test_carrier_ ? test_carrier_codes_ : params_.carrier_amplitude_codes * drive_of(wanted_step_);
    if (const Status loaded = player().load(plan, oversampling, codes); !loaded.ok()) {
        return loaded;
    }
    const float limit = params_.most_reference_v / params_.volts_per_conversion_code * static_cast<float>(oversampling);
    if (!parts_.converters.start(block_samples_, oversampling, static_cast<std::int32_t>(limit)).ok()) {
        is_usable_ = false;
        return {StatusCode::device_lost, "a converter does not stop"};
    }
    completed_ = 0;
    delivered_ = 0;
    overruns_ = 0;
    has_failed_ = false;
    has_tripped_ = false;
    is_armed_ = true;
    return {};
}

void Acquisition::do_stop() {
    parts_.trigger.CR1 = 0;
    is_armed_ = false;
    is_running_ = false;
    if (is_usable_) {
        parts_.carriers.stop();
        parts_.test_carriers.stop();
        is_usable_ = parts_.converters.stop().ok();
    }
}

/// Starts the first block.
void Acquisition::run() {
    static_cast<void>(player().take_underrun());
    now_.gain_step = wanted_step_;
    set_amplifiers();  // unconditionally: the present setting of the amplifiers is unknown
    switch_over();
    parts_.trigger.CNT = 0;
    // A sample's time is the middle of its conversions. The conversions of the first sample start 1 to `oversampling_` trigger
    // periods after the start of the timer.
    start_ = parts_.clock.now() + time_of_half_triggers(1U + static_cast<unsigned>(oversampling_));
    parts_.trigger.CR1 = tim::CR1_CEN | tim::CR1_URS;
    is_running_ = true;
}

Status Acquisition::do_poll(SampleBlock& block) {
    if (!is_armed_) {
        return {StatusCode::device_lost, "sampling has not been started"};
    }
    if (!is_running_) {
        run();
    }
    std::uint32_t sequence = 0;
    Conditions conditions;
    const bool has_block = wait_for_block() && copy_newest(sequence, conditions);
    if (has_tripped_) {
        return kTripped;
    }
    if (!has_block) {
        return has_failed_ ? Status{StatusCode::device_lost, "DMA transfer error"}
                           : Status{StatusCode::timed_out, "no block arrived"};
    }
    const std::uint64_t index = delivered_ + (sequence - static_cast<std::uint32_t>(delivered_));
    delivered_ = index + 1;
    const std::uint64_t half_triggers_per_block = std::uint64_t{2} * block_samples_ * static_cast<unsigned>(oversampling_);
    block.sensor = 0;
    block.state = conditions.state;
    block.gain_step = conditions.gain_step;
    block.scale = params_.volts_per_conversion_code / static_cast<float>(oversampling_);
    block.full_scale = kTopOfOneConversion * oversampling_;
    block.start = start_ + time_of_half_triggers(index * half_triggers_per_block);
    block.sequence = sequence;
    {
        const InterruptsOff guard;
        block.overrun_count = overruns_;
        overruns_ = 0;
    }
    block.samples = std::span(samples_).first(block_samples_);
    return {};
}

/// True if a block after the last delivered one is complete. The difference stays right when `completed_` overflows, after weeks.
bool Acquisition::has_block() const { return static_cast<std::int32_t>(completed_ - static_cast<std::uint32_t>(delivered_)) > 0; }

/// False if no block arrives in time.
bool Acquisition::wait_for_block() {
    const std::uint32_t skipped = static_cast<std::uint32_t>(delivered_) - completed_;
    const std::uint64_t blocks = skipped == 1 ? 2 : 1;
    const std::uint64_t half_triggers = 2 * blocks * block_samples_ * static_cast<unsigned>(oversampling_);
    const DeviceTime deadline = parts_.clock.now() + time_of_half_triggers(half_triggers) + kPollMargin;
    while (!has_block()) {
        if (has_failed_ || parts_.clock.now() > deadline) {
            return false;
        }
        const InterruptsOff guard;  // without it, a block that ends between the check and the sleep would not end the sleep
        if (!has_block()) {
            params_.sleep();
        }
    }
    return true;
}

/// Repeats the copy once if the converters began to overwrite the block meanwhile. They do so one block time after its end.
bool Acquisition::copy_newest(std::uint32_t& block, Conditions& conditions) {
    for (int attempt = 0; attempt < 2; ++attempt) {
        {
            const InterruptsOff guard;
            block = completed_ - 1;
            conditions = of_half_[block % 2];
        }
        parts_.converters.copy(static_cast<int>(block % 2), std::span(samples_).first(block_samples_));
        if (completed_ == block + 1) {
            return true;
        }
    }
    return false;
}

void Acquisition::on_block_end() {
    const Converters::BlockEnd end = parts_.converters.take_block_end();
    if (end.failed) {
        has_failed_ = true;
        switch_off();
    }
    const std::uint32_t ended = (end.first_half ? 1U : 0U) + (end.second_half ? 1U : 0U);
    for (std::uint32_t n = 0; n < ended; ++n) {
        of_half_[completed_ % 2] = now_;
        completed_ = completed_ + 1;
    }
    // If both halves are complete, this handler runs one block too late, and so does the switch-over.
    const bool late = ended > 1 || (ended > 0 && end.uneven) || parts_.converters.take_overrun() || player().take_underrun();
    overruns_ = overruns_ + (late ? 1U : 0U);
    if (ended > 0) {
        switch_over();
    }
}

void Acquisition::on_over_current() {
    if (parts_.converters.take_over_limit()) {
        has_tripped_ = true;
        switch_off();
    }
}

void Acquisition::switch_over() {
    now_.state = wanted_state_;
    parts_.lines.set(now_.state);
    if (has_tripped_) {  // an over-current interrupt just before set() has cleared the enable lines, and set() has set them again
        parts_.lines.off();
    }
    if (now_.gain_step != wanted_step_) {
        now_.gain_step = wanted_step_;
        set_amplifiers();
    }
}

void Acquisition::set_amplifiers() {
    parts_.amplifiers.set(amplifier_step(now_.gain_step),
                          has_test_carrier_ ? SensorAmplifiers::Input::inside : SensorAmplifiers::Input::coils);
}

Status Acquisition::excite(Excitation state) {
    if (has_tripped_) {
        return kTripped;
    }
    wanted_state_ = state;
    if (has_tripped_ || state == Excitation::off) {  // over-current meanwhile: the wanted state must not become active
        switch_off();
    }
    return {};
}

void Acquisition::switch_off() {
    wanted_state_ = Excitation::off;
    parts_.lines.off();
}

Status Acquisition::choose(std::uint8_t step) {
    if (step >= kRangeSteps) {
        return {StatusCode::invalid_argument, "no such gain step"};
    }
    const bool changes_drive = drive_of(step) != drive_of(wanted_step_) && !has_test_carrier_;
    if (changes_drive && is_armed_) {
        player().set_amplitude(params_.carrier_amplitude_codes * drive_of(step));
    }
    wanted_step_ = step;
    if (changes_drive && is_running_) {  // skips the running block, which has both amplitudes
        delivered_ += completed_ + 1 - static_cast<std::uint32_t>(delivered_);
    }
    return {};
}

}  // namespace tricoil::stm32g4
