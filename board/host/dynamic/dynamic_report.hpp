// Motion errors of a tracker relative to a reference: errors by speed, and growth with speed and acceleration.
#pragma once

#include <string>
#include <vector>

#include "board/host/dynamic/stream_alignment.hpp"
#include "board/support/json_text.hpp"
#include "board/support/statistics.hpp"

namespace tricoil::host {

struct DynamicError {
    double time_s = 0;
    double speed_m_s = 0;
    double acceleration_m_s2 = 0;
    double position_m = 0;
    double along_m = 0;  // component of the position error along the velocity; negative for a lag
    double orientation_rad = 0;
};

struct SpeedBand {
    double from_m_s = 0;
    double to_m_s = 0;
    std::size_t poses = 0;
    double position_rms_m = 0;
    double orientation_rms_deg = 0;
};

struct DynamicReport {
    StreamAlignment alignment;
    std::vector<DynamicError> errors;
    ErrorSummary position_m;
    ErrorSummary orientation_deg;
    std::vector<SpeedBand> bands;
    // Non-negative least squares of the squared position error: rest^2 + (per_speed v)^2 + (per_acceleration a)^2.
    double at_rest_m = 0;
    double per_speed_s = 0;          // m per m/s
    double per_acceleration_s2 = 0;  // m per m/s^2
    double lag_s = 0;                // fitted if the time offset is given; otherwise the least-squares slope of -along over speed
    std::size_t in_gaps = 0;         // tracker poses not compared because of a gap in the reference
};

DynamicReport dynamic_report(const PoseStream& tracker, const PoseStream& reference, const StreamAlignment& alignment);

/// Errors as CSV with header.
std::string dynamic_csv(const DynamicReport& report);

/// Result of `evaluate --dynamic`, and its text.
Json dynamic_result(const DynamicReport& report);
std::string dynamic_text(const Json& result);

}  // namespace tricoil::host
