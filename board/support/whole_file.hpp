// Files that are there in whole or not at all.
#pragma once

#include <filesystem>
#include <string>

namespace tricoil::host {

/// Writes `text` as an OutputFile; throws as it does.
void write_whole_file(const std::filesystem::path& path, const std::string& text);

/// A folder being filled: hidden beside its target until publish() moves its files there; removed with all in it otherwise.
/// Locked while it is in use: what a killed program left behind is not, and is swept up by the next one.
class StagedFolder {
public:
    /// Creates the target folder if need be and proves that it can be written. Throws InputError, naming it, if not.
    explicit StagedFolder(const std::filesystem::path& target);
    StagedFolder(const StagedFolder&) = delete;
    StagedFolder& operator=(const StagedFolder&) = delete;
    ~StagedFolder();

    [[nodiscard]] const std::filesystem::path& path() const { return staging_; }

    /// Moves every file into the target, over older ones of the same name. Throws InputError, before the first is moved, if one
    /// of those is no regular file or write-protected.
    void publish();

private:
    std::filesystem::path target_;
    std::filesystem::path staging_;
    int lock_ = -1;  // descriptor of the staging folder
    bool created_target_ = false;
    bool published_ = false;
};

}  // namespace tricoil::host
