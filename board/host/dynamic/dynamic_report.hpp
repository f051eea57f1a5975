// What motion costs a tracker, measured against a reference: errors by speed, and how they grow with speed and acceleration.
#pragma once

#include <string>
#include <vector>

#include "board/host/dynamic/stream_alignment.hpp"
#include "board/host/run/statistics.hpp"

namespace tricoil::host {

struct DynamicError {
    double time_s = 0;
    double speed_m_s = 0;
    double acceleration_m_s2 = 0;
    double position_m = 0;
    double along_m = 0;  // of the position error along the velocity; a lag makes it negative
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
    // Least squares of the squared position error: rest^2 + (per_speed v)^2 + (per_acceleration a)^2, none negative.
    double at_rest_m = 0;
    double per_speed_s = 0;          // m of error per m/s: a time
    double per_acceleration_s2 = 0;  // m of error per m/s^2: a time squared
    double lag_s = 0;                // with a given time offset, fitted; otherwise the mean of -along over speed, which it left
    std::size_t in_gaps = 0;         // tracker poses not compared, as the reference has a gap there
};

DynamicReport dynamic_report(const PoseStream& tracker, const PoseStream& reference, const StreamAlignment& alignment);

/// Errors as CSV with a header line.
std::string dynamic_csv(const DynamicReport& report);

std::string dynamic_text(const DynamicReport& report);
std::string dynamic_json(const DynamicReport& report);

}  // namespace tricoil::host
