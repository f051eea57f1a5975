// Recordings of real hardware and real hand motions (not part of this project) in the folder TRICOIL_DATA_DIR.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <numeric>
#include <string>
#include <vector>

#include "sim/motion/recorded_motion.hpp"

namespace tricoil::test {

/// Path of a folder of recordings; empty if TRICOIL_DATA_DIR is not set or does not contain it.
inline std::string recordings_folder(const std::string& name = "") {
    const char* const data = std::getenv("TRICOIL_DATA_DIR");
    if (data == nullptr) {
        return "";
    }
    const std::filesystem::path folder = name.empty() ? std::filesystem::path(data) : std::filesystem::path(data) / name;
    return std::filesystem::is_directory(folder) ? folder.string() : "";
}

/// The files of a folder with this extension, sorted by name; empty if there are none.
inline std::vector<std::string> recorded_files(const std::string& folder, const std::string& extension) {
    std::vector<std::string> files;
    std::error_code error;
    for (const auto& entry : std::filesystem::directory_iterator(recordings_folder(folder), error)) {
        if (entry.path().extension() == extension) {
            files.push_back(entry.path().string());
        }
    }
    std::sort(files.begin(), files.end());
    return files;
}

/// The recorded hand motions.
inline std::vector<std::string> recorded_motion_files() { return recorded_files("hand-motion", ".traj"); }

/// Poses of a recorded fast motion: time_s,x_m,y_m,z_m,qw,qx,qy,qz and more. A missing pose repeats the last one.
inline std::unique_ptr<sim::RecordedMotion> fast_motion(const std::string& file) {
    std::ifstream in(file);
    std::vector<sim::Pose> poses;
    std::string line;
    for (std::getline(in, line); std::getline(in, line);) {
        std::array<double, 8> v{};
        const char* at = line.c_str();
        for (double& number : v) {
            char* end = nullptr;
            number = std::strtod(at, &end);
            number = end == at ? std::nan("") : number;
            at = *end == ',' ? end + 1 : end;
        }
        if (std::isfinite(std::accumulate(v.begin(), v.end(), 0.0))) {
            poses.push_back({{v[1], v[2], v[3]}, Quat<double>(v[4], v[5], v[6], v[7]).normalized()});
        } else if (!poses.empty()) {
            poses.push_back(poses.back());
        }
    }
    // The recording is 285.7 Hz. Above 30 Hz it is mostly noise: 0.03 to 0.08 mm.
    return std::make_unique<sim::RecordedMotion>(poses, sim::RecordedMotionParams{1 / 0.0035, 30, 1, {0.9, 0, 0}});
}

}  // namespace tricoil::test
