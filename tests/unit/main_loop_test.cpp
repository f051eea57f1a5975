#include "board/app/main_loop.hpp"
#include "board/support/sim_input/fault_text.hpp"

#include <gtest/gtest.h>

#include <memory>

#include "sim/hal/simulated_hal.hpp"
#include "sim/motion/simple_motions.hpp"

namespace tricoil::app {
namespace {

using sim::SimulatedCoilDriver;

/// A coil driver that fails on command. No coil may stay on after a failure.
class FailingCoilDriver final : public hal::CoilDriver {
public:
    void fail_after(int calls) { calls_left_ = calls; }
    [[nodiscard]] Excitation state() const { return state_; }

private:
    Status do_excite(Excitation state) override {
        state_ = state;  // an incomplete switch, which the interface must undo
        return calls_left_-- > 0 ? Status{} : Status{StatusCode::device_lost, "gone"};
    }
    void do_switch_off() override { state_ = Excitation::off; }
    Excitation state_ = Excitation::s1;
    int calls_left_ = 1'000'000;
};

/// Sampler that returns a given status.
class ScriptedSampler final : public hal::CoilSampler {
public:
    Status start_status;
    Status poll_status;
    SampleBlock next;

private:
    Status do_start(const signal::AcquisitionPlan&) override { return start_status; }
    Status do_poll(SampleBlock& block) override {
        block = next;
        return poll_status;
    }
    void do_stop() override {}
};

class MainLoopTest : public ::testing::Test {
protected:
    MainLoopParams<double> params(signal::Multiplexing multiplexing, const sim::CoilWorld& world) {
        const auto plan = *signal::plan_acquisition(signal::default_acquisition(multiplexing, 240));
        MainLoopParams<double> p{plan, world.demodulation(), {}};
        p.tracker.common.coupling_constant = world.params().coupling_constant_m3;
        p.tracker.common.max_column_span = tracking::column_span(plan);
        return p;
    }

    void run(const std::string& fault, signal::Multiplexing multiplexing, double duration_s) {
        const sim::StillMotion motion({{0.5, 0.1, 0.2}, Quat<double>::Identity()});
        std::vector<sim::Fault> faults;
        if (!fault.empty()) {
            faults.push_back(host::parse_fault(fault));
        }
        sim::CoilWorld world({}, motion, faults);
        world.configure(*signal::plan_acquisition(signal::default_acquisition(multiplexing, 240)));
        sim::SimulatedClock clock;
        sim::SimulatedCoilSampler sampler(world, coils_, clock, duration_s);
        sim::SimulatedLink<double> link([&](const auto& estimate) {
            estimates_.push_back(estimate);
            worst_m_ =
                estimate.valid() ? std::max(worst_m_, (estimate.position_m - Vec3<double>(0.5, 0.1, 0.2)).norm()) : worst_m_;
        });
        MainLoop<double> loop(params(multiplexing, world), {clock, coils_, sampler, link});
        ASSERT_TRUE(loop.start().ok());
        Status status;
        while ((status = loop.step()).code() != StatusCode::end_of_stream) {
            ASSERT_TRUE(status.ok() || status.code() == StatusCode::timed_out) << status.message();
        }
        counters_ = loop.counters();
        EXPECT_EQ(coils_.state(), Excitation::off);
    }

