// The power stages' view of the coil lines: three levels, and an enable that only heartbeats keep up.
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "core/signal/excitation.hpp"
#include "drivers/posix/file_descriptor.hpp"

namespace tricoil::sim_front_end {

struct GpioReport {
    std::uint64_t several_on = 0;        // looks at which two or three coils were on, outside FDM
    std::uint64_t out_of_turn = 0;       // coils that came on other than S1, S2, S3, S1
    std::uint64_t turned_on = 0;         // times a coil came on
    std::int64_t longest_enable_us = 0;  // from the last heartbeat until the enable dropped
    bool on_at_end = false;              // a line was still high at the last look
    bool enabled_at_end = false;
};

class GpioWatch {
public:
    /// `folder`: of the simulated chip in sysfs; lines 0-2 are the coils, 3 the heartbeat. Throws DeviceError if it is not there.
    GpioWatch(const std::string& folder, std::int64_t hold_us, bool has_heartbeat);

    /// Looks at the lines once.
    Excitation look(std::int64_t now_us);
    /// Drives line 4, which the host sees. Throws DeviceError if it cannot be driven.
    void drive_sync(bool high);
    [[nodiscard]] bool enabled() const { return enabled_; }
    [[nodiscard]] const GpioReport& report() const { return report_; }

private:
    [[nodiscard]] bool level(std::size_t line) const;
    void judge(const std::array<bool, kSourceCoils>& on);

    std::array<drivers::FileDescriptor, 4> values_;
    drivers::FileDescriptor sync_;  // the simulated chip's pull of line 4
    std::int64_t hold_us_;
    bool has_heartbeat_;
    bool enabled_ = false;
    bool beat_level_ = false;
    std::int64_t beat_us_ = 0;
    int last_coil_ = -1;
    std::array<bool, kSourceCoils> on_{};
    GpioReport report_;
};

}  // namespace tricoil::sim_front_end
