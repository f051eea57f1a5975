// Poses of a simulated board, step by step.
#pragma once

#include <optional>

#include "board/app/main_loop.hpp"
#include "board/pose_source/pose_source.hpp"
#include "board/simulation/stations.hpp"
#include "board/support/pacer.hpp"
#include "sim/hal/simulated_hal.hpp"

namespace tricoil::host {

/// Runs as fast as poll() is called, or in real time.
class SimulatedSource final : public PoseSource {
public:
    /// Throws InputError for invalid options; the tracker must compute in floating point.
    SimulatedSource(const SimulationOptions& options, bool realtime);

private:
    bool do_advance(Microseconds patience) override;
    bool do_set_hemisphere(std::size_t sensor, const Vec3<double>& towards) override;
    [[nodiscard]] std::string do_status() const override;

    SimulationSetup setup_;
    Stations stations_;
    sim::SimulatedClock clock_;
    sim::SimulatedCoilDriver coils_;
    sim::SimulatedCoilSampler sampler_;
    sim::SimulatedLink<double> link_;
    std::optional<app::MainLoop<double>> loop_;  // always has a value after construction
    std::optional<Pacer> pacer_;                 // empty: as fast as possible
    bool ended_ = false;
};

}  // namespace tricoil::host
