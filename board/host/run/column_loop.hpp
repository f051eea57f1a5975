// Main loop of a simulated run that computes columns without samples.
#pragma once

#include "board/app/column_chain.hpp"
#include "board/simulation/simulation_setup.hpp"
#include "sim/hal/simulated_hal.hpp"
#include "sim/world/column_world.hpp"

namespace tricoil::host {

/// The interface of app::MainLoop<double> that a simulated run uses, for one sensor.
class ColumnLoop {
public:
    /// `world`, `clock` and the devices must outlive the loop; the sampler is not used. Throws InputError for a fault that acts
    /// on samples.
    ColumnLoop(const app::MainLoopParams<double>& params, const app::Devices<double>& devices, const SimulationSetup& setup,
               sim::CoilWorld& world, sim::SimulatedClock& clock);
    ~ColumnLoop() { stop(); }
    ColumnLoop(const ColumnLoop&) = delete;
    ColumnLoop& operator=(const ColumnLoop&) = delete;

    Status start();
    /// Simulates the next block. Errors: timed_out if a fault drops it; end_of_stream.
    Status acquire();
    void process();
    void stop() { devices_.coils.switch_off(); }
    Status set_hemisphere(std::size_t sensor, const Vec3<double>& towards);

    [[nodiscard]] const app::MainLoopCounters& counters() const { return counters_; }
    /// sensor: 0.
    [[nodiscard]] auto& tracker(std::size_t /*sensor*/ = 0) { return chain_.tracker(); }

private:
    signal::AcquisitionPlan plan_;
    double duration_s_;
    app::Devices<double> devices_;
    sim::SimulatedClock& clock_;
    sim::ColumnWorld world_;
    app::ColumnChain<double, tracking::AnyTracker<double>> chain_;
    signal::Columns<double> columns_;
    bool has_columns_ = false;
    bool after_gap_ = false;
    std::uint32_t sequence_ = 0;
    app::MainLoopCounters counters_;
};

}  // namespace tricoil::host
