// The world of the image `fixed_tracker`: samples that the host recorded.
#pragma once

#include <array>

#include "board/qemu_an386/still_coils.hpp"
#include "core/fixed/sample_record.hpp"
#include "drivers/semihosting/input_file.hpp"

namespace tricoil::board {

/// The record's time, as of the last poll.
class RecordClock final : public hal::Clock {
public:
    void set(DeviceTime now) { now_ = now; }

private:
    [[nodiscard]] DeviceTime do_now() const override { return now_; }

    DeviceTime now_{};
};

/// Blocks of a sample record (fixed::RecordHead), as long as it lasts.
class RecordedCoilSampler final : public hal::CoilSampler {
public:
    static constexpr std::size_t kMostSamples = 256;  // of a block

    RecordedCoilSampler(semihosting::InputFile& file, const StillCoilDriver& coils, RecordClock& clock)
        : file_(file), coils_(coils), clock_(clock) {}

    /// Reads the record's head, before start(). Errors: end_of_stream if there is none, and those of fixed::params_of.
    Result<fixed::ChainParams> read_head();

private:
    Status do_start(const signal::AcquisitionPlan& plan) override;
    /// device_lost: the record was made with other excitation.
    Status do_poll(SampleBlock& block) override;
    void do_stop() override {}

    semihosting::InputFile& file_;
    const StillCoilDriver& coils_;
    RecordClock& clock_;
    std::size_t block_samples_ = 0;
    std::array<Sample, kMostSamples> samples_{};
};

}  // namespace tricoil::board