    SimulatedCoilDriver coils_;
    std::vector<tracking::PoseEstimate<double>> estimates_;
    MainLoopCounters counters_;
    double worst_m_ = 0;
};

TEST_F(MainLoopTest, TracksInBothMultiplexingSchemes) {
    for (const auto multiplexing : {signal::Multiplexing::tdm, signal::Multiplexing::fdm}) {
        estimates_.clear();
        run("", multiplexing, 0.5);
        EXPECT_GT(estimates_.size(), 100U);
        EXPECT_TRUE(estimates_.back().valid());
        EXPECT_LT(worst_m_, 1e-3);
        EXPECT_EQ(counters_.lost_blocks, 0U);
    }
}

TEST_F(MainLoopTest, CountsLostBlocksAndContinues) {
    run("dropped_blocks:0.2", signal::Multiplexing::tdm, 1);
    EXPECT_GT(counters_.lost_blocks, 100U);
    EXPECT_LT(counters_.lost_blocks, 190U);
    EXPECT_EQ(counters_.lost_blocks + counters_.blocks, 720U);
    EXPECT_LT(worst_m_, 1e-3);
}

TEST_F(MainLoopTest, PosesAfterALostBlockAreFlagged) {
    for (const auto multiplexing : {signal::Multiplexing::tdm, signal::Multiplexing::fdm}) {
        estimates_.clear();
        run("dropped_blocks:1@0.5-0.504", multiplexing, 0.6);
        EXPECT_GE(counters_.lost_blocks, 1U);
        std::size_t flagged = 0;
        for (const auto& estimate : estimates_) {
            const bool is_after = to_seconds(estimate.time) > 0.5 && to_seconds(estimate.time) < 0.515;
            const bool is_missing = estimate.flags.has(tracking::PoseFlag::columns_missing);
            EXPECT_TRUE(is_after || !is_missing) << to_seconds(estimate.time);
            flagged += is_missing ? 1 : 0;
        }
        EXPECT_EQ(flagged, multiplexing == signal::Multiplexing::tdm ? 4U : 2U) << "the first pose needs three columns";
    }
}

/// Refused columns count as missing: the loop calls tick(), and the tracker reports coasting, stale, lost.
TEST_F(MainLoopTest, RefusedColumnsDoNotSilenceTheTracker) {
    const sim::StillMotion motion({{0.5, 0.1, 0.2}, Quat<double>::Identity()});
    sim::CoilWorld world({}, motion, {});
    world.configure(*signal::plan_acquisition(signal::default_acquisition(signal::Multiplexing::fdm, 240)));
    sim::SimulatedClock clock;
    sim::SimulatedCoilSampler sampler(world, coils_, clock, 1);
    std::vector<tracking::PoseEstimate<double>> sent;
    sim::SimulatedLink<double> link([&](const auto& estimate) { sent.push_back(estimate); });
    auto p = params(signal::Multiplexing::fdm, world);
    p.tracker.method = tracking::ScaatParams<double>{};
    p.tracker.common.window_s = p.plan.window_s();
    MainLoop<double> loop(p, {clock, coils_, sampler, link});
    ASSERT_TRUE(loop.start().ok());
    for (int block = 0; block < 100; ++block) {
        ASSERT_TRUE(loop.step().ok());
    }
    ASSERT_TRUE(sent.back().valid());
    // Columns with future stamps: every later column is too old until the tracker detects a clock restart.
    Column<double> stray;
    stray.midpoint = clock.now() + Microseconds{90'000};
    stray.in_phase.setConstant(1e-3);
    stray.sigma.setConstant(1e-6);
    for (int j = 0; j < kSourceCoils; ++j) {
        stray.state = single_coil(j);
        (void)loop.tracker().update(stray);
    }
    const std::size_t before = sent.size();
    for (int block = 0; block < 6; ++block) {
        ASSERT_TRUE(loop.step().ok());
    }
    EXPECT_EQ(sent.size(), before + 6);
    EXPECT_FALSE(sent.back().valid());
}

TEST_F(MainLoopTest, ASilentSamplerMakesTheLastPoseStale) {
    run("dropped_blocks:1@0.5-1", signal::Multiplexing::fdm, 0.9);
    EXPECT_TRUE(estimates_.back().flags.has(tracking::PoseFlag::stale));
    EXPECT_EQ(estimates_.back().state, tracking::TrackerState::lost);
}

TEST_F(MainLoopTest, FaultsNeverGiveAWrongValidPose) {
    for (const char* fault :
         {"open_coil:S2", "reversed_coil:C1", "stuck_channel:C3", "stuck_channel:R", "unplugged", "overload:200"}) {
        for (const auto multiplexing : {signal::Multiplexing::tdm, signal::Multiplexing::fdm}) {
            worst_m_ = 0;
            estimates_.clear();
            run(fault, multiplexing, 0.3);
            ASSERT_FALSE(estimates_.empty()) << fault;
            EXPECT_FALSE(estimates_.back().valid()) << fault;
            EXPECT_EQ(worst_m_, 0) << fault;
        }
    }
}

class MainLoopErrors : public ::testing::Test {
protected:
    MainLoopErrors() {
        plan_ = *signal::plan_acquisition(signal::default_acquisition(signal::Multiplexing::tdm, 240));
        loop_ = std::make_unique<MainLoop<double>>(MainLoopParams<double>{plan_, {}, {}},
                                                   Devices<double>{clock_, coils_, sampler_, link_});
    }
    signal::AcquisitionPlan plan_;
    sim::SimulatedClock clock_;
    FailingCoilDriver coils_;
    ScriptedSampler sampler_;
    sim::SimulatedLink<double> link_{[](const auto&) {}};
    std::unique_ptr<MainLoop<double>> loop_;
};

TEST_F(MainLoopErrors, CoilsAreOffAtConstructionAndAfterDestruction) {
    EXPECT_EQ(coils_.state(), Excitation::off);
    EXPECT_TRUE(coils_.excite(Excitation::s3).ok());
    loop_.reset();
    EXPECT_EQ(coils_.state(), Excitation::off);
}

TEST_F(MainLoopErrors, CoilsAreOffWhenTheDriverFails) {
    coils_.fail_after(0);
    ASSERT_TRUE(loop_->start().ok());
    EXPECT_EQ(loop_->step().code(), StatusCode::device_lost);
    EXPECT_EQ(coils_.state(), Excitation::off);
}

TEST_F(MainLoopErrors, CoilsAreOffWhenTheSamplerFails) {
    sampler_.start_status = {StatusCode::device_lost, "gone"};
    EXPECT_EQ(loop_->start().code(), StatusCode::device_lost);
    sampler_.start_status = {};
    ASSERT_TRUE(loop_->start().ok());
    sampler_.poll_status = {StatusCode::device_lost, "gone"};
    EXPECT_EQ(loop_->step().code(), StatusCode::device_lost);
    EXPECT_EQ(coils_.state(), Excitation::off);
}

TEST_F(MainLoopErrors, RefusedBlocksAreCounted) {
    ASSERT_TRUE(loop_->start().ok());
    sampler_.next.state = Excitation::off;
    EXPECT_TRUE(loop_->step().ok());
    EXPECT_EQ(loop_->counters().refused_blocks, 1U);
    EXPECT_EQ(coils_.state(), Excitation::s1);
}

}  // namespace
}  // namespace tricoil::app
