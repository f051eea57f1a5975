// Self-check at power-on and on demand: all groups of checks and the time per step, as a report.
#pragma once

#include "core/base/time.hpp"
#include "core/selfcheck/report.hpp"

namespace tricoil::selfcheck {

/// Source of device time, because the core has no clock. Must not be null.
struct TimeSource {
    DeviceTime (*now)(const void* context);
    const void* context;
};

/// Runs all checks. Bounded: about 10,000 solver steps. No allocation. Thread context.
Report run(const TimeSource& time);

/// Checks that fit into a board's flash beside a tracker, in single precision: arithmetic, direct solver, error model,
/// demodulator. The report is an argument, so that it need not be on a small stack. The board itself checks whether it has a
/// calibration.
void run_on_board(Report& report);

/// Text of an outcome: "pass", "FAIL" or "absent".
const char* name_of(Outcome outcome);

/// "float", "double" or "".
const char* name_of(Precision precision);

}  // namespace tricoil::selfcheck
