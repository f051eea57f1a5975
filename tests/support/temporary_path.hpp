// Temporary paths of tests: one folder per process, because tests run in parallel. It is removed at normal exit.
#pragma once

#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <system_error>

namespace tricoil::test {

class ProcessFolder {
public:
    ProcessFolder() {
        if (::mkdtemp(path_.data()) == nullptr) {
            throw std::system_error(errno, std::generic_category(), path_);
        }
    }
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
    std::string path_ = std::filesystem::temp_directory_path() / "tricoil_XXXXXX";
};

inline std::string path_in_temp(const std::string& name) {
    static const ProcessFolder folder;
    return folder.path() + "/" + name;
}

}  // namespace tricoil::test
