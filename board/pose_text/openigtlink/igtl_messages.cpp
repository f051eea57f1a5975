#include "board/pose_text/openigtlink/igtl_messages.hpp"

#include <fmt/format.h>
#include <igtlStatusMessage.h>
#include <igtlTimeStamp.h>
#include <igtlTrackingDataMessage.h>
#include <igtlTransformMessage.h>

#include <algorithm>
#include <cstring>
#include <utility>

#include "board/pose_text/flag_names.hpp"
#include "board/support/errors.hpp"
#include "core/tracking/tracker_params.hpp"

namespace tricoil::host::igtl_output {
namespace {

constexpr double kMillimetres = 1e3;
constexpr std::size_t kLongestErrorName = 19;  // plus a terminating zero

bool has_roll(const ServedPose& served) { return !served.pose.flags.has(tracking::PoseFlag::roll_undefined); }

std::string packed(igtl::MessageBase& message, const std::string& name, UtcTime utc) {
    const igtl::TimeStamp::Pointer stamp = igtl::TimeStamp::New();
    stamp->SetTimeInNanoseconds(static_cast<igtlUint64>(std::max<std::int64_t>(to_us(utc), 0)) * 1000);
    igtl::TimeStamp::Pointer taken = stamp;
    message.AllocatePack();  // the library does not initialise reserved bytes
    std::memset(message.GetPackBodyPointer(), 0, static_cast<std::size_t>(message.GetPackBodySize()));
    message.SetDeviceName(name.c_str());
    message.SetTimeStamp(taken);
    message.Pack();
    return {static_cast<const char*>(message.GetPackPointer()), static_cast<std::size_t>(message.GetPackSize())};
}

void fill(igtl::Matrix4x4& matrix, const tracking::PoseEstimate<double>& pose) {
    const Mat3<double> r = pose.q_source_sensor.toRotationMatrix();
    for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) {
            matrix[i][j] = static_cast<float>(r(i, j));
        }
        matrix[i][3] = static_cast<float>(kMillimetres * pose.position_m[i]);
        matrix[3][i] = 0;
    }
    matrix[3][3] = 1;
}

struct StatusFields {
    int code;
    std::string error_name;
    std::string text;
};

/// Sets every field, because the library does not initialise them.
std::string status(const StatusFields& fields, const std::string& name, UtcTime utc) {
    const igtl::StatusMessage::Pointer message = igtl::StatusMessage::New();
    message->SetCode(fields.code);
    message->SetSubCode(0);
    message->SetErrorName(fields.error_name.c_str());
    message->SetStatusString(fields.text.c_str());
    return packed(*message, name, utc);
}

/// The flags in `text` that fit into `size` characters.
std::string whole_flags(const std::string& text, std::size_t size) {
    if (text.size() <= size) {
        return text;
    }
    const auto end = text.rfind(", ", size);
    return text.substr(0, end == std::string::npos ? size : end);
}

}  // namespace

DeviceNames::DeviceNames(std::vector<std::string> names, const std::string& option) : names_(std::move(names)) {
    if (names_.size() > std::size_t{tracking::kMaxSensors}) {
        throw InputError(fmt::format("{}: there are at most {} sensors", option, tracking::kMaxSensors));
    }
    for (std::size_t n = 0; n < names_.size(); ++n) {
        const std::string& name = names_[n];
        const bool is_visible = std::all_of(name.begin(), name.end(), [](char c) { return c > ' ' && c <= '~'; });
        refuse_if(name.empty() || name.size() > kLongest || !is_visible, "{} {}: must have 1 to {} visible ASCII characters",
                  option, name, kLongest);
        for (std::uint8_t other = 0; other < tracking::kMaxSensors; ++other) {
            refuse_if(other != n && of(other) == name, "{} {}: is the name of sensor {} already", option, name, other + 1);
        }
    }
}

std::string DeviceNames::of(std::uint8_t sensor) const {
    return sensor < names_.size() ? names_[sensor] : "tricoil_" + std::to_string(sensor + 1);
}

std::string transform_message(const ServedPose& served, const DeviceNames& names) {
    igtl::Matrix4x4 matrix;
    fill(matrix, served.pose);
    const igtl::TransformMessage::Pointer message = igtl::TransformMessage::New();
    message->SetMatrix(matrix);
    return packed(*message, names.of(served.pose.sensor), served.utc);
}

std::string tracking_data_message(std::span<const ServedPose> poses, const std::string& coordinate_name,
                                  const DeviceNames& names) {
    const igtl::TrackingDataMessage::Pointer message = igtl::TrackingDataMessage::New();
    UtcTime newest;
    for (const ServedPose& served : poses) {
        igtl::Matrix4x4 matrix;
        fill(matrix, served.pose);
        igtl::TrackingDataElement::Pointer element = igtl::TrackingDataElement::New();
        element->SetName(names.of(served.pose.sensor).c_str());
        element->SetType(has_roll(served) ? igtl::TrackingDataElement::TYPE_6D : igtl::TrackingDataElement::TYPE_5D);
        element->SetMatrix(matrix);
        message->AddTrackingDataElement(element);
        newest = std::max(newest, served.utc);
    }
    return packed(*message, coordinate_name, newest);
}

std::string status_message(const ServedPose& served, const DeviceNames& names) {
    const bool valid = served.pose.valid();
    const std::string flags = to_text(served.pose.flags);
    const std::string advice = host::advice(served.pose.flags);
    const StatusFields fields =
        valid ? StatusFields{igtl::StatusMessage::STATUS_OK, "",
                             fmt::format("tracking{}; distortion {:.2f} mm", has_roll(served) ? "" : "; roll undefined",
                                         1e3 * served.pose.distortion_m)}
              : StatusFields{igtl::StatusMessage::STATUS_NOT_READY, whole_flags(flags, kLongestErrorName),
                             "no valid pose: " + flags + (advice.empty() ? "" : "; " + advice)};
    return status(fields, names.of(served.pose.sensor), served.utc);
}

std::string waiting_message() {
    return status({igtl::StatusMessage::STATUS_NOT_READY, "no pose yet", "the tracker has not delivered a pose yet"}, "tricoil",
                  utc_now());
}

std::string tracking_stopped_message() {
    const igtl::RTSTrackingDataMessage::Pointer message = igtl::RTSTrackingDataMessage::New();
    message->SetStatus(0);
    return packed(*message, "tricoil", utc_now());
}

}  // namespace tricoil::host::igtl_output
