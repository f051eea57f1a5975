// Poses as OpenIGTLink messages. Lengths are in millimetres, the matrix converts sensor components to source components, time
// stamps are the midpoint of sampling in UTC.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "board/pose_text/served_pose.hpp"

namespace tricoil::host::igtl_output {

/// Names of the sensors in messages.
class DeviceNames {
public:
    static constexpr std::size_t kLongest = 20;  // characters in the header of a message

    /// Names of the first sensors; the others are "tricoil_N", N from 1. Throws InputError, beginning with `option`, for a name
    /// that is empty, too long, has other characters than printable ASCII without blanks, or is given twice, and for too many
    /// names.
    explicit DeviceNames(std::vector<std::string> names = {}, const std::string& option = {});

    [[nodiscard]] std::string of(std::uint8_t sensor) const;

private:
    std::vector<std::string> names_;
};

/// TRANSFORM of one sensor.
std::string transform_message(const ServedPose& served, const DeviceNames& names = DeviceNames());

/// TDATA of several sensors, with the time stamp of the newest pose.
std::string tracking_data_message(std::span<const ServedPose> poses, const std::string& coordinate_name,
                                  const DeviceNames& names = DeviceNames());

/// STATUS of one sensor: OK (1), or NOT READY (13) with the flags as error name while its pose is invalid.
std::string status_message(const ServedPose& served, const DeviceNames& names = DeviceNames());
/// STATUS of the server before the first pose.
std::string waiting_message();

/// Answer to STP_TDATA.
std::string tracking_stopped_message();

}  // namespace tricoil::host::igtl_output
