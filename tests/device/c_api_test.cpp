// The C interface: refused arguments, and the status text of a connection.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <stdlib.h>

#include <array>
#include <cmath>
#include <memory>
#include <string>

#include "board/c_api/tricoil.h"
#include "core/linear/quaternion.hpp"
#include "core/solver/direct.hpp"
#include "drivers/posix/file_descriptor.hpp"
#include "drivers/posix/raw_terminal.hpp"

namespace tricoil {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

std::string refusal(const char* device) {
    std::array<char, 256> error{};
    EXPECT_EQ(tricoil_open(device, "direct", error.data(), error.size()), nullptr);
    return error.data();
}

TEST(CApi, RefusalsNameTheValidForms) {
    for (const char* source : {"nonsense", "", "hand"}) {
        EXPECT_THAT(refusal(source), HasSubstr("use can:INTERFACE, usb:VENDOR:PRODUCT, serial:PATH, columns:WHERE")) << source;
    }
    EXPECT_THAT(refusal(nullptr), HasSubstr("no source given"));
    EXPECT_THAT(refusal("usb:12345678"), HasSubstr("vendor number"));
    EXPECT_THAT(refusal("sim:hnd"), HasSubstr("did you mean 'hand'"));
    EXPECT_THAT(refusal("sim:hand,seed=-1"), HasSubstr("seed=-1: not a valid number"));
    EXPECT_THAT(refusal("sim:hand,mux=cdm"), HasSubstr("mux"));
    EXPECT_THAT(refusal("sim:hand,duration_s=inf"), HasSubstr("duration"));
    for (const char* tracker : {"scaat,predict_s=-1", "scaat,predict_s=", "scaat,predict_s=1x", "scaat,predict=1", "scaat,"}) {
        std::array<char, 256> error{};
        EXPECT_EQ(tricoil_open("sim:hand", tracker, error.data(), error.size()), nullptr) << tracker;
        EXPECT_THAT(error.data(), HasSubstr("only predict_s=SECONDS may follow")) << tracker;
    }
    for (const char* tracker : {"fixed-direct,predict_s=0.02", "fixed-previous,"}) {
        std::array<char, 256> error{};
        EXPECT_EQ(tricoil_open("sim:hand", tracker, error.data(), error.size()), nullptr) << tracker;
        EXPECT_THAT(error.data(), HasSubstr("use direct, previous or scaat")) << tracker;
    }
    EXPECT_THAT(refusal("can:can0,hemisphere=1/0"), HasSubstr("hemisphere must be a direction X/Y/Z"));
    EXPECT_THAT(refusal("recording:/nowhere"), HasSubstr("/nowhere"));
    EXPECT_EQ(tricoil_open("nonsense", nullptr, nullptr, 0), nullptr);
}

struct Close {
    void operator()(tricoil_tracker* tracker) const { tricoil_close(tracker); }
};
using Opened = std::unique_ptr<tricoil_tracker, Close>;

TEST(CApi, APoseWithoutASensorHasNoNumbers) {
    const Opened tracker(tricoil_open("sim:unplugged,duration_s=3", "direct", nullptr, 0));
    ASSERT_NE(tracker, nullptr);
    int without = 0;
    tricoil_pose pose{};
    while (tricoil_poll(tracker.get(), &pose, 1000) > 0) {
        if ((pose.flags & TRICOIL_FLAG_NO_SENSOR) != 0) {
            ++without;
            ASSERT_TRUE(std::isnan(pose.position_m[0]) && std::isinf(pose.position_std_m[2]) &&
                        std::isinf(pose.rotation_std_rad[1]));
            ASSERT_EQ(pose.valid, 0);
        } else {
            ASSERT_TRUE(std::isfinite(pose.position_m[0]) || pose.valid == 0);
        }
    }
    EXPECT_GT(without, 100);
}

TEST(CApi, PosesOfASimulationUntilItsEnd) {
    const Opened tracker(tricoil_open("sim:hand,duration_s=1", "scaat", nullptr, 0));
    ASSERT_NE(tracker, nullptr);
    EXPECT_STREQ(tricoil_status(tracker.get()), "running");
    tricoil_pose pose;
    int poses = 0;
    int result = 1;
    for (std::int64_t last_us = -1; (result = tricoil_poll(tracker.get(), &pose, 1000)) == 1; last_us = pose.time_us) {
        ++poses;
        EXPECT_GT(pose.time_us, last_us);
    }
    EXPECT_EQ(result, -3);
    EXPECT_GT(poses, 220);
    EXPECT_EQ(pose.valid, 1);
    EXPECT_STREQ(tricoil_status(tracker.get()), "the simulation has ended");
    EXPECT_EQ(tricoil_poll(tracker.get(), &pose, 1000), -3);
    for (std::size_t i = 0; i < 3; ++i) {
        EXPECT_NEAR(pose.covariance[i][i], std::pow(pose.position_std_m[i], 2), 1e-18);
        EXPECT_NEAR(pose.covariance[i + 3][i + 3], std::pow(pose.rotation_std_rad[i], 2), 1e-18);
        EXPECT_EQ(pose.covariance[i][5], pose.covariance[5][i]);
    }
}

// The direct solver on the couplings of a pose gives the pose. This fails if rows and columns are exchanged.
TEST(CApi, CouplingsAreThoseOfThePose) {
    const Opened tracker(tricoil_open("sim:circle,duration_s=1,noise=no", nullptr, nullptr, 0));
    ASSERT_NE(tracker, nullptr);
    tricoil_pose pose;
    while (tricoil_poll(tracker.get(), &pose, 1000) == 1) {
    }
    Mat3<double> x;
    for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) {
            x(i, j) = pose.couplings[i][j];
        }
    }
    const auto solution = solver::solve_direct<double>(x, 6.75e-3);
    ASSERT_TRUE(solution.ok());
    const double* const q = pose.quaternion_wxyz;
    EXPECT_NEAR((Quat<double>(q[0], q[1], q[2], q[3]).toRotationMatrix() - solution->attitude.transpose()).norm(), 0, 1e-9);
    EXPECT_NEAR(solution->direction.cross(Vec3<double>(pose.position_m)).norm(), 0, 1e-9);
}

