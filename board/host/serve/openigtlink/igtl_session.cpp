#include "board/host/serve/openigtlink/igtl_session.hpp"

#include <igtlMessageHeader.h>
#include <igtlTrackingDataMessage.h>

#include <algorithm>
#include <cstring>
#include <vector>

#include "board/host/serve/openigtlink/igtl_messages.hpp"

namespace tricoil::host::igtl_output {
namespace {

constexpr std::size_t kHeaderBytes = 58;
constexpr int kLongestResolutionMs = 60'000;
constexpr std::int64_t kJitterUs = 1000;

// Where an OpenIGTLink header has them; read here, as the library takes any size for granted.
constexpr std::size_t kTypeAt = 2;
constexpr std::size_t kTypeBytes = 12;
constexpr std::size_t kSizeAt = 42;

std::uint64_t body_size(std::string_view header) {
    std::uint64_t size = 0;
    for (std::size_t n = 0; n < sizeof size; ++n) {
        size = size << 8U | static_cast<std::uint8_t>(header[kSizeAt + n]);
    }
    return size;
}

std::string_view type_of(std::string_view header) {
    const std::string_view field = header.substr(kTypeAt, kTypeBytes);
    return field.substr(0, field.find('\0'));
}

igtl::MessageHeader::Pointer unpack_header(std::string_view bytes) {
    igtl::MessageHeader::Pointer header = igtl::MessageHeader::New();
    header->InitPack();
    std::memcpy(header->GetPackPointer(), bytes.data(), kHeaderBytes);
    header->Unpack();
    return header;
}

}  // namespace

void Session::receive(std::span<const char> bytes) {
    received_.append(bytes.data(), bytes.size());
    while (received_.size() >= kHeaderBytes && !stream_.gone()) {
        const std::uint64_t body = body_size(received_);
        if (body > kLongestBody) {  // garbage, or for somebody else
            stream_.hang_up();
            return;
        }
        const std::size_t size = kHeaderBytes + static_cast<std::size_t>(body);
        if (received_.size() < size) {
            return;
        }
        request(type_of(received_), std::string_view(received_).substr(0, size));
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
                stream_.send(transform ? transform_message(*sensor.newest) : status_message(*sensor.newest));
            }
        }
        if (!any) {
            stream_.send(waiting_message());
        }
    }
}

void Session::start_tracking_data(std::string_view message) {
    const igtl::StartTrackingDataMessage::Pointer start = igtl::StartTrackingDataMessage::New();
    igtl::MessageHeader::Pointer header = unpack_header(message);
    start->SetMessageHeader(header);
    start->AllocatePack();
    const std::size_t body = message.size() - kHeaderBytes;
    if (static_cast<std::size_t>(start->GetPackBodySize()) != body) {
        return;
    }
    std::memcpy(start->GetPackBodyPointer(), message.data() + kHeaderBytes, body);
    if ((start->Unpack(1) & igtl::MessageHeader::UNPACK_BODY) == 0) {  // the CRC differs
        return;
    }
    period_us_ = std::int64_t{1000} * std::clamp(static_cast<int>(start->GetResolution()), 0, kLongestResolutionMs);
    due_us_ = 0;
    if (const char* name = start->GetCoordinateName(); name != nullptr && *name != '\0') {
        coordinate_name_ = std::string(name).substr(0, 20);
    }
    mode_ = Mode::tracking_data;
}

void Session::take(std::span<const ServedPose> poses) {
    if (mode_ == Mode::waiting && std::chrono::steady_clock::now() - came_ >= kPatience) {
        mode_ = Mode::transforms;
    }
    for (const ServedPose& served : poses) {
        if (served.pose.sensor >= sensors_.size()) {
            continue;
        }
        Sensor& sensor = sensors_[served.pose.sensor];
        sensor.newest = served;
        if (mode_ == Mode::transforms || mode_ == Mode::tracking_data) {
            tell_status(sensor);
        }
        if (mode_ == Mode::transforms && served.pose.valid()) {
            stream_.send(transform_message(served));
        } else if (mode_ == Mode::tracking_data && served.pose.valid()) {
            send_tracking_data(served.utc_us);
        }
    }
}

void Session::tell_status(Sensor& sensor) {
    const bool valid = sensor.newest->pose.valid();
    if (sensor.told ? sensor.told_valid != valid : !valid) {  // what begins well needs no word
        stream_.send(status_message(*sensor.newest));
    }
    sensor.told = true;
    sensor.told_valid = valid;
}

void Session::send_tracking_data(std::int64_t utc_us) {
    const bool clock_was_set = utc_us < due_us_ - 2 * period_us_ - kJitterUs;
    if (utc_us < due_us_ - kJitterUs && !clock_was_set) {
        return;
    }
    const bool fell_behind = utc_us > due_us_ + period_us_ || clock_was_set;
    due_us_ = (fell_behind ? utc_us : due_us_) + period_us_;
    std::vector<ServedPose> valid;
    for (const Sensor& sensor : sensors_) {
        if (sensor.newest && sensor.newest->pose.valid()) {
            valid.push_back(*sensor.newest);
        }
    }
    stream_.send(tracking_data_message(valid, coordinate_name_));
}

}  // namespace tricoil::host::igtl_output
