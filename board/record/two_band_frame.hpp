// Time between the frames of a recording in two bands.
#pragma once

#include <string>

namespace tricoil::host {

/// Seconds, from the first frames without a gap. Throws InputError if the recording has no columns of two bands, or a frame rate
/// that the tracker for two bands does not support, and like RecordLines.
double two_band_frame_s(const std::string& recording);

}  // namespace tricoil::host
