#include "board/c_api/tricoil.h"

#include <array>
#include <cstdio>
#include <deque>
#include <exception>
#include <memory>
#include <optional>
#include <string>

#include "board/linux/device_setup.hpp"
#include "board/linux/device_uri.hpp"
#include "board/support/calibration_file.hpp"
#include "board/support/errors.hpp"
#include "core/protocol/convert.hpp"
#include "drivers/posix/monotonic_clock.hpp"

namespace {

using namespace tricoil;

constexpr std::size_t kMaxKept = 256;  // poses, 0.27 s at 960 Hz

struct FlagOfBoth {
    std::uint32_t c;
    tracking::PoseFlag flag;
};

constexpr std::array<FlagOfBoth, 14> kFlags{{
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

bool ends_with(const std::string& text, const std::string& end) {
    return text.size() >= end.size() && text.compare(text.size() - end.size(), end.size(), end) == 0;
}

constexpr const char* kForms = "can:INTERFACE, usb:VENDOR:PRODUCT, serial:PATH or a .toml file";

/// Throws InputError if the device matches none of kForms. The error message of the program is not used, because it lists forms
/// that the library does not support.
void expect_device(const std::string& device) {
    const std::string scheme = device.substr(0, device.find(':') + 1);
    if (scheme != "can:" && scheme != "usb:" && scheme != "serial:") {
        throw host::InputError("unknown device '" + device + "'; give " + kForms);
    }
}

linux_board::DeviceConfig configuration(const std::string& device, const char* tracker) {
    linux_board::DeviceConfig config;
    if (ends_with(device, ".toml")) {
        config = linux_board::load_device_config(device);
    } else {
        config.device = device;
    }
    expect_device(config.device);
    config.method = tracker != nullptr ? tracker : config.method;
    return config;
}

std::optional<calibration::Calibration<double>> calibration_of(const linux_board::DeviceConfig& config) {
    return config.calibration.empty() ? std::nullopt : std::optional(host::read_calibration(config.calibration).calibration);
}

/// Status of a connection without errors.
const char* to_text(linux_board::Phase phase) {
    switch (phase) {
        case linux_board::Phase::closed:
            return "not connected yet; call tricoil_poll()";
        case linux_board::Phase::greeting:
            return "waiting for the device's identification";
        case linux_board::Phase::starting:
            return "waiting for the device to start";
        case linux_board::Phase::running:
            break;
    }
    return "running";
}

tricoil_pose to_pose(const protocol::PoseMessage& m) {
    tricoil_pose pose{};
    pose.time_us = m.time_us;
    pose.sequence = m.sequence;
    pose.sensor = m.sensor;
    pose.flags = m.flags;
    pose.valid = (m.flags & tracking::kInvalidating.bits()) == 0 ? 1 : 0;
    for (std::size_t i = 0; i < 3; ++i) {
        pose.position_m[i] = m.position[i] / protocol::kPositionPerMetre;
        pose.position_std_m[i] = m.deviation[i] / protocol::kDeviationPerUnit;
        pose.rotation_std_rad[i] = m.deviation[i + 3] / protocol::kDeviationPerUnit;
    }
    for (std::size_t i = 0; i < 4; ++i) {
        pose.quaternion_wxyz[i] = m.quaternion[i] / protocol::kQuaternionPerUnit;
    }
    pose.distortion_m = m.distortion / protocol::kDistortionPerMetre;
    return pose;
}

}  // namespace

/// Order of members: lines, port, loop. Destruction in reverse order switches the coils off before anything is released.
struct tricoil_tracker {  // NOLINT(readability-identifier-naming): C
    explicit tricoil_tracker(const linux_board::DeviceConfig& config)
        : lines(config.coils),
          port(linux_board::make_port(linux_board::parse_device_uri(config.device))),
          loop(*port, lines.lines(), linux_board::loop_params(config, calibration_of(config)),
               [this](const protocol::PoseMessage& pose) { keep(pose); }) {}

    void keep(const protocol::PoseMessage& pose) {
        if (poses.size() == kMaxKept) {
            poses.pop_front();
        }
        poses.push_back(to_pose(pose));
    }

    std::deque<tricoil_pose> poses;
    linux_board::OpenLines lines;
    std::unique_ptr<hal::MessagePort> port;
    linux_board::DeviceLoop loop;
    std::string status;
};

tricoil_tracker* tricoil_open(const char* device, const char* tracker, char* error, size_t error_size) {
    const auto fail = [&](const char* reason) -> tricoil_tracker* {
        if (error != nullptr && error_size > 0) {
            (void)std::snprintf(error, error_size, "%s", reason);
        }
        return nullptr;
    };
    if (device == nullptr) {
        std::string reason = "no device given; use ";
        return fail(reason.append(kForms).c_str());
    }
    try {
        return new tricoil_tracker(configuration(device, tracker));
    } catch (const std::exception& e) {
        return fail(e.what());
    } catch (...) {
        return fail("failed for an unknown reason");
    }
}

int tricoil_poll(tricoil_tracker* tracker, tricoil_pose* pose, int timeout_ms) {
    if (tracker == nullptr || pose == nullptr) {
        return -1;
    }
    const HostTime end = drivers::host_now() + Microseconds{1000 * std::int64_t{timeout_ms}};
    try {
        do {
            tracker->loop.step();
        } while (tracker->poses.empty() && drivers::host_now() < end);
    } catch (...) {
        return -2;
    }
    if (tracker->poses.empty()) {
        return 0;
    }
    *pose = tracker->poses.front();
    tracker->poses.pop_front();
    return 1;
}

const char* tricoil_status(tricoil_tracker* tracker) {
    if (tracker == nullptr) {
        return "not open";
    }
    const linux_board::DeviceSession& session = tracker->loop.session();
    const char* const error = session.detail();
    try {
        tracker->status = *error != '\0' ? error : to_text(session.phase());
    } catch (...) {
        return "out of memory";
    }
    return tracker->status.c_str();
}

void tricoil_close(tricoil_tracker* tracker) {
    if (tracker != nullptr) {
        try {
            tracker->loop.stop();
            tracker->port->close();
        } catch (...) {  // the destructor of the tracker releases the rest
        }
        delete tracker;
    }
}
