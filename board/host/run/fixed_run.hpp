// Parts of a simulated run with an integer tracker.
#pragma once

#include <functional>
#include <string>

#include "board/app/fixed_chain.hpp"
#include "board/host/run/simulated_run.hpp"
#include "board/support/output_file.hpp"
#include "core/fixed/sample_record.hpp"
#include "hal/clock.hpp"
#include "hal/coil_driver.hpp"
#include "hal/coil_sampler.hpp"
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

/// Records the samples of an integer tracker in a sample record (core/fixed/sample_record.hpp): writes every block and passes it
/// on.
class SampleRecorder final : public hal::CoilSampler {
public:
    /// Throws like OutputFile; a poll, too.
    SampleRecorder(const std::string& path, const fixed::ChainParams& params, hal::CoilSampler& sampler, const hal::Clock& clock);

    /// Ends the file. Throws like OutputFile::commit().
    void commit() { file_.commit(); }

private:
    Status do_start(const signal::AcquisitionPlan& plan) override { return sampler_.start(plan); }
    Status do_poll(SampleBlock& block) override;
    void do_stop() override { sampler_.stop(); }

    OutputFile file_;
    hal::CoilSampler& sampler_;
    const hal::Clock& clock_;
};

}  // namespace tricoil::host
