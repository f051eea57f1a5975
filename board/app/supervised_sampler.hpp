// The sampler as the main loop of a board sees it: every block is looked at before anything is done with it.
#pragma once

#include <optional>

#include "board/app/gain_ranging.hpp"
#include "core/protocol/message_type.hpp"
#include "hal/coil_sampler.hpp"
#include "hal/gain_control.hpp"
#include "hal/heartbeat.hpp"

namespace tricoil::app {

/// A block that shows too much current, a converter that lost samples or delivers nothing: poll() says device_lost, whereupon the
/// loop switches the coils off. Chooses the gain, and beats the heart that holds the power stages' enable.
class SupervisedSampler final : public hal::CoilSampler {
public:
    SupervisedSampler(hal::CoilSampler& sampler, hal::GainControl& gain, hal::Heartbeat& heartbeat,
                      const signal::GainSteps<float>& steps, float most_reference_v)
        : sampler_(sampler),
          gain_(gain),
          heartbeat_(heartbeat),
          ranging_(steps, gain.steps()),
          most_reference_v_(most_reference_v) {}

    /// What was wrong since start(); nothing: all is well.
    [[nodiscard]] std::optional<protocol::Fault> trouble() const { return trouble_; }

    /// Samples that the converters lost, since power-on.
    [[nodiscard]] std::uint32_t overruns() const { return overruns_; }

private:
    Status do_start(const signal::AcquisitionPlan& plan) override;
    Status do_poll(SampleBlock& block) override;
    void do_stop() override { sampler_.stop(); }

    Status fail(protocol::Fault fault, const char* why);

    hal::CoilSampler& sampler_;
    hal::GainControl& gain_;
    hal::Heartbeat& heartbeat_;
    GainRanging ranging_;
    float most_reference_v_;
    std::size_t guard_ = 0;
    std::optional<protocol::Fault> trouble_;
    std::uint32_t overruns_ = 0;
};

}  // namespace tricoil::app
