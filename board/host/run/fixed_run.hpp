// Parts of a simulated run with an integer tracker.
#pragma once

#include <functional>

#include "board/app/fixed_chain.hpp"
#include "board/host/run/simulated_run.hpp"
#include "sim/world/coil_world.hpp"

namespace tricoil::host {

/// Parameters of the tracker for samples of this world. Throws InputError for unsupported options.
app::FixedChain::Params fixed_params(const RunOptions& options, const RunObservers& observers, const sim::CoilWorld& world,
                                     const signal::AcquisitionPlan& plan, const Vec3<double>& hemisphere);

/// Converts the counters of the integer tracker to the common counters.
tracking::TrackerCounters in_common_counters(const fixed::TrackerCounters& counters);

/// Passes every estimate on in integers and in double.
class FixedLink final : public hal::EstimateLink<fixed::PoseEstimate> {
public:
    FixedLink(hal::Link<double>& link, std::function<void(const fixed::PoseEstimate&)> each)
        : link_(link), each_(std::move(each)) {}

private:
    Status do_send(const fixed::PoseEstimate& estimate) override;

    hal::Link<double>& link_;
    std::function<void(const fixed::PoseEstimate&)> each_;
};

}  // namespace tricoil::host
