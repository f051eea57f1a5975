// The full signal chain: simulated field, circuits and converters, then the main loop with demodulator and tracker; scores its
// poses.
#pragma once

#include "board/app/main_loop.hpp"
#include "board/support/sim_input/fault_text.hpp"
#include "sim/hal/simulated_hal.hpp"
#include "tests/support/column_replay.hpp"

namespace tricoil::test {

struct ChainParams {
    bool tdm = true;
    bool filtered = true;  // the filter; otherwise the direct solver, deskewed in TDM
    double duration_s = 5;
    bool noise = true;
    std::vector<std::string> faults;  // as parse_fault() reads them
    std::uint64_t seed = 1;
    double frame_rate_hz = 240;
    bool confined = false;                                 // the trackers may assume that the sensor stays in its hemisphere
    std::optional<tracking::MethodParams<double>> method;  // instead of `filtered`
};

/// Plays `motion` through the chain; calls `take` with every pose and the time at which it was sent (s).
template <typename Take>
void run_chain(const sim::Motion& motion, const ChainParams& chain, Take&& take) {
    const auto mode = chain.tdm ? signal::Multiplexing::tdm : signal::Multiplexing::fdm;
    const auto plan = *signal::plan_acquisition(signal::default_acquisition(mode, chain.frame_rate_hz));
    sim::WorldParams world_params;
    world_params.seed = chain.seed;
    if (!chain.noise) {
        world_params.converter.noise_v_per_sqrt_hz = 0;
        world_params.mains_v = 0;
    }
    std::vector<sim::Fault> faults;
    for (const auto& fault : chain.faults) {
        faults.push_back(host::parse_fault(fault));
    }
    sim::CoilWorld world(world_params, motion, faults);
    world.configure(plan);
    sim::SimulatedClock clock;
    clock.begin(plan.params.sample_rate_hz);
    sim::SimulatedCoilDriver coils;
    sim::SimulatedCoilSampler sampler(world, coils, clock, chain.duration_s);
    sim::SimulatedLink<double> link([&](const tracking::PoseEstimate<double>& e) { take(e, clock.elapsed_s()); });
    app::MainLoopParams<double> params{plan, world.demodulation(), {}};
    params.tracker.method = tracking::DirectParams{chain.tdm};
    if (chain.filtered) {
        params.tracker.method = tracking::ScaatParams<double>{};
    }
    params.tracker.method = chain.method.value_or(params.tracker.method);
    tracking::CommonParams<double>& common = params.tracker.common;
    common.coupling_constant = world_params.coupling_constant_m3;
    common.hemisphere = motion.at(0).position_m;
    common.confined = chain.confined;
    tracking::set_plan(common, plan);
    app::MainLoop<double> loop(params, {clock, coils, sampler, link});
    Status status = loop.start();
    while (status.ok() || status.code() == StatusCode::timed_out) {
        status = loop.step();
    }
}

/// Score of all poses.
inline Score score_chain(const sim::Motion& motion, const ChainParams& chain) {
    Score score;
    run_chain(motion, chain, [&](const tracking::PoseEstimate<double>& e, double) { score.add(e, motion, 0); });
    return score;
}

}  // namespace tricoil::test
