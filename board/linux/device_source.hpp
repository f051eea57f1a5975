// Columns and poses of a device.
#pragma once

#include <memory>

#include "board/linux/device_loop.hpp"
#include "board/linux/device_setup.hpp"
#include "board/stream/source.hpp"

namespace tricoil::linux_board {

/// The device need not be connected yet: steps wait for it, and connect again after a lost link.
class DeviceSource final : public host::Source {
public:
    /// calibration: content of the file config.calibration. `tap` may be null and must outlive this object; it gets the poses of
    /// the sensors; `tips` are those of poses on the link. Throws InputError for an invalid configuration, DeviceError if a coil
    /// line cannot be opened.
    DeviceSource(const DeviceConfig& config, const std::optional<calibration::Calibration<double>>& calibration,
                 tracking::TrackerTap<double>* tap, const host::ToolTips& tips = {});
    ~DeviceSource() override;

    [[nodiscard]] const DeviceLoop& loop() const { return loop_; }
    [[nodiscard]] const hal::MessagePort& port() const { return *port_; }

    /// Flags of the newest pose that the user can clear by an action.
    [[nodiscard]] tracking::PoseFlags user_flags() const { return user_flags_; }

private:
    bool advance(Microseconds patience) override;
    void rest() override { loop_.stop(); }
    bool set_hemisphere(std::size_t sensor, const Vec3<double>& towards) override;
    [[nodiscard]] bool is_live() const override { return true; }
    [[nodiscard]] Microseconds elapsed() const override { return elapsed_; }
    [[nodiscard]] std::optional<host::LinkState> link_state() const override;
    [[nodiscard]] std::string status() const override;
    void take(const tracking::PoseEstimate<double>& pose);

    // Destruction in reverse order switches the coils off before anything is released.
    OpenLines lines_;
    std::unique_ptr<hal::MessagePort> port_;
    DeviceLoop loop_;
    Microseconds elapsed_;
    std::optional<DeviceTime> newest_;
    tracking::PoseFlags user_flags_;
};

}  // namespace tricoil::linux_board
