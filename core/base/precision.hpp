// Precisions in which the core is compiled. All builds have the demodulator and the filter for concentric coils in float.
#pragma once

/// 1: all trackers in float, for images; 2: all in double, for programs; 3: both. Boards without TRICOIL_WHOLE_CORE run none in
/// double; tests of programs have float in the library tricoil_core_float.
#ifndef TRICOIL_SCALARS
#define TRICOIL_SCALARS 2
#endif
