// Processing of one sensor in integers, for boards without a floating-point unit.
#pragma once

#include "board/app/column_chain.hpp"
#include "core/fixed/sample_record.hpp"

namespace tricoil::app {

class FixedChain {
public:
    struct Params {
        signal::AcquisitionPlan plan;  // for the coils and the sampler
        fixed::ChainParams chain;      // of that plan; must pass check()
        int sensors = 1;
    };
    struct Devices {
        hal::Clock& clock;
        hal::CoilDriver& coils;
        hal::CoilSampler& sampler;
        hal::EstimateLink<fixed::PoseEstimate>& link;
    };
    using Direction = Vec3<fixed::Unit>;

    explicit FixedChain(const Params& params)
        : tracker_(params.chain.acquisition, params.chain.demodulator, params.chain.tracker) {}

    // See ColumnChain.
    bool update(const SampleBlock& block, bool& after_gap, const Devices& devices, MainLoopCounters& counters);
    void tick(std::uint8_t sensor, const Devices& devices, MainLoopCounters& counters);
    Status set_hemisphere(std::uint8_t sensor, const Direction& towards, const Devices& devices);

    [[nodiscard]] fixed::Tracker& tracker() { return tracker_; }

private:
    fixed::Tracker tracker_;
};

}  // namespace tricoil::app
