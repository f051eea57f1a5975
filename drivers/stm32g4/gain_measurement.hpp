// What the steps of the sensor amplifiers' gain really are.
#pragma once

#include "core/base/status.hpp"
#include "core/signal/acquisition_plan.hpp"
#include "core/signal/gain_step.hpp"
#include "hal/coil_sampler.hpp"
#include "hal/gain_control.hpp"

namespace tricoil::stm32g4 {

/// Steps of SensorAmplifiers that can be given a carrier from within the chip.
class FedGain : public hal::GainControl {
public:
    /// From the sampler's next start on the amplifiers get the plan's carriers, so many codes of 2048 large, instead of the
    /// sensor coils; 0: the coils again. Nothing may be excited meanwhile.
    void feed(float amplitude_codes) { do_feed(amplitude_codes); }

private:
    virtual void do_feed(float amplitude_codes) = 0;
};

/// hal::GainControl::measure(). Each step against the one below, with one and the same carrier from within the chip, as large as
/// the greater gain bears: what the source does wrong cancels. The follower, step 0, is taken for what is stated of it. An
/// op-amp's lag grows with its gain: one number, its bandwidth, from the greatest gain's phase. That leaves out some
/// milliradians: the lead of the ladder's capacitor (1.5 at 10 kHz), and what passes between trigger and sampling beyond the
/// sampling time itself. Besides the errors of hal: invalid_argument for a carrier without whole cycles in a block.
Status measure_gain(hal::CoilSampler& sampler, FedGain& gain, const signal::AcquisitionPlan& plan,
                    signal::GainSteps<float>& steps);

}  // namespace tricoil::stm32g4
