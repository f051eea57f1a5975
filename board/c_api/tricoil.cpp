#include "board/c_api/tricoil.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <exception>
#include <memory>
#include <new>
#include <string>

#include "board/pose_source/open_source.hpp"

namespace {

using namespace tricoil;

struct FlagOfBoth {
    std::uint32_t c;
    tracking::PoseFlag flag;
};

constexpr std::array<FlagOfBoth, 15> kFlags{{
    {TRICOIL_FLAG_SATURATED, tracking::PoseFlag::saturated},
    {TRICOIL_FLAG_LOW_SIGNAL, tracking::PoseFlag::low_signal},
    {TRICOIL_FLAG_NO_SENSOR, tracking::PoseFlag::no_sensor},
    {TRICOIL_FLAG_DISTORTED, tracking::PoseFlag::distorted},
    {TRICOIL_FLAG_WRONG_HANDEDNESS, tracking::PoseFlag::wrong_handedness},
    {TRICOIL_FLAG_STALE, tracking::PoseFlag::stale},
    {TRICOIL_FLAG_NOT_CONVERGED, tracking::PoseFlag::not_converged},
    {TRICOIL_FLAG_HEMISPHERE_UNKNOWN, tracking::PoseFlag::hemisphere_unknown},
    {TRICOIL_FLAG_NO_REFERENCE, tracking::PoseFlag::no_reference},
    {TRICOIL_FLAG_UNCONFIRMED, tracking::PoseFlag::unconfirmed},
    {TRICOIL_FLAG_INCONSISTENT, tracking::PoseFlag::inconsistent},
    {TRICOIL_FLAG_COASTING, tracking::PoseFlag::coasting},
    {TRICOIL_FLAG_UNCERTAIN, tracking::PoseFlag::uncertain},
    {TRICOIL_FLAG_COLUMNS_MISSING, tracking::PoseFlag::columns_missing},
    {TRICOIL_FLAG_ROLL_UNDEFINED, tracking::PoseFlag::roll_undefined},
}};

/// True if the C interface has exactly the flags of the C++ interface.
constexpr bool flags_agree() {
    std::uint32_t all = 0;
    for (const auto& [c, flag] : kFlags) {
        if (c != tracking::PoseFlags{flag}.bits()) {
            return false;
        }
        all |= c;
    }
    return all == tracking::kAllPoseFlags.bits();
}
static_assert(flags_agree());

tricoil_pose to_pose(const tracking::PoseEstimate<double>& p) {
    tricoil_pose pose{};
    pose.time_us = p.time.since_start().count();
    pose.sequence = p.sequence;
    pose.sensor = p.sensor;
    pose.valid = p.valid() ? 1 : 0;
    pose.flags = static_cast<std::uint16_t>(p.flags.bits());
    const Matrix<double, 4, 1> wxyz(p.q_source_sensor.w(), p.q_source_sensor.x(), p.q_source_sensor.y(), p.q_source_sensor.z());
    const Vec6<double> deviation = p.covariance.diagonal().cwiseSqrt();
    copy_rows(p.position_m, pose.position_m);
    copy_rows(wxyz, pose.quaternion_wxyz);
    copy_rows(deviation.head<3>(), pose.position_std_m);
    copy_rows(deviation.tail<3>(), pose.rotation_std_rad);
    copy_rows(p.covariance, &pose.covariance[0][0]);
    copy_rows(p.signal_matrix, &pose.couplings[0][0]);
    pose.distortion_m = p.distortion_m;
    pose.snr_db = p.snr_db;
    return pose;
}

}  // namespace

struct tricoil_tracker {  // NOLINT(readability-identifier-naming): C
    std::unique_ptr<host::PoseSource> source;
    std::string status;
    std::string failure;  // of tricoil_poll(); empty: none
};

tricoil_tracker* tricoil_open(const char* source, const char* tracker, char* error, size_t error_size) {
    const auto fail = [&](const char* reason) -> tricoil_tracker* {
        if (error != nullptr && error_size > 0) {
            (void)std::snprintf(error, error_size, "%s", reason);
        }
        return nullptr;
    };
    if (source == nullptr) {
        return fail("no source given; use for example sim:hand or serial:/dev/ttyACM0");
    }
    try {
        return new tricoil_tracker{host::open_source(source, tracker != nullptr ? tracker : ""), {}, {}};
    } catch (const std::exception& e) {
        return fail(host::one_line(e.what()).c_str());
    } catch (...) {
        return fail("failed for an unknown reason");
    }
}

int tricoil_poll(tricoil_tracker* tracker, tricoil_pose* pose, int timeout_ms) {
    constexpr int kOutOfMemory = -2;
    constexpr int kEnd = -3;
    constexpr int kFailed = -4;
    if (tracker == nullptr || pose == nullptr) {
        return -1;
    }
    try {
        tracker->failure.clear();
        tracking::PoseEstimate<double> estimate;
        switch (tracker->source->poll(Microseconds{1000 * std::int64_t{std::max(timeout_ms, 0)}}, estimate)) {
            case host::PoseSource::Event::pose:
                *pose = to_pose(estimate);
                return 1;
            case host::PoseSource::Event::none:
                return 0;
            case host::PoseSource::Event::end:
                return kEnd;
        }
    } catch (const std::bad_alloc&) {
        return kOutOfMemory;
    } catch (const std::exception& e) {
        try {
            tracker->failure = host::one_line(e.what());
        } catch (...) {
            return kOutOfMemory;
        }
    }
    return kFailed;
}

int tricoil_set_hemisphere(tricoil_tracker* tracker, int sensor, const double towards[3]) {
    const bool given = tracker != nullptr && towards != nullptr && sensor >= 0;
    return given && tracker->source->set_hemisphere(static_cast<std::size_t>(sensor), Vec3<double>(towards)) ? 0 : -1;
}

int tricoil_set_tip(tricoil_tracker* tracker, int sensor, const double tip_m[3]) {
    const bool given = tracker != nullptr && tip_m != nullptr && sensor >= 0;
    return given && tracker->source->set_tip(static_cast<std::size_t>(sensor), Vec3<double>(tip_m)) ? 0 : -1;
}

int tricoil_boresight(tricoil_tracker* tracker, int sensor) {
    const bool given = tracker != nullptr && sensor >= 0;
    return given && tracker->source->boresight(static_cast<std::size_t>(sensor)) ? 0 : -1;
}

const char* tricoil_status(tricoil_tracker* tracker) {
    if (tracker == nullptr) {
        return "not open";
    }
    try {
        tracker->status = tracker->failure.empty() ? tracker->source->status() : tracker->failure;
    } catch (...) {
        return "out of memory";
    }
    return tracker->status.c_str();
}

void tricoil_close(tricoil_tracker* tracker) { delete tracker; }
