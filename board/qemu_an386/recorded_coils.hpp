// Hardware of the image `fixed_tracker`: samples that the host recorded.
#pragma once

#include <array>

#include "board/qemu_an386/still_coils.hpp"
#include "core/fixed/sample_record.hpp"
#include "drivers/semihosting/input_file.hpp"

namespace tricoil::board {

/// Blocks of a sample record (fixed::RecordHead), until its end. Sets the clock to the time of the last poll in the record.
class RecordedCoilSampler final : public hal::CoilSampler {
public:
    static constexpr std::size_t kMaxSamples = 256;  // per block

    RecordedCoilSampler(semihosting::InputFile& file, const StillCoilDriver& coils, SampleClock& clock)
        : file_(file), coils_(coils), clock_(clock) {}

    /// Reads the head of the record, before start(). Errors: end_of_stream if there is no record, and those of fixed::params_of.
    Result<fixed::ChainParams> read_head();

private:
    Status do_start(const signal::AcquisitionPlan& plan) override;
    /// device_lost: the record was made with another excitation state.
    Status do_poll(SampleBlock& block) override;
    void do_stop() override {}

    semihosting::InputFile& file_;
    const StillCoilDriver& coils_;
    SampleClock& clock_;
    std::size_t block_samples_ = 0;
    std::array<Sample, kMaxSamples> samples_{};
};

}  // namespace tricoil::board
