// Acquisition plan with given numbers, for boards with a fixed converter clock and too little flash to compute a plan.
#pragma once

#include <algorithm>

#include "core/signal/acquisition_plan.hpp"

namespace tricoil::signal {

/// TDM: blocks of `block` samples. The first `guard` are dropped, the rest holds `cycles` of the carrier.
constexpr AcquisitionPlan stated_tdm_plan(double sample_rate_hz, int block, int guard, int cycles) {
    AcquisitionPlan plan;
    const double carrier_hz = sample_rate_hz * cycles / (block - guard);
    plan.params = {Multiplexing::tdm, sample_rate_hz, sample_rate_hz / (kSourceCoils * block), {}, guard};
    std::fill_n(plan.params.carrier_hz.begin(), kSourceCoils, carrier_hz);
    plan.block_samples = block;
    plan.window_samples = block - guard;
    std::fill_n(plan.window_cycles.begin(), kSourceCoils, cycles);
    return plan;
}

/// FDM: every block is a frame and holds `cycles` of each coil's carrier.
constexpr AcquisitionPlan stated_fdm_plan(double sample_rate_hz, int block, const std::array<int, kSourceCoils>& cycles) {
    AcquisitionPlan plan;
    plan.params = {Multiplexing::fdm, sample_rate_hz, sample_rate_hz / block, {}, 0};
    for (std::size_t j = 0; j < cycles.size(); ++j) {
        plan.params.carrier_hz[j] = sample_rate_hz * cycles[j] / block;
    }
    plan.block_samples = block;
    plan.window_samples = block;
    std::copy(cycles.begin(), cycles.end(), plan.window_cycles.begin());
    return plan;
}

/// Two bands: every block is a frame and holds `cycles` of each coil's high carrier and `low_cycles` of its low carrier.
constexpr AcquisitionPlan stated_dual_band_plan(double sample_rate_hz, int block, const std::array<int, kSourceCoils>& cycles,
                                                const std::array<int, kSourceCoils>& low_cycles) {
    AcquisitionPlan plan = stated_fdm_plan(sample_rate_hz, block, cycles);
    plan.params.multiplexing = Multiplexing::dual_band;
    for (std::size_t j = 0; j < low_cycles.size(); ++j) {
        plan.params.carrier_hz[kSourceCoils + j] = sample_rate_hz * low_cycles[j] / block;
        plan.window_cycles[kSourceCoils + j] = low_cycles[j];
    }
    return plan;
}

}  // namespace tricoil::signal
