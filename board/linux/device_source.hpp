// Columns and poses of a device.
#pragma once

#include <memory>

#include "board/linux/device_loop.hpp"
#include "board/linux/device_setup.hpp"
#include "board/linux/link_source.hpp"
#include "board/stream/stream_clock.hpp"

namespace tricoil::linux_board {

/// The device need not be connected yet: steps wait for it, and connect again after a lost link.
class DeviceSource final : public LinkSource {
public:
    /// calibration: content of the file config.calibration. `tap` must outlive this object; it gets the poses of
    /// the sensors; `tips` are those of poses on the link. Throws InputError for an invalid configuration, DeviceError if a coil
    /// line cannot be opened.
    DeviceSource(const DeviceConfig& config, const std::optional<calibration::Calibration<double>>& calibration,
                 tracking::TrackerTap<double>& tap, const host::ToolTips& tips);
    ~DeviceSource() override;

private:
    bool advance(Microseconds patience) override;
    void rest() override { loop_.stop(); }
    bool set_hemisphere(std::size_t sensor, const Vec3<double>& towards) override;
    [[nodiscard]] bool is_live() const override { return true; }
    [[nodiscard]] Microseconds elapsed() const override { return stamps_.elapsed(); }
    [[nodiscard]] std::optional<host::LinkState> link_state() const override;
    [[nodiscard]] std::string status() const override;
    [[nodiscard]] bool has_started() const override { return loop_.session().counters().starts > 0; }
    [[nodiscard]] bool is_steady() const override { return loop_.session().is_steady(); }
    [[nodiscard]] std::string reason(const FaultReporter& reporter) const override;
    void report(FaultReporter& reporter, HostTime now) const override;
    [[nodiscard]] bool needs_realtime() const override { return true; }
    [[nodiscard]] nlohmann::ordered_json summary() const override;
    [[nodiscard]] std::string text_of(const nlohmann::ordered_json& summary) const override;
    void take(const tracking::PoseEstimate<double>& pose);

    std::string device_;
    // Destruction in reverse order switches the coils off before anything is released.
    OpenLines lines_;
    std::unique_ptr<hal::MessagePort> port_;
    DeviceLoop loop_;
    host::StreamClock stamps_;
    tracking::PoseFlags newest_flags_;
};

}  // namespace tricoil::linux_board
