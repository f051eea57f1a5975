#include "board/host/serve/openigtlink/igtl_session.hpp"

#include <igtl_util.h>

#include <algorithm>
#include <vector>

namespace tricoil::host::igtl_output {
namespace {

constexpr std::size_t kHeaderBytes = 58;
constexpr int kLongestResolutionMs = 60'000;
constexpr Microseconds kJitter{1000};
constexpr Microseconds kNoFrame{20'000};  // assumed interval between poses until two poses give the real one
constexpr std::int64_t kMaxFrames = 2;  // maximum age difference of two sensors' poses in one message, in intervals between poses

// Offsets in an OpenIGTLink header. The header is parsed here, because the library does not check sizes.
constexpr std::size_t kVersionAt = 0;
constexpr std::size_t kTypeAt = 2;
constexpr std::size_t kTypeBytes = 12;
constexpr std::size_t kSizeAt = 42;
constexpr std::size_t kCrcAt = 50;

// Extended header at the beginning of a body, from version 2.
constexpr std::size_t kExtendedHeaderBytes = 12;
constexpr std::size_t kMetadataHeaderSizeAt = 2;
constexpr std::size_t kMetadataSizeAt = 4;

// STT_TDATA
constexpr std::size_t kNameAt = 4;
constexpr std::size_t kStartBytes = 36;

/// Big-endian, like all numbers of OpenIGTLink.
std::uint64_t number(std::string_view bytes, std::size_t at, std::size_t size) {
    std::uint64_t value = 0;
    for (const char byte : bytes.substr(at, size)) {
        value = value << 8U | static_cast<std::uint8_t>(byte);
    }
    return value;
}

std::uint64_t body_size(std::string_view header) { return number(header, kSizeAt, 8); }

/// Content of a message without the extended header and metadata of version 2; empty if the CRC is wrong.
std::string_view content_of(std::string_view message) {
    const std::string_view body = message.substr(kHeaderBytes);
    std::string copy(body);  // the library function may change its argument
    if (crc64(reinterpret_cast<unsigned char*>(copy.data()), copy.size(), 0) != number(message, kCrcAt, 8)) {  // NOLINT
        return {};
    }
    if (number(message, kVersionAt, 2) < 2) {
        return body;
    }
    if (body.size() < kExtendedHeaderBytes) {
        return {};
    }
    const std::uint64_t before = number(body, 0, 2);
    const std::uint64_t behind = number(body, kMetadataHeaderSizeAt, 2) + number(body, kMetadataSizeAt, 4);
    return before + behind <= body.size() ? body.substr(before, body.size() - before - behind) : std::string_view();
}

std::string_view text(std::string_view field) { return field.substr(0, field.find('\0')); }

}  // namespace

void Session::receive(std::span<const char> bytes) {
    received_.append(bytes.data(), bytes.size());
    while (received_.size() >= kHeaderBytes && !stream_.gone()) {
        const std::uint64_t body = body_size(received_);
        if (body > kLongestBody) {
            stream_.disconnect();
            return;
        }
        const std::size_t size = kHeaderBytes + static_cast<std::size_t>(body);
        if (received_.size() < size) {
            return;
        }
        request(text(std::string_view(received_).substr(kTypeAt, kTypeBytes)), std::string_view(received_).substr(0, size));
        received_.erase(0, size);
    }
}

void Session::request(std::string_view type, std::string_view message) {
    if (type == "STT_TDATA") {
        start_tracking_data(message);
    } else if (type == "STP_TDATA") {
        mode_ = Mode::silent;
        stream_.send(tracking_stopped_message());
    } else if (type == "GET_STATUS" || type == "GET_TRANS") {
        bool any = false;
        for (const Sensor& sensor : sensors_) {
            if (sensor.newest) {
                any = true;
                const bool transform = type == "GET_TRANS" && sensor.newest->pose.valid();
                stream_.send(transform ? transform_message(*sensor.newest, names_) : status_message(*sensor.newest, names_));
            }
        }
        if (!any) {
            stream_.send(waiting_message());
        }
    }
}

void Session::start_tracking_data(std::string_view message) {
    const std::string_view start = content_of(message);
    if (start.size() != kStartBytes) {
        return;
    }
    const auto resolution_ms = static_cast<std::int32_t>(number(start, 0, kNameAt));  // zero or negative: every pose
    period_ = Microseconds{1000} * std::clamp(resolution_ms, 0, kLongestResolutionMs);
    due_ = {};
    if (const std::string_view name = text(start.substr(kNameAt)); !name.empty()) {
        coordinate_name_ = name.substr(0, DeviceNames::kLongest);
    }
    mode_ = Mode::tracking_data;
}

void Session::take(std::span<const ServedPose> poses) {
    if (mode_ == Mode::waiting && std::chrono::steady_clock::now() - came_ >= kQueryTimeout) {
        mode_ = Mode::transforms;
    }
    for (const ServedPose& served : poses) {
        if (served.pose.sensor >= sensors_.size()) {
            continue;
        }
        Sensor& sensor = sensors_[served.pose.sensor];
        sensor.frame = sensor.newest ? std::max(served.utc - sensor.newest->utc, sensor.newest->utc - served.utc) : kNoFrame;
        sensor.newest = served;
        if (mode_ == Mode::transforms || mode_ == Mode::tracking_data) {
            send_sensor_status(sensor);
        }
        if (mode_ == Mode::transforms && served.pose.valid()) {
            stream_.send(transform_message(served, names_));
        } else if (mode_ == Mode::tracking_data && served.pose.valid()) {
            send_tracking_data(served.utc, sensor.frame);
        }
    }
}

void Session::set_newest(std::span<const ServedPose> poses) {
    for (const ServedPose& served : poses) {
        if (served.pose.sensor < sensors_.size()) {
            sensors_[served.pose.sensor].newest = served;
        }
    }
}

void Session::send_sensor_status(Sensor& sensor) {
    const auto& pose = sensor.newest->pose;
    const UtcTime utc = sensor.newest->utc;
    const bool repeats = !pose.valid() && (sensor.reported != pose.flags || utc - sensor.reported_at >= kStatusPeriod);
    if (sensor.reported_valid != pose.valid() || repeats) {  // no STATUS if the first pose is valid
        stream_.send(status_message(*sensor.newest, names_));
        sensor.reported_valid = pose.valid();
        sensor.reported = pose.flags;
        sensor.reported_at = utc;
    }
}

void Session::send_tracking_data(UtcTime utc, Microseconds frame) {
    const bool clock_was_set = utc < due_ - 2 * period_ - kJitter;
    if (utc < due_ - kJitter && !clock_was_set) {
        return;
    }
    const bool fell_behind = utc > due_ + period_ || clock_was_set;
    due_ = (fell_behind ? utc : due_) + period_;
    std::vector<ServedPose> valid;
    for (const Sensor& sensor : sensors_) {
        if (sensor.newest && sensor.newest->pose.valid() && utc - sensor.newest->utc <= kMaxFrames * frame + kJitter) {
            valid.push_back(*sensor.newest);
        }
    }
    stream_.send(tracking_data_message(valid, coordinate_name_, names_));
}

}  // namespace tricoil::host::igtl_output
