// Correction of couplings for the errors of a board's converters and gain steps.
#pragma once

#include <cstddef>
#include <vector>

#include "board/host/calibration/frame_file.hpp"
#include "board/host/calibration/pose_set.hpp"
#include "core/signal/converter_errors.hpp"

namespace tricoil::host {

/// Corrects the couplings as a board does that stores these errors. Couplings without known levels are taken as corrected. Throws
/// InputError if only a part of them has known levels: then the gain changed during a rest, or the data are of two kinds.
void correct_converters(std::vector<PoseFile>& files, const signal::ConverterErrors& errors);
void correct_converters(std::vector<GridFrame>& frames, const signal::ConverterErrors& errors);
void correct_converters(std::vector<CouplingFrame>& frames, const signal::ConverterErrors& errors);

/// Measured: MeasuredPose, GridFrame or CouplingFrame.
template <typename Measured>
bool has_known_levels(const Measured& measured) {
    return measured.levels && measured.levels->known();
}

/// How many couplings have levels.
struct LevelCount {
    std::size_t known = 0;
    std::size_t unknown = 0;  // of a file with levels
    std::size_t absent = 0;   // of a file without levels
};
LevelCount count_levels(const std::vector<PoseFile>& files);
LevelCount count_levels(const std::vector<GridFrame>& frames);
LevelCount count_levels(const std::vector<CouplingFrame>& frames);

}  // namespace tricoil::host
