// A converter that does not start at once: the WAV file has one header.
#include <gtest/gtest.h>

#include <filesystem>

#include "board/host/run/wav_recorder.hpp"
#include "tests/support/temporary_path.hpp"

namespace tricoil::test {
namespace {

class LateSampler final : public hal::CoilSampler {
    Status do_start(const signal::AcquisitionPlan& /*plan*/) override {
        return starts_++ == 0 ? Status(StatusCode::device_lost, "not yet") : Status();
    }
    Status do_poll(SampleBlock& /*block*/) override { return {StatusCode::timed_out, ""}; }
    void do_stop() override {}
    int starts_ = 0;
};

TEST(WavRecorder, ASecondStartWritesNoSecondHeader) {
    const std::string path = path_in_temp("late.wav");
    LateSampler sampler;
    host::WavRecorder recorder(path, sampler, false);
    hal::CoilSampler& recorded = recorder;
    signal::AcquisitionPlan plan;
    plan.params.sample_rate_hz = 192'000;
    plan.block_samples = 100;
    SampleBlock block;
    EXPECT_FALSE(recorded.start(plan).ok());
    EXPECT_TRUE(recorded.start(plan).ok());
    (void)recorded.poll(block);
    recorder.commit();
    EXPECT_EQ(std::filesystem::file_size(path), 44 + 100 * sizeof(Sample));
}

}  // namespace
}  // namespace tricoil::test
