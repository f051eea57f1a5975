#include "core/protocol/convert.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/support/random_poses.hpp"

namespace tricoil::protocol {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

tracking::PoseEstimate<double> some_pose(std::mt19937_64& random) {
    std::uniform_real_distribution<> uniform(-1, 1);
    tracking::PoseEstimate<double> e;
    e.sequence = static_cast<std::uint32_t>(random());
    e.time = device_time_us(static_cast<std::int64_t>(random() >> 20U));
    e.state = tracking::TrackerState::tracking;
    e.flags.set(tracking::PoseFlag::distorted);
    e.position_m << 2 * uniform(random), 2 * uniform(random), 2 * uniform(random);
    e.q_source_sensor = Quat<double>(uniform(random), uniform(random), uniform(random), uniform(random)).normalized();
    e.covariance.diagonal() << 1e-8, 4e-8, 9e-8, 1e-10, 4e-10, 9e-10;
    e.distortion_m = 3.25e-3;
    e.snr_db = 61.5;
    return e;
}

TEST(Convert, APoseKeepsATenthOfAMicrometre) {
    std::mt19937_64 random(1);
    for (int i = 0; i < 1000; ++i) {
        const auto sent = some_pose(random);
        const PoseMessage m = to_message(sent);
        tracking::PoseEstimate<double> received;
        ASSERT_EQ(from_message(m, received), WireError::none);
        EXPECT_LE((received.position_m - sent.position_m).cwiseAbs().maxCoeff(), 0.51e-7);
        EXPECT_LE((received.q_source_sensor.coeffs() - sent.q_source_sensor.coeffs()).cwiseAbs().maxCoeff(), 0.63e-7);
        EXPECT_EQ(received.flags, sent.flags);
        EXPECT_EQ(received.state, sent.state);
        EXPECT_EQ(received.time, sent.time);
        EXPECT_NEAR(std::sqrt(received.covariance(1, 1)), 2e-4, 1e-7);
        EXPECT_NEAR(received.snr_db, sent.snr_db, 5e-3);
        EXPECT_NEAR(received.distortion_m, sent.distortion_m, 5e-6);
        const PoseMessage again = to_message(received);
        EXPECT_EQ(again.position, m.position);
        EXPECT_EQ(again.quaternion, m.quaternion);
        EXPECT_EQ(again.deviation, m.deviation);
    }
}

TEST(Convert, NaNMakesAPoseInvalid) {
    std::mt19937_64 random(2);
    auto e = some_pose(random);
    e.position_m.x() = kNaN;
    e.covariance(0, 0) = kNaN;
    tracking::PoseEstimate<double> received;
    ASSERT_EQ(from_message(to_message(e), received), WireError::none);
    EXPECT_FALSE(received.valid());
    EXPECT_TRUE(std::isnan(received.position_m.x()) && std::isinf(received.covariance(5, 5)));
    EXPECT_TRUE(received.flags.has(tracking::PoseFlag::not_converged));
}

TEST(Convert, APoseWithoutASensorHasNoNumbersOnTheOtherSide) {
    std::mt19937_64 random(2);
    auto e = some_pose(random);
    e.flags = {tracking::PoseFlag::no_sensor};
    tracking::PoseEstimate<double> received;
    ASSERT_EQ(from_message(to_message(e), received), WireError::none);
    EXPECT_TRUE(received.flags == e.flags);
    EXPECT_TRUE(std::isnan(received.position_m.y()) && std::isinf(received.covariance(0, 0)) && std::isnan(received.snr_db));
}

TEST(Convert, ValuesOutOfRangeSaturate) {
    std::mt19937_64 random(3);
    auto e = some_pose(random);
    e.position_m << 1e9, -1e9, 0;
    e.covariance(0, 0) = 1e12;
    e.distortion_m = 1e12;
    e.snr_db = -1e9;
    const PoseMessage m = to_message(e);
    EXPECT_EQ(m.position[0], 1'000'000'000);
    EXPECT_EQ(m.position[1], -1'000'000'000);
    EXPECT_EQ(m.deviation[0], 0xFFFFFFU);
    EXPECT_EQ(m.distortion, 0xFFFF);
    EXPECT_EQ(m.snr_cdb, -32768);
}

TEST(Convert, AnInvalidQuaternionIsRefused) {
    PoseMessage m;
    m.quaternion = {0, 0, 0, 0};
    tracking::PoseEstimate<double> e;
    EXPECT_EQ(from_message(m, e), WireError::impossible);
    m.quaternion = {8'000'000, 8'000'000, 0, 0};
    EXPECT_EQ(from_message(m, e), WireError::impossible);
}

TEST(Convert, AColumnKeepsSinglePrecisionTransitionsAndLevels) {
    MeasuredColumn<double> c;
    c.sensor = 2;
    c.state = Excitation::s3;
    c.state_sequence = 77;
    c.midpoint = device_time_us(123456789);
    c.in_phase << 0.125, -1.0 / 3, 1e-7;
    c.quadrature << 1e-3, 0, -1e-3;
    c.sigma.setConstant(1e-5);
    c.flags.set(ColumnFlag::clipped);
    c.gain_step = 11;
    c.level = {0, 1, 65535};
    MeasuredColumn<double> received;
    ASSERT_EQ(from_message(to_message(c, 9), received), WireError::none);
    EXPECT_EQ(received.in_phase, c.in_phase.cast<float>().cast<double>());
    EXPECT_EQ(received.state, c.state);
    EXPECT_EQ(received.state_sequence, 77U);
    EXPECT_EQ(received.sequence, 9U);
    EXPECT_EQ(received.flags, c.flags);
    EXPECT_EQ(received.gain_step, 11);
    EXPECT_EQ(received.level, c.level);
    EXPECT_EQ(from_message(to_message(c, 9, true), received), WireError::transition);
    ColumnMessage m = to_message(c, 9);
    m.flags |= kUnusedFlag;
    EXPECT_EQ(from_message(m, received), WireError::impossible);
    m = to_message(c, 9);
    m.flags |= 12U << kGainStepBit;
    EXPECT_EQ(from_message(m, received), WireError::impossible);
    c.in_phase.x() = kNaN;
    ASSERT_EQ(from_message(to_message(c, 9), received), WireError::none);
    EXPECT_TRUE(received.flags.has(ColumnFlag::no_reference));
}

}  // namespace
}  // namespace tricoil::protocol
