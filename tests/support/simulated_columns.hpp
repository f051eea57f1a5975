// Columns of a simulated run, from samples through the demodulator, kept so that several trackers can use the same columns.
#pragma once

#include <string>
#include <vector>

#include "board/app/main_loop.hpp"
#include "board/support/sim_input/fault_text.hpp"
#include "board/support/sim_input/scenario_file.hpp"
#include "sim/hal/simulated_hal.hpp"

namespace tricoil::test {

struct RunSettings {
    std::string scenario = "hand";
    signal::Multiplexing multiplexing = signal::Multiplexing::tdm;
    bool noise = true;
    std::vector<std::string> faults;  // in addition to the scenario's; as parse_fault() reads them
    double duration_s = 5;
    std::uint64_t seed = 1;
};

/// Misfit and quadrature that simulated ideal coils leave, relative to k: quantisation of a resting sensor without noise.
constexpr double kSimulatedFloor = 1e-6;

/// Columns of one run, their plan, and the scenario with the true motion.
struct SimulatedColumns {
    sim::Scenario scenario;
    signal::AcquisitionPlan plan;
    std::vector<Column<double>> columns;

    [[nodiscard]] sim::Pose truth(DeviceTime time) const { return scenario.motion->at(to_seconds(time)); }

    [[nodiscard]] tracking::TrackerParams<double> tracker_params(const tracking::MethodParams<double>& method) const {
        tracking::TrackerParams<double> params;
        params.method = method;
        params.common.coupling_constant = scenario.world.coupling_constant_m3;
        params.common.hemisphere = scenario.motion->at(0).position_m;
        params.common.confined = true;
        tracking::set_plan(params.common, plan);
        params.common.quadrature_floor = kSimulatedFloor;
        return params;
    }
};

/// Stores the columns that the trackers receive.
class ColumnStore final : public tracking::TrackerTap<double> {
public:
    explicit ColumnStore(std::vector<Column<double>>& columns) : columns_(columns) {}

private:
    void do_column(const MeasuredColumn<double>& column) override { columns_.push_back(column); }
    std::vector<Column<double>>& columns_;
};

inline SimulatedColumns simulate_columns(const RunSettings& settings) {
    SimulatedColumns run;
    run.scenario = host::load_scenario(settings.scenario, settings.seed);
    run.scenario.duration_s = settings.duration_s;
    for (const std::string& fault : settings.faults) {
        run.scenario.faults.push_back(host::parse_fault(fault));
    }
    if (!settings.noise) {
        run.scenario.world.converter.noise_v_per_sqrt_hz = 0;
        run.scenario.world.mains_v = 0;
    }
    run.plan = *signal::plan_acquisition(signal::default_acquisition(settings.multiplexing, 240));
    sim::CoilWorld world(run.scenario.world, *run.scenario.motion, run.scenario.faults);
    world.configure(run.plan);
    sim::SimulatedClock clock;
    clock.begin(run.plan.params.sample_rate_hz);
    sim::SimulatedCoilDriver coils;
    sim::SimulatedCoilSampler sampler(world, coils, clock, settings.duration_s);
    sim::SimulatedLink<double> link([](const tracking::PoseEstimate<double>&) {});
    ColumnStore store(run.columns);
    app::MainLoopParams<double> params{run.plan, world.demodulation(), run.tracker_params(tracking::DirectParams{})};
    app::MainLoop<double> loop(params, {clock, coils, sampler, link, &store});
    Status status = loop.start();
    while (status.ok() || status.code() == StatusCode::timed_out) {
        status = loop.step();
    }
    return run;
}

}  // namespace tricoil::test
