// Programmable-gain amplifier between sensor coils and converters.
#pragma once

#include <cstdint>

#include "core/base/interface.hpp"
#include "core/base/status.hpp"
#include "core/signal/acquisition_plan.hpp"
#include "core/signal/gain_step.hpp"

namespace tricoil::hal {

/// One gain step applies to all three sensor channels; the reference channel has no amplifier. Step 0 has the lowest gain. The
/// first steps may reduce the drive of the source (GainStep::drive), for sensors that are near.
class GainControl : public Interface {
public:
    /// Number of steps, at least one.
    [[nodiscard]] std::uint8_t steps() const { return do_steps(); }

    /// Selects a gain step. The change takes effect at a block boundary, a few blocks later; SampleBlock::gain_step holds the
    /// step of each block. Thread context; does not wait. ok; invalid_argument: no such step.
    Status choose(std::uint8_t step) { return do_choose(step); }

    /// Measures gain and lag of each sensor channel at each step, as far as the amplifier can measure itself, and overwrites the
    /// nominal values in `steps`. The coils stay off. Sampling must be stopped; the function uses the sampler with `plan`, which
    /// must be a plan that drives the coils in turn. Thread context; waits some tenths of a second. ok; degenerate: a measured
    /// value is far from the nominal one; the codes of CoilSampler. After an error `steps` is invalid.
    Status measure(const signal::AcquisitionPlan& plan, signal::GainSteps<float>& steps) { return do_measure(plan, steps); }

private:
    [[nodiscard]] virtual std::uint8_t do_steps() const = 0;
    virtual Status do_choose(std::uint8_t step) = 0;
    virtual Status do_measure(const signal::AcquisitionPlan& plan, signal::GainSteps<float>& steps) = 0;
};

}  // namespace tricoil::hal
