// Measures the true gains of the sensor amplifiers.
#pragma once

#include "core/base/status.hpp"
#include "core/signal/acquisition_plan.hpp"
#include "core/signal/gain_step.hpp"
#include "hal/coil_sampler.hpp"
#include "hal/gain_control.hpp"

namespace tricoil::stm32g4 {

/// Steps of range_steps.hpp whose input can be switched to an on-chip carrier.
class TestInputGain : public hal::GainControl {
public:
    /// From the sampler's next start() on, the inputs of the amplifiers are the plan's carriers with this amplitude (in codes, of
    /// 2048) instead of the sensor coils; 0: the sensor coils again. No source coil may be driven meanwhile.
    void set_test_carrier(float amplitude_codes) { do_set_test_carrier(amplitude_codes); }

private:
    virtual void do_set_test_carrier(float amplitude_codes) = 0;
};

/// Implements hal::GainControl::measure(). Compares each step with the step below. Both steps amplify the same on-chip carrier,
/// so errors of the carrier cancel; its amplitude is as large as the higher gain allows. The follower is assumed to have
/// its nominal gain. An op-amp's lag is proportional to its gain; its bandwidth follows from the phase at the highest gain.
/// Neglected phases: delays between trigger and sampling other than the sampling time. Additional error: invalid_argument for a
/// carrier without a whole number of cycles per block.
Status measure_gain(hal::CoilSampler& sampler, TestInputGain& gain, const signal::AcquisitionPlan& plan,
                    signal::GainSteps<float>& steps);

}  // namespace tricoil::stm32g4
