// Hardware of the image `tracker`: couplings of a sensor at rest, in place of converters and power stages.
#pragma once

#include <array>

#include "core/linear/matrix.hpp"
#include "hal/clock.hpp"
#include "hal/coil_driver.hpp"
#include "hal/coil_sampler.hpp"

namespace tricoil::board {

class StillCoilDriver final : public hal::CoilDriver {
public:
    [[nodiscard]] Excitation state() const { return state_; }

private:
    Status do_excite(Excitation state) override {
        state_ = state;
        return {};
    }
    void do_switch_off() override { state_ = Excitation::off; }

    Excitation state_ = Excitation::off;
};

/// Clock that the sampler moves.
class SampleClock final : public hal::Clock {
public:
    void advance(Microseconds step) { now_ += step; }
    void set(DeviceTime now) { now_ = now; }

private:
    [[nodiscard]] DeviceTime do_now() const override { return now_; }

    DeviceTime now_{};
};

/// Blocks of a carrier whose amplitudes are the couplings of one signal matrix, with converter noise.
class StillCoilSampler final : public hal::CoilSampler {
public:
    /// Ends after `blocks` blocks. x: couplings relative to the reference channel, below one.
    StillCoilSampler(const StillCoilDriver& coils, SampleClock& clock, const Mat3<float>& x, std::uint32_t blocks)
        : coils_(coils), clock_(clock), x_(x), blocks_(blocks) {}

private:
    Status do_start(const signal::AcquisitionPlan& plan) override;
    Status do_poll(SampleBlock& block) override;
    void do_stop() override {}

    const StillCoilDriver& coils_;
    SampleClock& clock_;
    Mat3<float> x_;
    std::uint32_t blocks_;
    std::uint32_t sequence_ = 0;
    std::uint32_t noise_ = 1;
    std::size_t block_samples_ = 0;
    float step_rad_ = 0;  // of the carrier per sample
    Microseconds block_time_{};
    std::array<Sample, 256> samples_{};
};

}  // namespace tricoil::board
