// Table of both fidelities of simulated runs: ratios of errors and of time.
#include <fmt/format.h>

#include <chrono>

#include "board/host/run/simulated_run.hpp"
#include "board/simulation/simulation_setup.hpp"
#include "sim/world/column_world.hpp"

namespace {

using namespace tricoil;
using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

host::RunReport run(const char* mux, const char* tracker, const char* fidelity) {
    host::RunOptions options;
    options.multiplexing = mux;
    options.tracker = tracker;
    options.fidelity = fidelity;
    options.duration_s = 60;
    options.show_live = false;
    return host::run_simulated(options);
}

/// Time of samples and demodulation divided by time of direct columns, for the same blocks.
double stage_ratio(const char* mux) {
    constexpr std::uint32_t kBlocks = 10'000;
    host::SimulationOptions options;
    options.multiplexing = mux;
    options.duration_s = 60;
    const host::SimulationSetup setup = host::make_simulation(options);
    const signal::AcquisitionPlan& plan = setup.plan;
    sim::CoilWorld world(setup.scenario.world, *setup.scenario.motion, {});
    world.configure(plan);
    const auto state = [&](std::uint32_t n) { return plan.is_tdm() ? single_coil(static_cast<int>(n % 3)) : Excitation::all; };

    signal::Demodulator<double> demodulator(plan, world.demodulation());
    std::vector<Sample> samples(static_cast<std::size_t>(plan.block_samples));
    const auto samples_began = Clock::now();
    for (std::uint32_t n = 0; n < kBlocks; ++n) {
        world.sample(state(n), n * plan.block_s(), samples);
        SampleBlock block;
        block.state = state(n);
        block.samples = samples;
        if (!demodulator.demodulate(block).ok()) {
            return 0;
        }
    }
    const double samples_s = seconds_since(samples_began);

    sim::ColumnWorld column_world(world, {});
    signal::Columns<double> columns;
    const auto columns_began = Clock::now();
    for (std::uint32_t n = 0; n < kBlocks; ++n) {
        column_world.simulate({state(n), n * plan.block_s(), {}, n}, columns);
    }
    return samples_s / seconds_since(columns_began);
}

}  // namespace

int main() {
    fmt::print("columns / samples, hand, 60 s\n  {:<4} {:<16} {:>12} {:>15} {:>10}\n", "mux", "tracker", "position RMS",
               "orientation RMS", "speed");
    for (const char* mux : {"fdm", "tdm"}) {
        for (const char* tracker : {"direct", "previous", "scaat"}) {
            const host::RunReport samples = run(mux, tracker, "samples");
            const host::RunReport columns = run(mux, tracker, "columns");
            fmt::print("  {:<4} {:<16} {:12.4f} {:15.4f} {:10.1f}\n", mux, tracker,
                       columns.score.position_m.rms / samples.score.position_m.rms,
                       columns.score.orientation_rad.rms / samples.score.orientation_rad.rms,
                       columns.simulated_s_per_s / samples.simulated_s_per_s);
        }
        fmt::print("  {:<4} {:<46} {:10.1f}\n", mux, "simulation and demodulation alone", stage_ratio(mux));
    }
    return 0;
}
