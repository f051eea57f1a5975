// Records the samples of a simulated board as a WAV file.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "board/support/output_file.hpp"
#include "hal/coil_sampler.hpp"

namespace tricoil::host {

/// PCM of 32 bits, four channels; full scale of the converters is that of the file. A lost block becomes zeros, so that all
/// samples keep their times.
class WavRecorder final : public hal::CoilSampler {
public:
    /// is_live: each block is written at once. Throws like OutputFile; a poll, too.
    WavRecorder(const std::string& path, hal::CoilSampler& sampler, bool is_live)
        : file_(path), sampler_(sampler), is_live_(is_live) {}

    /// Writes the length and ends the file; a pipe keeps the length of a stream. Throws like OutputFile.
    void commit();

private:
    Status do_start(const signal::AcquisitionPlan& plan) override;
    Status do_poll(SampleBlock& block) override;
    void do_stop() override { sampler_.stop(); }

    OutputFile file_;
    hal::CoilSampler& sampler_;
    bool is_live_;
    std::uint32_t rate_hz_ = 0;
    std::uint64_t bytes_ = 0;  // of samples
    std::vector<Sample> scaled_;
};

}  // namespace tricoil::host
