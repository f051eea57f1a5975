// Precisions in which the core is compiled: always float. The build turns double off where nothing uses it.
#pragma once

/// Solvers, error model and self-check in double: off without TRICOIL_WHOLE_CORE.
#ifndef TRICOIL_DOUBLE
#define TRICOIL_DOUBLE 1
#endif

/// Demodulator, trackers and calibration in double: only for programs.
#ifndef TRICOIL_DOUBLE_TRACKERS
#define TRICOIL_DOUBLE_TRACKERS 1
#endif
