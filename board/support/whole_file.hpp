// Files and folders that are written completely or not at all.
#pragma once

#include <filesystem>
#include <string>

#include "drivers/posix/file_descriptor.hpp"

namespace tricoil::host {

/// Writes `text` through an OutputFile and throws like it.
void write_whole_file(const std::filesystem::path& path, const std::string& text);

/// Hidden staging folder in its target folder. publish() moves its files to the target; otherwise it is removed with its files.
/// The folder is locked while in use. The next program with the same target removes unlocked staging folders of
/// killed programs.
class StagedFolder {
public:
    /// Creates the target folder if necessary. Throws InputError, naming the folder, if it cannot be written.
    explicit StagedFolder(const std::filesystem::path& target);
    StagedFolder(const StagedFolder&) = delete;
    StagedFolder& operator=(const StagedFolder&) = delete;
    ~StagedFolder();

    [[nodiscard]] const std::filesystem::path& path() const { return staging_; }

    /// Moves every file to the target and replaces older files. Throws InputError before the first move if an older file is
    /// write-protected or not a regular file.
    void publish();

private:
    std::filesystem::path target_;
    std::filesystem::path staging_;
    drivers::FileDescriptor lock_;  // the staging folder
    bool created_target_ = false;
    bool published_ = false;
};

}  // namespace tricoil::host
