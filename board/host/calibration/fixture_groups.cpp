#include "board/host/calibration/fixture_groups.hpp"

#include <algorithm>

#include "board/support/errors.hpp"

namespace tricoil::host {
namespace {

std::size_t index_in(std::vector<std::string>& names, const std::string& name) {
    const auto found = std::find(names.begin(), names.end(), name);
    const auto index = static_cast<std::size_t>(found - names.begin());
    if (found == names.end()) {
        names.push_back(name);
    }
    return index;
}

Mat3<double> named_rotation(const std::string& name) {
    const auto rotation = rotation_of_fixture(name);
    refuse_if(
        !rotation,
        "the name of sensor fixture '{}' gives no directions such as YoutZup; rename the file, or leave out --fixtures named",
        name);
    return *rotation;
}

}  // namespace

FixtureGroups::FixtureGroups(const std::vector<PoseFile>& files, FixtureModel model) {
    for (const PoseFile& file : files) {
        source_index.push_back(index_in(source_names, source_fixture_name(file)));
        sensor_index.push_back(index_in(sensor_names, sensor_fixture_name(file)));
    }
    for (const std::string& name : sensor_names) {
        named.push_back(model == FixtureModel::named ? named_rotation(name) : Mat3<double>::Identity());
    }
}

std::vector<PoseFile> without(std::vector<PoseFile> files, const std::string& source) {
    std::erase_if(files, [&](const PoseFile& file) { return source_fixture_name(file) == source; });
    return files;
}

}  // namespace tricoil::host
