// Correction of couplings for the errors of a board's converters and gain steps.
#pragma once

#include <cstddef>
#include <vector>

#include "board/host/calibration/frame_file.hpp"
#include "board/host/calibration/pose_set.hpp"
#include "core/signal/converter_errors.hpp"

namespace tricoil::host {

/// How many couplings have known levels at the converters.
struct LevelCount {
    std::size_t known = 0;
    std::size_t unknown = 0;  // in files with levels
    std::size_t absent = 0;   // in files without levels

    LevelCount& operator+=(const LevelCount& other);
};

/// Measured: MeasuredPose, GridFrame or CouplingFrame.
template <typename Measured>
bool has_known_levels(const Measured& measured) {
    return measured.levels && measured.levels->known();
}

/// Corrects the couplings as a board does that stores these errors. Couplings without known levels are taken as corrected; the
/// result counts them. Measured: GridFrame or CouplingFrame. Throws InputError like refuse_mixed_levels().
template <typename Measured>
LevelCount correct_converters(std::vector<Measured>& couplings, const signal::ConverterErrors& errors);
LevelCount correct_converters(std::vector<PoseFile>& files, const signal::ConverterErrors& errors);

/// Throws InputError if there are errors to correct and only a part of the couplings has known levels: then the gain changed
/// during a rest, or the data are of two kinds.
void refuse_mixed_levels(const LevelCount& count, const signal::ConverterErrors& errors);

}  // namespace tricoil::host
