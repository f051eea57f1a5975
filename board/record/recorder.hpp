// Records a run: parameters, inputs and outputs of the trackers.
#pragma once

#include <array>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>

#include "board/record/journal.hpp"
#include "board/record/record_lines.hpp"
#include "core/tracking/tracker_tap.hpp"

namespace tricoil::host {

/// After the constructor and before close(), only the thread of the journal makes system calls.
class Recorder final : public tracking::TrackerTap<double> {
public:
    /// Creates `folder`, or uses it if it exists and is empty. source: description of the origin of the columns, stored
    /// unchanged. Throws InputError, naming the folder, if it cannot be used.
    Recorder(const std::string& folder, nlohmann::ordered_json source, Journal::WhenFull when_full);
    ~Recorder() override;

    /// Replaces begin() for trackers that already run. Their last valid positions (m, by sensor; zero: none) give the
    /// hemisphere. A replay starts with new trackers, so its first poses may differ.
    void begin_while_running(const Settings& settings, std::span<const Vec3<double>> positions_m);

    /// True if recording has stopped: the disk failed, is full or too slow, or the device reconnected with other settings.
    [[nodiscard]] bool failed() const { return journal_.failed(); }
    /// Bytes of the recorded lines on the disk.
    [[nodiscard]] std::uint64_t bytes() const { return journal_.bytes(); }

    /// Ends the recording. Returns one line that describes the failure; empty if there was none.
    std::string close();

private:
    void do_begin(const Settings& settings) override;
    void do_column(const MeasuredColumn<double>& column) override;
    void do_tick(std::uint8_t sensor, DeviceTime now) override;
    void do_hemisphere(std::uint8_t sensor, const Vec3<double>& towards) override;
    void do_truth(std::uint8_t sensor, DeviceTime time, const solver::RigidPose<double>& pose) override;
    void do_pose(const tracking::PoseEstimate<double>& estimate) override;
    void do_fault(std::string_view text) override;

    void append(RecordFile file, const std::string& line);
    void event(std::uint8_t sensor, const std::string& what, const std::string& detail);
    [[nodiscard]] std::string description_text() const;
    void describe_now();
    [[nodiscard]] std::string description_path() const;
    [[nodiscard]] std::string failure() const;

    std::string folder_;
    Journal journal_;
    nlohmann::ordered_json description_;
    std::optional<nlohmann::ordered_json> settings_;
    std::array<tracking::PoseFlags, tracking::kMaxSensors> flags_{};
    std::int64_t time_us_ = 0;  // of the newest input
    bool closed_ = false;
};

}  // namespace tricoil::host
