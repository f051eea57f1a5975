// DeviceLoop with a tracker board: tool tips, and the hemisphere before each start.
#include "tests/device/scripted_loop.hpp"

namespace tricoil::linux_board {
namespace {

/// A tracker board, which sends poses.
class LoopOfBoard : public Loop {
protected:
    explicit LoopOfBoard(bool confined = false, const host::ToolTips& tips = {}) {
        params.tips = tips;
        port.role = protocol::Role::tracker;
        params.session.host_drives_coils = false;
        params.session.hemisphere = Vec3<double>(0, 1e100, 0);  // beyond single precision
        params.session.confined = confined;
        loop.emplace(port, HostLines{nullptr, nullptr, nullptr}, params, tap,
                     [this](const tracking::PoseEstimate<double>& pose) { delivered_ = pose; });
    }
    void SetUp() override {
        for (int n = 0; n < 5 && loop->session().phase() != Phase::running; ++n) {
            loop->step();
        }
        ASSERT_EQ(loop->session().phase(), Phase::running);
    }
    void pose(double y_m, bool is_known) {
        tracking::PoseEstimate<double> estimate;
        estimate.position_m = {0, y_m, 0};
        estimate.flags.set_if(!is_known, tracking::PoseFlag::hemisphere_unknown);
        protocol::PoseMessage message = protocol::to_message(estimate);
        message.sequence = next++;
        message.time_us = 1000 * next;
        port.say(message);
        loop->step();
    }
    tracking::PoseEstimate<double> delivered_;
};

class LoopOfBoardWithTip : public LoopOfBoard {
protected:
    LoopOfBoardWithTip() : LoopOfBoard(false, tip_of_sensor_0()) {}
};

TEST_F(LoopOfBoardWithTip, DeliversThePosesOfTheTip) {
    pose(0.4, true);
    EXPECT_NEAR(delivered_.position_m(0), 0.1, 1e-6);
    EXPECT_NEAR(delivered_.position_m(1), 0.4, 1e-6);
    EXPECT_EQ(delivered_.sequence, loop->session().pose().sequence);
    EXPECT_EQ(delivered_.time, loop->session().pose().time);
}

class ConfinedLoopOfBoard : public LoopOfBoard {
protected:
    ConfinedLoopOfBoard() : LoopOfBoard(true) {}
};

const Vec3<float> kPlusY(0, 127, 0);

TEST_F(LoopOfBoard, SendsTheHemisphereBeforeTheFirstStartAndUnknownBeforeTheNext) {
    EXPECT_EQ(port.hemispheres, std::vector{kPlusY});
    EXPECT_EQ(port.hemispheres_at_start, 1U);
    pose(0.4, true);
    lose_link(600);
    pose(0.4, false);
    EXPECT_EQ(port.hemispheres, (std::vector<Vec3<float>>{kPlusY, Vec3<float>::Zero()})) << "the sensor may be anywhere";
    EXPECT_EQ(port.hemispheres_at_start, 2U);
    loop->set_hemisphere(0, {0, std::nan(""), 0});
    loop->set_hemisphere(1, {0, 1, 0});
    EXPECT_EQ(port.hemispheres.size(), 2U) << "NaN and the hemisphere of sensor 1 must not be sent";
    loop->set_hemisphere(0, {0, 1, 0});
    EXPECT_EQ(port.hemispheres.back(), kPlusY);
}

TEST_F(LoopOfBoard, RestoresTheHemisphereAfterAShortLoss) {
    pose(-2, true);
    lose_link(0);
    pose(2, false);
    pose(2, false);  // sent before the command arrived
    EXPECT_EQ(port.hemispheres, (std::vector<Vec3<float>>{kPlusY, Vec3<float>::Zero(), -kPlusY}));
    EXPECT_EQ(loop->counters().hemispheres_restored, 1U);
}

TEST_F(ConfinedLoopOfBoard, SendsTheHemisphereAfterEveryLoss) {
    pose(0.4, true);
    lose_link(600);
    EXPECT_EQ(port.hemispheres, (std::vector{kPlusY, kPlusY}));
    pose(0.4, false);
    EXPECT_EQ(port.hemispheres.back(), kPlusY);
    EXPECT_EQ(port.hemispheres.size(), 3U);
}

TEST(HemisphereRestorer, RestoresOnlyIfTheSensorCannotHaveCrossed) {
    tracking::PoseEstimate<double> pose;
    pose.position_m = {0.5, 0, 0};
    tracking::PoseEstimate<double> lost = pose;
    lost.position_m = -pose.position_m;  // the mirror image
    lost.flags.set(tracking::PoseFlag::hemisphere_unknown);
    HemisphereRestorer restorer;
    EXPECT_FALSE(restorer.side(lost, host_time_us(1))) << "the hemisphere was never known";
    EXPECT_FALSE(restorer.side(pose, host_time_us(1'000'000)));
    const auto side = restorer.side(lost, host_time_us(1'100'000));
    ASSERT_TRUE(side);
    EXPECT_GT(side->x(), 0);
    EXPECT_FALSE(restorer.side(lost, host_time_us(1'500'000))) << "in half a second the sensor can reach its mirror image";
    lost.flags.set(tracking::PoseFlag::low_signal);
    EXPECT_FALSE(restorer.side(lost, host_time_us(1'100'000)));
}

}  // namespace
}  // namespace tricoil::linux_board
