// Processes the same samples with the flash image and with the application built for the host: equal poses.
#include <gmock/gmock.h>

#include <bit>
#include <cstdlib>

#include "board/app/tracker_device.hpp"
#include "board/nucleo_g474re/measuring.hpp"
#include "drivers/stm32g4/gain_measurement.hpp"
#include "drivers/stm32g4/range_steps.hpp"
#include "tests/support/simulated_processor.hpp"
#include "tests/support/storage/simulated_storage.hpp"
#include "tests/virtual_board/board_bench.hpp"

namespace tricoil {
namespace {

using test::BoardBench;
using virtual_board::SampleRecord;

constexpr std::size_t kBlock = 100;
constexpr std::int32_t kMiddle = 2048 * 8;
constexpr std::uint64_t kHalfTriggersPerBlock = 2 * kBlock * 8;

/// Duration of a number of half trigger periods (296 / 340 us each), rounded to the nearest microsecond.
Microseconds time_of(std::uint64_t half_triggers) {
    return Microseconds{static_cast<std::int64_t>((half_triggers * 296 + 170) / 340)};
}

/// Samples of the converters from one start to the next.
using Burst = std::vector<SampleRecord>;

/// A sampler that replays the samples of the board's converters, start by start and block by block.
class RecordedSampler final : public hal::CoilSampler {
public:
    RecordedSampler(const std::vector<Burst>& bursts, sim::SimulatedClock& clock) : bursts_(bursts), clock_(clock) {}
    [[nodiscard]] bool is_over() const { return started_ > bursts_.size() || (started_ == bursts_.size() && !has_block()); }

private:
    [[nodiscard]] bool has_block() const { return (sequence_ + 1) * kBlock <= burst().size(); }
    [[nodiscard]] const Burst& burst() const { return bursts_[started_ - 1]; }
    Status do_start(const signal::AcquisitionPlan&) override {
        ++started_;
        sequence_ = 0;
        start_ = clock_.now();
        return {};
    }
    Status do_poll(SampleBlock& block) override {
        if (!has_block()) {
            return {StatusCode::end_of_stream, "no more was recorded"};
        }
        const auto records = std::span(burst()).subspan(sequence_ * kBlock, kBlock);
        for (std::size_t n = 0; n < kBlock; ++n) {
            for (std::size_t c = 0; c < kChannels; ++c) {
                samples_[n][c] = std::int32_t{records[n].codes[c]} - kMiddle;
            }
        }
        const SampleRecord& middle = records[kBlock / 2];
        block = SampleBlock{};
        block.state = middle.driven == 0 ? Excitation::off : single_coil(std::countr_zero(middle.driven));
        block.gain_step = static_cast<std::uint8_t>(stm32g4::kDriveSteps + std::countr_zero(middle.gain));
        block.scale = 3.3F / 4096 / 8;
        block.full_scale = 2047 * 8;
        block.start = start_ + time_of(sequence_ * kHalfTriggersPerBlock);
        block.sequence = static_cast<std::uint32_t>(sequence_++);
        block.samples = samples_;
        clock_.advance(kBlock);
        return {};
    }
    void do_stop() override {}

