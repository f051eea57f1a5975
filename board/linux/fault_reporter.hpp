// Reports refused messages and faults of the link on standard error and to a tap, once per kind and second. A fault that returns
// within a minute is counted and reported at the end.
#pragma once

#include <array>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string>

#include "board/linux/device_session.hpp"
#include "board/linux/repeated_texts.hpp"
#include "board/support/link_health.hpp"
#include "core/tracking/tracker_tap.hpp"

namespace tricoil::linux_board {

/// Texts of the fault bits of a status message, separated by semicolons.
std::string device_fault_text(std::uint16_t faults);

class FaultReporter {
public:
    /// tap: may be null; must outlive this object.
    explicit FaultReporter(std::string device, tracking::TrackerTap<double>* tap = nullptr)
        : device_(std::move(device)), tap_(tap) {}

    /// Reports counters that have changed.
    void check(const DeviceSession& session, const hal::MessagePort& port, HostTime now);

    /// Reports flags that need an action of the user, after they have lasted for one second.
    void check(tracking::PoseFlags flags, HostTime now);

    /// Reports new warnings, except HealthWarning::late, because the session reports the reason.
    void check(const host::LinkHealth& health, HostTime now);

    /// True if this is the state of the session that was reported last.
    [[nodiscard]] bool has_printed(const char* detail) const { return std::strcmp(detail, reported_detail_.data()) == 0; }

    /// Reports the counts of repeated faults. Call it at the end.
    void print_repeated() const;

private:
    void print(const char* text) const;
    void print_once(const char* text, HostTime now);
    void print_device_faults(std::uint16_t faults, HostTime now);

    std::string device_;
    tracking::TrackerTap<double>* tap_;
    std::array<std::uint64_t, protocol::kWireErrors> reported_{};
    std::array<std::optional<HostTime>, protocol::kWireErrors> reported_at_{};
    std::array<char, 320> reported_detail_{};
    RepeatedTexts repeated_;
    std::uint16_t printed_faults_ = 0;
    std::optional<HostTime> faults_printed_;
    HostTime detail_reported_;
    HostTime hemisphere_known_;  // time at which the hemisphere was last known
    bool hemisphere_reported_ = false;
    bool parameters_reported_ = false;
    host::HealthWarnings warnings_;
};

}  // namespace tricoil::linux_board
