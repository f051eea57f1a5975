// The self-check at power-on and on demand: all groups of checks and the time per step, as a report.
#pragma once

#include "core/base/time.hpp"
#include "core/selfcheck/report.hpp"

namespace tricoil::selfcheck {

/// Device time from whoever has a clock; the core has none. Must not be null.
struct TimeSource {
    DeviceTime (*now)(const void* context);
    const void* context;
};

/// Bounded: some 10,000 solver steps. No allocation. Thread context.
Report run(const TimeSource& time);

/// What of it fits into a board's flash beside a tracker, in the one precision that it has in hardware: the processor's
/// arithmetic, direct solver, error model, demodulator. Into a report that need not lie on a small stack. Whether there is a
/// calibration, the board knows.
void run_on_board(const TimeSource& time, Report& report);

/// A word for an outcome: "pass", "FAIL" or "absent".
const char* name_of(Outcome outcome);

/// "float", "double" or "".
const char* name_of(Precision precision);

}  // namespace tricoil::selfcheck
