// The loop of all sources: pause, pace, duration, health, and the ends of a run.
#include "board/stream/stream_loop.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <csignal>

#include "board/support/errors.hpp"
#include "board/support/interrupt.hpp"

namespace tricoil::host {
namespace {

constexpr Microseconds kStep{10'000};
constexpr int kSteps = 10;

/// Gives kSteps steps of 10 ms each.
class Steps final : public Source {
public:
    explicit Steps(bool is_live = false) : is_live_(is_live) {}

    bool advance(Microseconds /*patience*/) override {
        steps += steps < kSteps ? 1 : 0;
        is_on = true;
        return ++calls <= kSteps;
    }
    void rest() override { is_on = false; }
    bool set_hemisphere(std::size_t /*sensor*/, const Vec3<double>& /*towards*/) override { return false; }
    [[nodiscard]] bool is_live() const override { return is_live_; }
    [[nodiscard]] Microseconds elapsed() const override { return steps * kStep; }
    [[nodiscard]] std::optional<LinkState> link_state() const override {
        HealthCounts counts;
        counts.lost = static_cast<std::uint64_t>(steps);
        return LinkState{counts, 10 * elapsed()};
    }
    [[nodiscard]] std::string status() const override { return "counting"; }

    int calls = 0;
    int steps = 0;
    bool is_on = false;

private:
    bool is_live_;
};

double run_seconds(Steps& source, const LoopParams& params) {
    const auto begin = std::chrono::steady_clock::now();
    StreamLoop(source, params).run();
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

TEST(StreamLoop, RunsToTheEndOfTheSourceAndSwitchesTheCoilsOff) {
    Steps source;
    StreamLoop loop(source, {});
    loop.run();
    EXPECT_EQ(source.calls, kSteps + 1);
    EXPECT_FALSE(source.is_on);
    EXPECT_FALSE(loop.interrupted());
}

TEST(StreamLoop, EndsAtTheDurationOfTheSourcesClock) {
    Steps source;
    LoopParams params;
    params.duration_s = 0.045;
    StreamLoop(source, params).run();
    EXPECT_EQ(source.steps, 5);
}

TEST(StreamLoop, EndsWhenAFunctionSaysSo) {
    Steps source;
    LoopParams params;
    params.is_over = [&] { return source.steps == 3; };
    StreamLoop(source, params).run();
    EXPECT_EQ(source.steps, 3);
    EXPECT_FALSE(source.is_on);
}

TEST(StreamLoop, ReadyComesBeforeTheFirstStep) {
    Steps source;
    LoopParams params;
    int calls_before = -1;
    params.ready = [&] { calls_before = source.calls; };
    StreamLoop(source, params).run();
    EXPECT_EQ(calls_before, 0);
}

TEST(StreamLoop, KeepsTheCoilsOffWhilePaused) {
    Steps source;
    LoopParams params;
    int rounds = 0;
    params.is_paused = [&] {
        ++rounds;
        EXPECT_EQ(source.is_on, rounds > 1 && (rounds <= 4 || rounds > 8)) << "round " << rounds;
        return rounds >= 4 && rounds < 8;
    };
    StreamLoop(source, params).run();
    EXPECT_EQ(source.steps, kSteps) << "the run goes on after the pause";
}

/// The last step is due 90 ms after the first.
TEST(StreamLoop, KeepsThePaceOfTheSourcesClock) {
    LoopParams params;
    params.realtime = true;
    Steps made;
    EXPECT_GE(run_seconds(made, params), 0.0895);
    EXPECT_EQ(made.steps, kSteps);
}

TEST(StreamLoop, WaitsForOutputsWithTheCoilsOn) {
    Steps source;
    LoopParams params;
    int rounds = 0;
    params.must_wait = [&] { return ++rounds % 2 == 0; };
    params.each_step = [](Source& stepped) { EXPECT_TRUE(static_cast<Steps&>(stepped).is_on); };
    StreamLoop(source, params).run();
    EXPECT_EQ(source.steps, kSteps);
    EXPECT_EQ(rounds, 2 * kSteps + 1);
}

/// A second signal while files are closed must not end the program: the outer guard still has its handlers.
TEST(StreamLoop, ASignalEndsTheRunAndStaysSeen) {
    const InterruptGuard outer;
    Steps source;
    LoopParams params;
    params.each_step = [](Source&) { std::raise(SIGINT); };
    StreamLoop loop(source, params);
    loop.run();
    EXPECT_EQ(source.steps, 1);
    EXPECT_TRUE(loop.interrupted());
    EXPECT_TRUE(outer.interrupted());
    std::raise(SIGTERM);
    EXPECT_THROW(run_to_end(source, [] {}), Interrupted);
}

/// A live source has its own pace: waiting for it would lose its data.
TEST(StreamLoop, NeverWaitsForALiveSource) {
    LoopParams params;
    params.realtime = true;
    int steps_in_one_wait = 0;
    Steps live(true);
    StreamLoop loop(live, params);
    while (loop.step(Microseconds{0})) {
        ++steps_in_one_wait;
    }
    EXPECT_EQ(steps_in_one_wait, kSteps) << "each call is a step";
}

TEST(StreamLoop, HealthHasTheQueuesOfTheOutputs) {
    Steps source;
    LoopParams params;
    params.add_outputs = [](HealthCounts& counts) { counts.queued_bytes = 7; };
    int reports = 0;
    params.each_health = [&](const LinkHealth& health) {
        ++reports;
        EXPECT_EQ(health.counts.queued_bytes, 7U);
    };
    StreamLoop loop(source, params);
    loop.run();
    EXPECT_GE(reports, 1);
    EXPECT_EQ(loop.health().counts.lost, static_cast<std::uint64_t>(kSteps));
}

}  // namespace
}  // namespace tricoil::host