    const std::vector<Burst>& bursts_;
    std::size_t started_ = 0;
    sim::SimulatedClock& clock_;
    DeviceTime start_{};
    std::size_t sequence_ = 0;
    std::array<Sample, kBlock> samples_{};
};

/// Gain measurement on the recorded samples. The recording contains the gain steps and the test carrier.
class RecordedGain final : public stm32g4::TestInputGain {
public:
    explicit RecordedGain(hal::CoilSampler& sampler) : sampler_(sampler) {}

private:
    [[nodiscard]] std::uint8_t do_steps() const override { return stm32g4::kRangeSteps; }
    Status do_choose(std::uint8_t) override { return {}; }
    void do_set_test_carrier(float) override {}
    Status do_measure(const signal::AcquisitionPlan& plan, signal::GainSteps<float>& steps) override {
        return stm32g4::measure_gain(sampler_, *this, plan, steps);
    }
    hal::CoilSampler& sampler_;
};

/// Poses of the application built for the host, from these samples.
std::vector<protocol::PoseMessage> poses_of(const std::vector<Burst>& bursts) {
    sim::SimulatedClock clock;
    clock.begin(nucleo_g474re::kSampleRateHz);
    RecordedSampler sampler(bursts, clock);
    sim::SimulatedCoilDriver coils;
    RecordedGain gain(sampler);
    sim::SimulatedStorage storage(4, 2048);
    sim::SimulatedImageBank image;
    sim::SimulatedWatchdog watchdog(clock);
    sim::SimulatedSystem system(clock);
    sim::SimulatedIndicator indicator;
    sim::SimulatedButton button;
    sim::SimulatedMonitor monitor;
    sim::SimulatedHeartbeat heartbeat;
    sim::MemoryPort device_end(4096);
    test::HostEnd host(device_end);
    const std::array<hal::MessagePort*, 1> ports{&device_end};
    app::TrackerDevice device(
        {clock, coils, sampler, gain, heartbeat, storage, image, watchdog, system, indicator, button, monitor, ports},
        nucleo_g474re::device_params(1, 0));
    device.boot();
    device.step();  // opens its ports
    host.hello();
    host.start();
    for (std::size_t n = 0; n < 20 + bursts.back().size() / kBlock && !sampler.is_over(); ++n) {
        if (n % 16 == 0) {
            host.keep_alive();
        }
        device.step();
        host.listen();
    }
    EXPECT_EQ(device.state(), protocol::DeviceState::running) << "faults " << device.faults().bits();
    return host.poses;
}

template <typename Array>
std::int64_t largest_difference(const Array& a, const Array& b) {
    std::int64_t largest = 0;
    for (std::size_t i = 0; i < a.size(); ++i) {
        largest = std::max(largest, std::abs(std::int64_t{a[i]} - std::int64_t{b[i]}));
    }
    return largest;
}

/// Not bit for bit: the two C libraries round sines and roots differently, and compilers may reorder float additions. Units are
/// those of the wire: 0.1 um for the position, 1.25e-7 for the quaternion.
TEST(SameSamples, GiveEqualPosesOnTheHost) {
    BoardBench bench;
    std::vector<Burst> bursts;
    bench.board->on_sample = [&, last = virtual_board::Ticks{0}](const SampleRecord& record) mutable {
        if (bursts.empty() || record.time - last > virtual_board::ticks(20e-6)) {  // 14 us from sample to sample
            bursts.emplace_back();
        }
        last = record.time;
        bursts.back().push_back(record);
    };
    bench.start({test::on_serial});
    bench.run(0.4);  // no pause for the readings of the supply
    const auto& board = bench.host().poses;
    const auto here = poses_of(bursts);
    ASSERT_GT(board.size(), 250U);
    ASSERT_GE(here.size() + 2, board.size());
    const std::size_t count = std::min(here.size(), board.size());
    std::size_t equal = 0;
    std::int64_t position = 0;
    std::int64_t quaternion = 0;
    const std::int64_t shift_us = board[0].time_us - here[0].time_us;
    for (std::size_t n = 0; n < count; ++n) {
        ASSERT_EQ(board[n].time_us - here[n].time_us, shift_us) << n;
        ASSERT_EQ(board[n].flags, here[n].flags) << n;
        position = std::max(position, largest_difference(board[n].position, here[n].position));
        quaternion = std::max(quaternion, largest_difference(board[n].quaternion, here[n].quaternion));
        equal += board[n].position == here[n].position && board[n].quaternion == here[n].quaternion ? 1 : 0;
    }
    std::printf("%zu of %zu poses equal in every digit; largest difference %ld units of position, %ld of quaternion\n", equal,
                count, static_cast<long>(position), static_cast<long>(quaternion));
    EXPECT_LE(position, 20);
    EXPECT_LE(quaternion, 20);
}

}  // namespace
}  // namespace tricoil
