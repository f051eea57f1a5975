// OpenIGTLink session of one client.
#pragma once

#include <array>
#include <chrono>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "board/host/serve/stream.hpp"
#include "board/pose_text/openigtlink/igtl_messages.hpp"
#include "board/pose_text/served_pose.hpp"
#include "core/tracking/pose_estimate.hpp"
#include "core/tracking/tracker_params.hpp"

namespace tricoil::host::igtl_output {

/// A client that sends neither STT_TDATA nor STP_TDATA gets a TRANSFORM for every valid pose, from kQueryTimeout after its
/// connection. STT_TDATA selects TDATA, at most one per requested resolution (ms). STP_TDATA ends TDATA and TRANSFORM. GET_TRANS
/// and GET_STATUS are answered at any time. Invalid poses are not sent: while they last, a STATUS reports their flags at each
/// change and once per second, and another one their end.
/// TDATA leaves out a sensor whose pose is older than the newest by more than two intervals between poses. An STT_TDATA with a
/// wrong CRC or size is dropped. The CRC of other requests is not checked, because their content is not used.
class Session {
public:
    static constexpr std::chrono::milliseconds kQueryTimeout{100};
    static constexpr Microseconds kStatusPeriod{1'000'000};
    static constexpr std::size_t kLongestBody = 4096;  // of a request; a client that announces more is disconnected

    explicit Session(Stream& stream, DeviceNames names = DeviceNames()) : stream_(stream), names_(std::move(names)) {}

    void receive(std::span<const char> bytes);
    void take(std::span<const ServedPose> poses);
    /// Poses from before the connection, for GET_TRANS and GET_STATUS.
    void set_newest(std::span<const ServedPose> poses);

private:
    enum class Mode : std::uint8_t { waiting, transforms, tracking_data, silent };
    struct Sensor {
        std::optional<ServedPose> newest;
        Microseconds frame;          // interval between the two newest poses
        bool reported_valid = true;  // by the last STATUS
        tracking::PoseFlags reported;
        UtcTime reported_at;
    };

    void request(std::string_view type, std::string_view message);
    void start_tracking_data(std::string_view message);
    void send_tracking_data(UtcTime utc, Microseconds frame);
    void send_sensor_status(Sensor& sensor);

    Stream& stream_;
    DeviceNames names_;
    std::string received_;
    Mode mode_ = Mode::waiting;
    std::chrono::steady_clock::time_point came_ = std::chrono::steady_clock::now();
    std::array<Sensor, tracking::kMaxSensors> sensors_;
    Microseconds period_;
    UtcTime due_;
    std::string coordinate_name_ = "tricoil";
};

}  // namespace tricoil::host::igtl_output
