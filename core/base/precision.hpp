// Precisions in which the core is compiled. Builds for boards turn double off where nothing uses it.
#pragma once

/// Lock-in, direct and previous-measurement solvers, error model and self-check in double: off for boards without
/// TRICOIL_WHOLE_CORE.
#ifndef TRICOIL_DOUBLE
#define TRICOIL_DOUBLE 1
#endif

/// Demodulator, noise estimate and trackers in double: only for programs. Of these, programs have the demodulator and the filter for
/// concentric coils also in float; images have all in float (programs: library tricoil_core_float).
#ifndef TRICOIL_DOUBLE_TRACKERS
#define TRICOIL_DOUBLE_TRACKERS 1
#endif
