// Clock, coil driver, gain, coil sampler and link in virtual time, on top of a CoilWorld.
#pragma once

#include <functional>
#include <vector>

#include "hal/clock.hpp"
#include "hal/coil_driver.hpp"
#include "hal/coil_sampler.hpp"
#include "hal/gain_control.hpp"
#include "hal/link.hpp"
#include "sim/world/coil_world.hpp"

namespace tricoil::sim {

/// Time advances only by sampling (one block per poll) and by pause().
class SimulatedClock final : public hal::Clock {
public:
    explicit SimulatedClock(DeviceTime start = {}) : start_(start) {}
    void begin(double sample_rate_hz) {
        before_s_ = elapsed_s();
        samples_ = 0;
        sample_rate_hz_ = sample_rate_hz;
    }
    void advance(std::size_t samples) { samples_ += static_cast<std::int64_t>(samples); }
    void pause(double seconds) { before_s_ += seconds; }
    [[nodiscard]] double elapsed_s() const { return before_s_ + static_cast<double>(samples_) / sample_rate_hz_; }
    [[nodiscard]] DeviceTime at(double elapsed_s) const { return start_ + microseconds_from_seconds(elapsed_s); }
    [[nodiscard]] double elapsed_s(DeviceTime time) const { return to_seconds(time - start_); }

private:
    [[nodiscard]] DeviceTime do_now() const override { return at(elapsed_s()); }
    DeviceTime start_;
    double sample_rate_hz_ = 1;
    double before_s_ = 0;  // elapsed before the present sampling began
    std::int64_t samples_ = 0;
};

class SimulatedCoilDriver final : public hal::CoilDriver {
public:
    [[nodiscard]] Excitation state() const { return state_; }
    [[nodiscard]] std::uint64_t changes() const { return changes_; }
    /// Sets the status that excite() returns from now on.
    void fail_with(Status status) { status_ = status; }

private:
    Status do_excite(Excitation state) override;
    void do_switch_off() override { state_ = Excitation::off; }
    Excitation state_ = Excitation::off;
    std::uint64_t changes_ = 0;
    Status status_;
};

/// The amplifier between the world and its converters.
class SimulatedGain final : public hal::GainControl {
public:
    /// Only the first `steps` entries of `all` are used.
    SimulatedGain(const signal::GainSteps<double>& all, std::uint8_t steps) : all_(all), steps_(steps) {}
    [[nodiscard]] std::uint8_t step() const { return step_; }
    [[nodiscard]] const signal::GainStep<double>& chosen() const { return all_[step_]; }
    /// Sets the status that measure() returns from now on; with ok, measure() gives the true steps.
    void fail_with(Status status) { status_ = status; }
    /// Emulates an amplifier that cannot measure itself: measure() changes nothing.
    void disable_measurement() { measures_ = false; }
    [[nodiscard]] int attempts() const { return attempts_; }

private:
    [[nodiscard]] std::uint8_t do_steps() const override { return steps_; }
    Status do_choose(std::uint8_t step) override {
        if (step >= steps_) {
            return {StatusCode::invalid_argument, "no such gain step"};
        }
        step_ = step;
        return {};
    }
    Status do_measure(const signal::AcquisitionPlan&, signal::GainSteps<float>& steps) override {
        ++attempts_;
        for (std::size_t n = 0; n < steps_ && measures_ && status_.ok(); ++n) {
            for (std::size_t coil = 0; coil < kSensorCoils; ++coil) {
                steps[n].gain[coil] = static_cast<float>(all_[n].gain[coil]);
                steps[n].lag_s[coil] = static_cast<float>(all_[n].lag_s[coil]);
            }
        }
        return status_;
    }
    signal::GainSteps<double> all_;
    Status status_;
    bool measures_ = true;
    int attempts_ = 0;
    std::uint8_t steps_;
    std::uint8_t step_ = 0;
};

class SimulatedCoilSampler final : public hal::CoilSampler {
public:
    /// Ends the stream after duration_s of virtual time.
    SimulatedCoilSampler(CoilWorld& world, const SimulatedCoilDriver& coils, SimulatedClock& clock, double duration_s);

    /// Adds a sensor, which is sampled at the same times as the first. `world` must have the same converter and outlive the
    /// sampler. Each excitation brings one block per sensor, in the order of the calls. Call it before start().
    void add_sensor(CoilWorld& world) { worlds_.push_back(&world); }

    /// Adds an amplifier; by default there is none.
    void amplify(const SimulatedGain& gain) { gain_ = &gain; }

private:
    Status do_start(const signal::AcquisitionPlan& plan) override;
    Status do_poll(SampleBlock& block) override;
    void do_stop() override { running_ = false; }

    std::vector<CoilWorld*> worlds_;  // by sensor
    const SimulatedCoilDriver& coils_;
    SimulatedClock& clock_;
    double duration_s_;
    std::size_t sensor_ = 0;  // of the next block
    double start_s_ = 0;      // of the blocks of all sensors
    const SimulatedGain* gain_ = nullptr;
    signal::AcquisitionPlan plan_;
    std::vector<Sample> samples_;
    std::uint32_t sequence_ = 0;
    bool running_ = false;
};

/// Passes every estimate to a function; sending fails only after fail_with().
template <typename Scalar>
class SimulatedLink final : public hal::Link<Scalar> {
public:
    using Receiver = std::function<void(const tracking::PoseEstimate<Scalar>&)>;
    explicit SimulatedLink(Receiver receiver) : receiver_(std::move(receiver)) {}
    void fail_with(Status status) { status_ = status; }

private:
    Status do_send(const tracking::PoseEstimate<Scalar>& estimate) override {
        if (status_.ok()) {
            receiver_(estimate);
        }
        return status_;
    }
    Receiver receiver_;
    Status status_;
};

}  // namespace tricoil::sim