/// Prediction by one frame, 4,167 us. The sensor moves by more than 2 mm in this time.
TEST(CApi, PredictedPosesAreThoseOfALaterTime) {
    const auto poses = [](const char* tracker) {
        const Opened opened(tricoil_open("sim:line,duration_s=1,noise=no", tracker, nullptr, 0));
        std::vector<tricoil_pose> all;
        for (tricoil_pose pose; tricoil_poll(opened.get(), &pose, 1000) == 1;) {
            all.push_back(pose);
        }
        return all;
    };
    const auto present = poses("scaat");
    const auto ahead = poses("scaat,predict_s=0.0041667");
    ASSERT_EQ(ahead.size(), present.size());
    double largest_step_m = 0;
    for (std::size_t n = 120; n + 1 < present.size(); ++n) {
        const auto at = [&](const tricoil_pose& pose) { return Vec3<double>(pose.position_m); };
        EXPECT_NEAR(static_cast<double>(ahead[n].time_us - present[n + 1].time_us), 0, 2);
        EXPECT_LT((at(ahead[n]) - at(present[n + 1])).norm(), 1e-4);
        largest_step_m = std::max(largest_step_m, (at(present[n + 1]) - at(present[n])).norm());
    }
    EXPECT_GT(largest_step_m, 2e-3);
}

TEST(CApi, HemisphereTipAndBoresight) {
    const Opened tracker(tricoil_open("sim:still,noise=no", nullptr, nullptr, 0));
    ASSERT_NE(tracker, nullptr);
    tricoil_pose first;
    EXPECT_EQ(tricoil_boresight(tracker.get(), 0), -1) << "no pose yet";
    do {
        ASSERT_EQ(tricoil_poll(tracker.get(), &first, 1000), 1);
    } while (first.valid == 0);
    const double tip[3]{0, 0.1, 0};
    EXPECT_EQ(tricoil_boresight(tracker.get(), 0), 0);
    EXPECT_EQ(tricoil_set_tip(tracker.get(), 0, tip), 0);
    tricoil_pose pose;
    ASSERT_EQ(tricoil_poll(tracker.get(), &pose, 1000), 1);
    EXPECT_NEAR(std::abs(pose.quaternion_wxyz[0]), 1, 1e-9);
    EXPECT_NEAR((Vec3<double>(pose.position_m) - Vec3<double>(first.position_m)).norm(), 0.1, 1e-6);

    const double opposite[3]{-first.position_m[0], -first.position_m[1], -first.position_m[2]};
    const double zero[3]{0, 0, 0};
    const double broken[3]{std::nan(""), 0, 0};
    EXPECT_EQ(tricoil_set_hemisphere(tracker.get(), 0, zero), -1);
    EXPECT_EQ(tricoil_set_hemisphere(tracker.get(), 0, broken), -1);
    EXPECT_EQ(tricoil_set_hemisphere(tracker.get(), 4, opposite), -1);
    EXPECT_EQ(tricoil_set_hemisphere(tracker.get(), -1, opposite), -1);
    EXPECT_EQ(tricoil_set_hemisphere(tracker.get(), 0, nullptr), -1);
    EXPECT_EQ(tricoil_set_tip(tracker.get(), 0, broken), -1);
    EXPECT_EQ(tricoil_set_tip(nullptr, 0, tip), -1);
    EXPECT_EQ(tricoil_set_hemisphere(tracker.get(), 0, opposite), 0);
    const double no_tip[3]{0, 0, 0};
    EXPECT_EQ(tricoil_set_tip(tracker.get(), 0, no_tip), 0);
    ASSERT_EQ(tricoil_poll(tracker.get(), &pose, 1000), 1);
    EXPECT_NEAR((Vec3<double>(pose.position_m) + Vec3<double>(first.position_m)).norm(), 0, 1e-6);
}

TEST(CApi, StatusIsNeverEmpty) {
    EXPECT_STREQ(tricoil_status(nullptr), "not open");
    tricoil_pose pose;
    EXPECT_EQ(tricoil_poll(nullptr, &pose, 0), -1);

    // Serial line without a device.
    const drivers::FileDescriptor master(::posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC));
    ASSERT_EQ(::grantpt(master.get()), 0);
    ASSERT_EQ(::unlockpt(master.get()), 0);
    const std::string device = std::string("serial:") + ::ptsname(master.get());
    tricoil_tracker* const tracker = tricoil_open(device.c_str(), nullptr, nullptr, 0);
    ASSERT_NE(tracker, nullptr);
    EXPECT_THAT(tricoil_status(tracker), HasSubstr("poll"));
    EXPECT_EQ(tricoil_poll(tracker, &pose, 20), 0);
    EXPECT_STRNE(tricoil_status(tracker), "");
    EXPECT_THAT(tricoil_status(tracker), Not(HasSubstr("running")));
    tricoil_close(tracker);

    tricoil_tracker* const gone = tricoil_open("serial:/dev/no-such-line", nullptr, nullptr, 0);
    ASSERT_NE(gone, nullptr);
    EXPECT_EQ(tricoil_poll(gone, &pose, 20), 0);
    EXPECT_THAT(tricoil_status(gone), HasSubstr("/dev/no-such-line"));
    tricoil_close(gone);
    tricoil_close(nullptr);
}

}  // namespace
}  // namespace tricoil
