// Poses of a device.
#pragma once

#include <memory>

#include "board/linux/device_config.hpp"
#include "board/linux/device_loop.hpp"
#include "board/linux/device_setup.hpp"
#include "board/pose_source/pose_source.hpp"

namespace tricoil::host {

/// The device need not be connected yet: poll() waits for it, and connects again after a lost link. The destructor switches the
/// coils off.
class DeviceSource final : public PoseSource {
public:
    /// Throws InputError for an invalid configuration, DeviceError if a coil line cannot be opened.
    explicit DeviceSource(const linux_board::DeviceConfig& config);
    ~DeviceSource() override;

private:
    bool do_advance(Microseconds patience) override;
    bool do_set_hemisphere(std::size_t sensor, const Vec3<double>& towards) override;
    [[nodiscard]] std::string do_status() const override;

    // Destruction in reverse order switches the coils off before anything is released.
    linux_board::OpenLines lines_;
    std::unique_ptr<hal::MessagePort> port_;
    linux_board::DeviceLoop loop_;
};

}  // namespace tricoil::host
