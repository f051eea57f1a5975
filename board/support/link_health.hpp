// Health of a measurement and its link: share of missing columns, ages, queues, temperature, and warnings.
#pragma once

#include <cstddef>
#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "core/base/flag_set.hpp"
#include "core/base/time.hpp"

namespace tricoil::host {

/// Warnings (bit numbers).
enum class HealthWarning : std::uint8_t {
    missing,  // too many columns were lost or refused in the last second
    late,     // no usable column for too long
    queue,    // outputs wait for their readers, or messages or lines were dropped in the last two seconds
    hot,      // power stages, or the processor of a tracker board, above their limit
};
using HealthWarnings = FlagSet<HealthWarning>;

/// Limits; a larger value causes a warning.
struct HealthLimits {
    double missing_share = 0.01;
    Microseconds age{150'000};  // default: the time after which poses are flagged stale
    std::size_t queued_bytes = std::size_t{256} << 10U;
    double temperature_c = 80;
};

/// Columns, or poses of a tracker board: counters since the start. The other numbers are present values.
struct HealthCounts {
    std::uint64_t received = 0;
    std::uint64_t lost = 0;
    std::uint64_t refused = 0;
    std::uint64_t dropped = 0;            // messages and lines, because a queue was full
    std::size_t queued_bytes = 0;         // lines that wait for files and pipes
    Microseconds age;                     // since the newest usable column
    std::optional<double> temperature_c;  // of the power stages, or of a tracker board's processor; empty: not measured
    std::uint64_t serial = 0;             // of the device; 0: unknown
    std::uint32_t firmware = 0;           // its version; 0: unknown
};

struct LinkHealth {
    HealthCounts counts;
    double missing_share = 0;  // lost or refused columns of the last second
    double worst_missing_share = 0;
    Microseconds worst_age;
    std::size_t most_queued_bytes = 0;
    HealthWarnings warnings;       // now
    HealthWarnings seen_warnings;  // since the start
    HealthLimits limits;
};

class HealthMonitor {
public:
    explicit HealthMonitor(const HealthLimits& limits = {}) { health_.limits = limits; }

    /// now: time since any fixed instant. Call it at least five times a second. Returns true if health() must be reported: when
    /// the warnings changed, and at least every 200 ms.
    bool update(const HealthCounts& counts, Microseconds now);

    [[nodiscard]] const LinkHealth& health() const { return health_; }

private:
    LinkHealth health_;
    HealthCounts second_;  // at the start of the present second
    std::optional<Microseconds> second_start_;
    Microseconds passed_;
    std::optional<Microseconds> dropped_at_;
};

/// Warnings as text, with their limits; empty if there are none.
std::string to_text(HealthWarnings warnings, const HealthLimits& limits);

/// Every number, with its unit in its key.
nlohmann::ordered_json health_json(const LinkHealth& health);

/// Summary of the whole time in one line from health_json(), without line end.
std::string health_line(const nlohmann::ordered_json& health, const std::string& of_poses = "");

/// Warning for health_line() if more than 1 % of the poses are so; otherwise empty. what: for example "invalid".
std::string pose_warning(std::uint64_t count, std::uint64_t all, const char* what);

}  // namespace tricoil::host
