// Poses as OpenIGTLink messages. Lengths are in millimetres, the matrix converts sensor components to source components, time
// stamps are the midpoint of sampling in UTC.
#pragma once

#include <span>
#include <string>

#include "board/pose_text/served_pose.hpp"

namespace tricoil::host::igtl_output {

/// "tricoil_1" for sensor 0. The message header allows 20 characters.
std::string device_name(std::uint8_t sensor);

/// TRANSFORM of one sensor.
std::string transform_message(const ServedPose& served);

/// TDATA of several sensors, with the time stamp of the newest pose.
std::string tracking_data_message(std::span<const ServedPose> poses, const std::string& coordinate_name);

/// STATUS of one sensor: OK (1), or NOT READY (13) with the flags as error name while its pose is invalid.
std::string status_message(const ServedPose& served);
/// STATUS of the server before the first pose.
std::string waiting_message();

/// Answer to STP_TDATA.
std::string tracking_stopped_message();

}  // namespace tricoil::host::igtl_output
