// Sampler of a board's main loop with supervision of every block.
#pragma once

#include <optional>

#include "board/app/gain_ranging.hpp"
#include "core/protocol/message_type.hpp"
#include "hal/coil_sampler.hpp"
#include "hal/gain_control.hpp"
#include "hal/heartbeat.hpp"

namespace tricoil::app {

/// poll() returns device_lost on over-current, lost samples, missing data or a failure of the heartbeat line. The main loop then
/// switches the coils off. This class also selects the gain and toggles the heartbeat of the hardware enable.
class SupervisedSampler final : public hal::CoilSampler {
public:
    SupervisedSampler(hal::CoilSampler& sampler, hal::GainControl& gain, hal::Heartbeat& heartbeat,
                      const signal::GainSteps<float>& steps, float most_reference_v)
        : sampler_(sampler),
          gain_(gain),
          heartbeat_(heartbeat),
          ranging_(steps, gain.steps()),
          most_reference_v_(most_reference_v) {}

    /// Fault since start(), if any.
    [[nodiscard]] std::optional<protocol::Fault> fault() const { return fault_; }

    /// Number of lost samples since power-on.
    [[nodiscard]] std::uint32_t overruns() const { return overruns_; }

private:
    Status do_start(const signal::AcquisitionPlan& plan) override;
    Status do_poll(SampleBlock& block) override;
    void do_stop() override { sampler_.stop(); }

    Status fail(protocol::Fault fault, const char* reason);

    hal::CoilSampler& sampler_;
    hal::GainControl& gain_;
    hal::Heartbeat& heartbeat_;
    GainRanging ranging_;
    float most_reference_v_;
    std::size_t guard_ = 0;
    std::optional<protocol::Fault> fault_;
    std::uint32_t overruns_ = 0;
};

}  // namespace tricoil::app
