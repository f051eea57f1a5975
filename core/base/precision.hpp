// Precisions in which the core is compiled. All builds have the demodulator and the filter for concentric coils in float.
#pragma once

/// Double. Boards without TRICOIL_WHOLE_CORE turn it off, because nothing there uses it.
#ifndef TRICOIL_DOUBLE
#define TRICOIL_DOUBLE 1
#endif

/// The other trackers in float. Images have them; programs run these in double (tests: library tricoil_core_float).
#ifndef TRICOIL_FLOAT_TRACKERS
#define TRICOIL_FLOAT_TRACKERS 0
#endif
