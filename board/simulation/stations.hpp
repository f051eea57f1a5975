// Simulated sensors: the one of the scenario, and further ones nearby that move little.
#pragma once

#include <memory>
#include <vector>

#include "board/simulation/simulation_setup.hpp"
#include "sim/hal/simulated_hal.hpp"
#include "sim/world/coil_world.hpp"

namespace tricoil::host {

/// Motions and worlds of all sensors. All worlds have the same source; each sensor has its own noise. Faults of the source and
/// metal act on all sensors, the other faults on the first.
class Stations {
public:
    /// `setup` must outlive this object. The worlds are configured for its plan.
    explicit Stations(const SimulationSetup& setup);

    [[nodiscard]] sim::CoilWorld& first() { return *worlds_.front(); }
    [[nodiscard]] const sim::CoilWorld& first() const { return *worlds_.front(); }
    [[nodiscard]] const sim::Motion& motion(std::size_t sensor) const { return worlds_[sensor]->motion(); }

    /// Adds all sensors but the first to a sampler of the first.
    void add_further(sim::SimulatedCoilSampler& sampler);

private:
    std::vector<std::unique_ptr<sim::Motion>> motions_;  // of the further sensors
    std::vector<std::unique_ptr<sim::CoilWorld>> worlds_;
};

}  // namespace tricoil::host
