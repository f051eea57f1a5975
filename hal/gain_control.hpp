// The amplifier between sensor coils and converters, where a program chooses its gain.
#pragma once

#include <cstdint>

#include "core/base/status.hpp"
#include "core/signal/acquisition_plan.hpp"
#include "core/signal/gain_step.hpp"

namespace tricoil::hal {

/// One step for all three sensor channels; the reference channel has none. Step 0 is the least gain.
class GainControl {
public:
    GainControl() = default;
    GainControl(const GainControl&) = delete;
    GainControl& operator=(const GainControl&) = delete;
    virtual ~GainControl() = default;

    /// How many steps there are, at least one.
    [[nodiscard]] std::uint8_t steps() const { return do_steps(); }

    /// From a block soon to come on, changed where one block ends and the next begins; SampleBlock::gain_step tells with which
    /// step a block was sampled. Thread context; does not wait.
    /// ok; invalid_argument: no such step.
    Status choose(std::uint8_t step) { return do_choose(step); }

    /// Replaces what is stated of the steps, gain and lag of each sensor channel, by what they really are, as far as this
    /// amplifier can measure itself; coils stay off. Nothing may be sampled when it begins; uses the sampler, with a plan for it
    /// that takes the coils in turn. Thread context; waits some tenths of a second. ok; degenerate: the steps are not nearly as
    /// stated; those of CoilSampler. After an error `steps` is not to be used.
    Status measure(const signal::AcquisitionPlan& plan, signal::GainSteps<float>& steps) { return do_measure(plan, steps); }

private:
    [[nodiscard]] virtual std::uint8_t do_steps() const = 0;
    virtual Status do_choose(std::uint8_t step) = 0;
    virtual Status do_measure(const signal::AcquisitionPlan&, signal::GainSteps<float>&) { return {}; }
};

}  // namespace tricoil::hal
