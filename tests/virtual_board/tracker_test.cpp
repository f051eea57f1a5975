// The image that is flashed: boots, checks itself, tracks the simulated hand over all three links, the same in every run.
#include <gmock/gmock.h>

#include "core/protocol/convert.hpp"
#include "tests/virtual_board/board_bench.hpp"

namespace tricoil {
namespace {

using protocol::AckResult;
using protocol::Opcode;
using test::BoardBench;

double position_error_mm(const sim::Scenario& scenario, const protocol::PoseMessage& pose, double offset_s) {
    tracking::PoseEstimate<double> estimate;
    EXPECT_EQ(protocol::from_message(pose, estimate), protocol::WireError::none);
    const auto truth = scenario.motion->at(1e-6 * static_cast<double>(pose.time_us) + offset_s);
    return 1e3 * (estimate.position_m - truth.position_m).norm();
}

TEST(Tracker, BootsAndSaysWhoItIsOnEveryLink) {
    BoardBench bench;
    bench.run(BoardBench::kBootS);
    for (std::size_t link = 0; link < test::kLinkNumbers; ++link) {
        bench.host(link).hello();
    }
    bench.run(0.1);
    for (std::size_t link = 0; link < test::kLinkNumbers; ++link) {
        ASSERT_EQ(bench.host(link).identities.size(), 1U) << "link " << link;
        EXPECT_EQ(bench.host(link).identities[0].role, static_cast<std::uint8_t>(protocol::Role::tracker));
    }
    EXPECT_FALSE(bench.board->bench.any_driven());
}

TEST(Tracker, PassesItsSelfCheck) {
    BoardBench bench;
    bench.run(BoardBench::kBootS);
    bench.host().hello();
    bench.run(0.05);
    EXPECT_EQ(bench.ask(test::on_serial, Opcode::self_check), AckResult::done);
    bench.run(0.5);
    ASSERT_GT(bench.host().checks.size(), 5U);
    for (const auto& check : bench.host().checks) {
        EXPECT_EQ(check.outcome, 1) << "check " << check.id;
    }
    EXPECT_EQ(bench.status().faults & static_cast<unsigned>(protocol::Fault::self_check), 0U);
}

TEST(Tracker, TracksTheHandOnAllLinks) {
    BoardBench bench;
    bench.start({test::on_serial, test::on_can, test::on_usb});
    bench.run(2);
    const auto& poses = bench.host(test::on_serial).poses;
    std::printf("%zu poses, CAN %zu, USB %zu\n", poses.size(), bench.host(test::on_can).poses.size(), bench.host(test::on_usb).poses.size());
    for (std::size_t n = 0; n < poses.size(); n += 100) {
        std::printf("%u %.6f %g %g %g flags %x err %.2f mm\n", poses[n].sequence, 1e-6 * poses[n].time_us, 1e-6*poses[n].position[0], 1e-6*poses[n].position[1], 1e-6*poses[n].position[2], poses[n].flags, position_error_mm(bench.scenario, poses[n], 0));
    }
    auto s = bench.status();
    std::printf("state %u faults %x\n", s.device_state, s.faults);
}

}  // namespace
}  // namespace tricoil
