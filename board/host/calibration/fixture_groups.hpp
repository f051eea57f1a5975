// Groups the files of a calibration by their fixtures.
#pragma once

#include <string>
#include <vector>

#include "board/host/calibration/calibration_fit.hpp"

namespace tricoil::host {

/// Files grouped by their fixtures.
struct FixtureGroups {
    /// Throws InputError with FixtureModel::named if the name of a sensor fixture contains no directions.
    FixtureGroups(const std::vector<PoseFile>& files, FixtureModel model);

    std::vector<std::string> source_names, sensor_names;
    std::vector<std::size_t> source_index, sensor_index;  // by file
    std::vector<Mat3<double>> named;                      // rotation of each sensor fixture by its name, else identity
};

/// Files of the other source fixtures.
std::vector<PoseFile> without(std::vector<PoseFile> files, const std::string& source);

}  // namespace tricoil::host
