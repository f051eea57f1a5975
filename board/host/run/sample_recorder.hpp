// Records the samples of an integer tracker in a sample record (core/fixed/sample_record.hpp).
#pragma once

#include <fstream>
#include <string>

#include "core/fixed/sample_record.hpp"
#include "hal/clock.hpp"
#include "hal/coil_driver.hpp"
#include "hal/coil_sampler.hpp"

namespace tricoil::host {

/// Writes every block and passes it on.
class SampleRecorder final : public hal::CoilSampler {
public:
    /// Throws InputError if the file cannot be written.
    SampleRecorder(const std::string& path, const fixed::ChainParams& params, hal::CoilSampler& sampler, const hal::Clock& clock);

    /// Throws DeviceError if writing failed.
    void close();

private:
    Status do_start(const signal::AcquisitionPlan& plan) override { return sampler_.start(plan); }
    Status do_poll(SampleBlock& block) override;
    void do_stop() override { sampler_.stop(); }

    std::string path_;
    std::ofstream file_;
    hal::CoilSampler& sampler_;
    const hal::Clock& clock_;
};

}  // namespace tricoil::host
