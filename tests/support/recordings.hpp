// Recordings of real hardware and real hand motions (not part of this project) in the folder TRICOIL_DATA_DIR.
#pragma once

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

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

/// The recorded hand motions, sorted by name; empty if there are none.
inline std::vector<std::string> recorded_motion_files() {
    std::vector<std::string> files;
    std::error_code error;
    for (const auto& entry : std::filesystem::directory_iterator(recordings_folder("hand-motion"), error)) {
        if (entry.path().extension() == ".traj") {
            files.push_back(entry.path().string());
        }
    }
    std::sort(files.begin(), files.end());
    return files;
}

}  // namespace tricoil::test
