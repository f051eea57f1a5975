// Sampling times of a board: update time, multiplexing, window and latency.
#pragma once

#include "core/linear/matrix.hpp"

namespace tricoil::error_model {

/// Times in seconds before the time stamp of the pose.
template <typename Scalar>
struct BoardTiming {
    Scalar update_s = 0;                               // from one pose to the next: Delta T_u of (19)-(37)
    Vec3<Scalar> column_age_s = Vec3<Scalar>::Zero();  // of S1, S2, S3: zero in FDM
    Scalar window_s = 0;                               // length of one demodulation window
    Scalar latency_s = 0;  // from the time stamp to the use of the pose; zero if the user compensates it
};

/// Newest excitation state of a pose. The order is S1 S2 S3 S1 ... A tracker that solves on every column uses all three.
enum class LastState { s1, s2, s3 };

/// Time-division multiplexing with one excitation state per slot. Time stamp: middle of the last slot.
template <typename Scalar>
BoardTiming<Scalar> tdm_timing(Scalar slot_s, Scalar window_s, LastState last = LastState::s3) {
    BoardTiming<Scalar> timing;
    timing.update_s = 3 * slot_s;
    timing.window_s = window_s;
    const int newest = static_cast<int>(last);
    for (int j = 0; j < 3; ++j) {
        timing.column_age_s(j) = static_cast<Scalar>((newest - j + 3) % 3) * slot_s;
    }
    return timing;
}

}  // namespace tricoil::error_model
