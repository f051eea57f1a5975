// Temporary paths of a test. They lie in one folder per process, because tests run in parallel; it is removed when the process
// ends.
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <string>
#include <system_error>

namespace tricoil::test {

class ProcessFolder {
public:
    ProcessFolder() { std::filesystem::create_directories(path_); }
    ProcessFolder(const ProcessFolder&) = delete;
    ProcessFolder& operator=(const ProcessFolder&) = delete;
    /// A forked child leaves the folder to its parent.
    ~ProcessFolder() {
        std::error_code ignored;
        if (::getpid() == owner_) {
            std::filesystem::remove_all(path_, ignored);
        }
    }

    [[nodiscard]] const std::string& path() const { return path_; }

private:
    pid_t owner_ = ::getpid();
    std::string path_ = ::testing::TempDir() + "tricoil_" + std::to_string(owner_) + "/";
};

inline std::string path_in_temp(const std::string& name) {
    static const ProcessFolder folder;
    return folder.path() + name;
}

}  // namespace tricoil::test
