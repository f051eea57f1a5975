// Reads the coil lines like the power stages: three levels and a hardware enable that needs a heartbeat.
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "core/base/time.hpp"
#include "core/signal/excitation.hpp"
#include "drivers/posix/file_descriptor.hpp"

namespace tricoil::sim_front_end {

struct GpioReport {
    std::uint64_t several_on = 0;        // reads with two or three coils on; expected only in FDM
    std::uint64_t out_of_turn = 0;       // coils that came on in another order than S1, S2, S3, S1
    std::uint64_t turned_on = 0;         // number of times that a coil came on
    std::int64_t longest_enable_us = 0;  // from the last heartbeat until the enable dropped
    bool on_at_end = false;              // a line was high at the last read
    bool enabled_at_end = false;
};

class GpioWatch {
public:
    /// `folder`: simulated chip in sysfs. Lines 0-2: coils; line 3: heartbeat. Throws DeviceError if the folder does not exist.
    GpioWatch(const std::string& folder, Microseconds hold, bool has_heartbeat);

    /// Reads the lines once.
    Excitation read_lines(HostTime now);
    /// Drives the sync line (4), an input of the host. Throws DeviceError on failure.
    void drive_sync(bool high);
    [[nodiscard]] const GpioReport& report() const { return report_; }

private:
    [[nodiscard]] bool level(std::size_t line) const;
    void count_changes(const std::array<bool, kSourceCoils>& on);

    std::array<drivers::FileDescriptor, 4> values_;
    drivers::FileDescriptor sync_;  // pull attribute of line 4
    Microseconds hold_;
    bool has_heartbeat_;
    bool enabled_ = false;
    bool beat_level_ = false;
    HostTime beat_;
    int last_coil_ = -1;
    std::array<bool, kSourceCoils> on_{};
    GpioReport report_;
};

}  // namespace tricoil::sim_front_end
