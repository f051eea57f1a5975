// Checks of recorded couplings of two bands before they are used.
#pragma once

#include "board/host/couplings/band_files.hpp"

namespace tricoil::host {

/// Throws InputError, naming the file, if
/// - one band's couplings do not fit the calibration: the median misfit is above 5 % of the couplings;
/// - the bands do not belong together: their poses differ, in the median, by more than 15 % of the range or 0.2 rad;
/// - the low band is shifted by one or two lines: its changes follow the changes of the high band at another line much better.
void check_bands(const BandFiles& files, const BandModels& models, const BandRecording& recording,
                 const Vec3<double>& hemisphere);

}  // namespace tricoil::host
