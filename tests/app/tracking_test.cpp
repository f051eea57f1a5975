// The board tracks from power-on: poses of the simulated hand on every link.
#include <gtest/gtest.h>

#include "core/protocol/convert.hpp"
#include "tests/app/device_bench.hpp"

namespace tricoil {
namespace {

using protocol::AckResult;
using protocol::DeviceState;
using protocol::Opcode;
using test::DeviceBench;

TEST(Board, PassesItsSelfCheckAndWaitsWithCoilsOff) {
    DeviceBench board;
    board.run(0.5);
    EXPECT_EQ(board.device->state(), DeviceState::idle);
    EXPECT_EQ(board.device->faults().bits(), 0);
    EXPECT_TRUE(board.device->report().passed());
    EXPECT_EQ(board.coils.changes(), 0U);
    EXPECT_TRUE(board.watchdog.is_started());
    EXPECT_GT(board.indicator.changes(), 0U);
}

TEST(Board, IdentifiesItself) {
    DeviceBench board;
    board.run(0.01);
    board.host().hello();
    board.run(0.3);
    ASSERT_EQ(board.host().identities.size(), 1U);
    const protocol::IdentifyMessage& m = board.host().identities[0];
    EXPECT_EQ(m.serial, 42U);
    EXPECT_EQ(m.role, 2);
    EXPECT_EQ(m.frame_rate_millihertz, 240'000U);
    EXPECT_EQ(m.window_us, 1111U);
    EXPECT_EQ(m.drives_coils, 1);
    EXPECT_GE(board.host().statuses.size(), 2U);
    EXPECT_TRUE(board.host(1).statuses.empty()) << "a link without hello must stay silent";
}

/// Poses of the main loop alone on the same samples.
std::vector<protocol::PoseMessage> poses_of_the_loop(double begin_s, std::size_t count) {
    DeviceBench board;  // only its world is used
    const app::DeviceParams device = board.params();
    std::vector<protocol::PoseMessage> poses;
    sim::SimulatedLink<float> link([&](const auto& estimate) { poses.push_back(protocol::to_message(estimate)); });
    app::MainLoopParams<float> params;
    params.plan = device.modes[0].plan;
    params.demodulator = device.demodulator;
    params.tracker.method = tracking::ScaatParams<float>{};
    params.tracker.common.coupling_constant = device.coupling_constant_m3;
    params.tracker.common.hemisphere = device.hemisphere;
    tracking::set_plan(params.tracker.common, params.plan);
    app::BoardLoop loop(params, {board.clock, board.coils, board.sampler, link});
    board.clock.pause(begin_s);
    EXPECT_TRUE(loop.start().ok());
    while (poses.size() < count) {
        EXPECT_TRUE(loop.step().ok());
    }
    return poses;
}

TEST(Board, PosesOnAllLinksEqualThoseOfTheMainLoop) {
    DeviceBench board({.measures_supply = false});
    double begun_s = 0;
    board.tampered.started = [&] {
        begun_s = board.clock.elapsed_s();
        return Status{};
    };
    board.track(DeviceBench::kLinks);
    board.run(2);
    const auto& poses = board.host(0).poses;
    ASSERT_GT(poses.size(), 1400U);
    const auto expected = poses_of_the_loop(begun_s, poses.size());
    for (std::size_t k = 0; k < poses.size(); ++k) {
        for (std::size_t n = 0; n < DeviceBench::kLinks; ++n) {
            const protocol::PoseMessage& got = board.host(n).poses[k];
            ASSERT_EQ(got.sequence, expected[k].sequence) << "link " << n;
            ASSERT_EQ(got.time_us, expected[k].time_us);
            ASSERT_EQ(got.flags, expected[k].flags);
            ASSERT_EQ(got.position, expected[k].position);
            ASSERT_EQ(got.quaternion, expected[k].quaternion);
            ASSERT_EQ(got.deviation, expected[k].deviation);
        }
    }
    EXPECT_FALSE(board.watchdog.has_expired());
    EXPECT_GT(board.heartbeat.beats(), 1400U);
}

TEST(Board, FollowsTheHandWithinMillimetres) {
    DeviceBench board;
    board.track();
    board.run(2);
    double worst_m = 0;
    std::size_t valid = 0;
    for (const protocol::PoseMessage& m : board.host().poses) {
        tracking::PoseEstimate<double> e;
        ASSERT_EQ(protocol::from_message(m, e), protocol::WireError::none);
        if (e.valid() && to_seconds(e.time) > 0.5) {
            ++valid;
            worst_m = std::max(worst_m, (e.position_m - board.scenario.motion->at(to_seconds(e.time)).position_m).norm());
        }
    }
    EXPECT_GT(valid, 1000U);
    EXPECT_LT(worst_m, 3e-3);
}

TEST(Board, KeepsSendingFlaggedPosesWithoutASensor) {
    DeviceBench board({.scenario = "unplugged"});
    board.track();
    const std::size_t first = board.host().poses.size();
    for (int tenth = 0; tenth < 100; ++tenth) {
        const std::size_t before = board.host().poses.size();
        board.run(0.1);
        ASSERT_GT(board.host().poses.size(), before) << "the board must keep sending, at " << 0.1 * tenth << " s";
    }
    std::size_t invalid = 0;
    for (std::size_t k = first; k < board.host().poses.size(); ++k) {
        invalid += (board.host().poses[k].flags & 0x3FFU) != 0 ? 1U : 0U;
    }
    EXPECT_GT(invalid, 300U);
}

TEST(Board, SendsColumnsToAHostThatTracks) {
    DeviceBench board;
    board.run(0.01);
    board.host().hello();
    EXPECT_EQ(board.ask(Opcode::mode, protocol::mode_argument({0, signal::Multiplexing::fdm, true})), AckResult::done);
    EXPECT_EQ(board.host().acks.back().argument, 240'000U);
    board.host().hello();
    board.host().start();
    board.fed_hosts[0] = true;
    board.run(0.5);
    const auto& host = board.host();
    EXPECT_EQ(host.identities.back().role, 1);
    EXPECT_EQ(host.identities.back().multiplexing, 1);
    EXPECT_TRUE(host.poses.empty());
    ASSERT_GT(host.columns.size(), 300U);
    for (std::size_t k = 0; k < host.columns.size(); ++k) {
        EXPECT_EQ(host.columns[k].sequence, k);
        EXPECT_EQ(host.columns[k].state, 1 + k % 3);
    }
}

TEST(Board, SendsColumnsOfBothBandsAndTracksTheHighOne) {
    DeviceBench board({.scenario = "still", .measures_supply = false});
    board.run(0.01);
    board.host().hello();
    for (const bool columns : {true, false}) {
        ASSERT_EQ(board.ask(Opcode::mode, protocol::mode_argument({0, signal::Multiplexing::dual_band, columns})),
                  AckResult::done);
        board.host().hello();
        board.host().start();
        board.fed_hosts[0] = true;
        board.run(0.5);
        EXPECT_EQ(board.host().identities.back().multiplexing, 2);
        EXPECT_EQ(board.ask(Opcode::stop), AckResult::done);
    }
    const auto& host = board.host();
    ASSERT_GT(host.columns.size(), 600U);
    for (std::size_t k = 0; k < host.columns.size(); ++k) {
        EXPECT_EQ(host.columns[k].state, 1 + k % 3);
        const bool is_low = (host.columns[k].flags & 1U << static_cast<unsigned>(ColumnFlag::low_band)) != 0;
        EXPECT_EQ(is_low, k % 6 >= 3);
    }
    // Mains hum in the low band is zero in the mean over whole cycles.
    const std::size_t frames = host.columns.size() / 6 / 24 * 24;
    for (std::size_t j = 0; j < 3; ++j) {
        for (std::size_t i = 0; i < 3; ++i) {
            double difference = 0;
            double sigma = 0;
            for (std::size_t n = 0; n < frames; ++n) {
                const protocol::ColumnMessage& high = host.columns[6 * n + j];
                const protocol::ColumnMessage& low = host.columns[6 * n + j + 3];
                difference += static_cast<double>(low.in_phase[i] - high.in_phase[i]) / static_cast<double>(frames);
                sigma += static_cast<double>(low.sigma[i]) / std::pow(static_cast<double>(frames), 1.5);
            }
            EXPECT_NEAR(difference, 0, 6 * sigma) << "sensor coil " << i << ", source coil " << j;
        }
    }
    ASSERT_GT(host.poses.size(), 100U);
    for (std::size_t k = 24; k < host.poses.size(); ++k) {
        EXPECT_EQ(host.poses[k].flags, 0) << k;
    }
}

TEST(Board, ContinuesForOtherHostsWhenOneStops) {
    DeviceBench board;
    board.track(2);
    board.run(0.1);
    EXPECT_EQ(board.ask(Opcode::stop, 0, Excitation::off, 1), AckResult::done);
    board.fed_hosts[1] = false;
    const std::size_t of_first = board.host(0).poses.size();
    const std::size_t of_second = board.host(1).poses.size();
    board.run(0.1);
    EXPECT_GT(board.host(0).poses.size(), of_first + 60);
    EXPECT_EQ(board.host(1).poses.size(), of_second);
    EXPECT_EQ(board.ask(Opcode::stop), AckResult::done);
    EXPECT_EQ(board.device->state(), DeviceState::idle);
    EXPECT_EQ(board.coils.state(), Excitation::off);
    EXPECT_EQ(board.device->faults().bits(), 0);
}

TEST(Board, BoresightZeroesThePresentAttitude) {
    DeviceBench board({.scenario = "still"});
    board.track();
    board.run(0.3);
    ASSERT_EQ(board.ask(Opcode::boresight, 1), AckResult::done);
    board.run(0.05);
    const auto& ahead = board.host().poses.back();
    EXPECT_NEAR(ahead.quaternion[0] / 8e6, 1, 1e-6);
    ASSERT_EQ(board.ask(Opcode::boresight, 0), AckResult::done);
    board.run(0.05);
    const Quat<double> truth = board.scenario.motion->at(0).q_source_sensor;
    EXPECT_NEAR(std::abs(board.host().poses.back().quaternion[0] / 8e6), std::abs(truth.w()), 1e-3);
    EXPECT_LT(std::abs(truth.w()), 0.999) << "the scenario's sensor must not point straight ahead";
}

TEST(Board, UsesTheCommandedHemisphere) {
    DeviceBench board({.scenario = "still"});
    board.track();
    board.run(0.2);
    const auto before = board.host().poses.back().position;
    const Vec3<float> behind = -board.scenario.motion->at(0).position_m.cast<float>();
    ASSERT_EQ(board.ask(Opcode::hemisphere, protocol::hemisphere_argument({0, behind})), AckResult::done);
    board.run(0.3);
    const auto after = board.host().poses.back().position;
    for (std::size_t i = 0; i < 3; ++i) {
        EXPECT_NEAR(after[i], -before[i], 2e4);
    }
    ASSERT_EQ(board.ask(Opcode::stop), AckResult::done);
    ASSERT_EQ(board.ask(Opcode::start), AckResult::done);
    board.run(0.2);
    const auto next = board.host().poses.back().position;
    for (std::size_t i = 0; i < 3; ++i) {
        EXPECT_NEAR(next[i], before[i], 2e4) << "stop must reset the hemisphere to the board's own";
    }
}

TEST(Board, SendsARawBlockInParts) {
    DeviceBench board;
    board.run(0.01);
    board.host().hello();
    board.ask(Opcode::read_block, 0, Excitation::s2);
    board.run(0.05);
    const auto& parts = board.host().parts;
    EXPECT_EQ(board.host().samples, 200U);
    ASSERT_FALSE(parts.empty());
    EXPECT_EQ(parts.front().total, 200);
    EXPECT_EQ(parts.front().state, 2);
    EXPECT_EQ(parts.front().sample_rate_millihertz, 144'000'000U);
    EXPECT_EQ(board.coils.state(), Excitation::off);
}

TEST(Board, RunsItsSelfCheckOnCommand) {
    DeviceBench board;
    board.run(0.01);
    board.host().hello();
    board.ask(Opcode::self_check);
    board.run(0.05);
    const auto& rows = board.host().checks;
    ASSERT_EQ(rows.size(), board.device->report().checks().size());
    EXPECT_GT(rows.size(), 10U);
    for (std::size_t n = 0; n < rows.size(); ++n) {
        EXPECT_EQ(rows[n].index, n);
        EXPECT_EQ(rows[n].count, rows.size());
        EXPECT_NE(rows[n].outcome, 1);
        EXPECT_NE(rows[n].precision, 2) << "the board has no double precision";
    }
}

TEST(Board, AcknowledgesTheLoaderCommandBeforeTheRestart) {
    DeviceBench board;
    board.run(0.01);
    board.host().hello();
    board.press_button();
    EXPECT_EQ(board.ask(Opcode::loader, protocol::kLoaderKey), AckResult::done);
    EXPECT_EQ(board.system.loader_restarts(), 0);
    EXPECT_EQ(board.ask(Opcode::start), AckResult::wrong_state);
    board.run(0.1);
    EXPECT_EQ(board.system.loader_restarts(), 1);
}

}  // namespace
}  // namespace tricoil
