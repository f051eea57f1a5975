#include "board/support/whole_file.hpp"

#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <vector>

#include "board/support/errors.hpp"
#include "board/support/output_file.hpp"

namespace tricoil::host {
namespace fs = std::filesystem;

namespace {

constexpr const char* kStagingPrefix = ".unfinished-";
/// Removes unlocked staging folders: their programs were killed.
void sweep(const fs::path& target) {
    std::error_code ignored;
    for (const auto& entry : fs::directory_iterator(target, ignored)) {
        if (!entry.path().filename().string().starts_with(kStagingPrefix) || entry.is_symlink(ignored)) {
            continue;
        }
        const drivers::FileDescriptor folder = open_folder(entry.path());
        if (folder.is_open() && ::flock(folder.get(), LOCK_EX | LOCK_NB) == 0) {
            fs::remove_all(entry.path(), ignored);
        }
    }
}

}  // namespace

void write_whole_file(const fs::path& path, const std::string& text) {
    OutputFile file(path);
    file.write(text);
    file.commit();
}

StagedFolder::StagedFolder(const fs::path& target) {
    refuse_if(target.empty(), "the name of the output folder is empty; name a folder, or . for this one");
    target_ = fs::absolute(target).lexically_normal();
    if (!target_.has_filename()) {
        target_ = target_.parent_path();  // removes a trailing slash
    }
    std::error_code error;
    const bool is_other = fs::exists(target_, error) && !fs::is_directory(target_, error);
    created_target_ = !is_other && fs::create_directory(target_, error);
    if (error || is_other) {
        const std::string reason = is_other ? "it is a file" : error.message();
        throw InputError(
            fmt::format("cannot use output folder {}: {}; create its parent or choose another", target.string(), reason));
    }
    sweep(target_);
    staging_ = target_ / fmt::format("{}{}", kStagingPrefix, ::getpid());
    fs::create_directory(staging_, error);
    if (error) {
        if (created_target_) {
            std::error_code ignored;
            fs::remove(target_, ignored);
        }
        throw InputError(fmt::format("cannot write into output folder {}: {}; choose another", target.string(), error.message()));
    }
    lock_ = open_folder(staging_);
    ::flock(lock_.get(), LOCK_EX | LOCK_NB);
}

void StagedFolder::publish() {
    struct Move {
        fs::path from;
        fs::path to;
    };
    std::vector<Move> moves;
    for (const auto& entry : fs::directory_iterator(staging_)) {
        const fs::path to = target_ / entry.path().filename();
        std::error_code error;
        const fs::file_status status = fs::status(to, error);
        refuse_if(fs::exists(status) && !fs::is_regular_file(status), "cannot write {}: not a regular file; remove it",
                  to.string());
        refuse_write_protected(to);
        moves.push_back({entry.path(), without_links(to)});
    }
    for (const Move& move : moves) {
        std::error_code error;
        fs::rename(move.from, move.to, error);
        if (error) {
            throw InputError(fmt::format("cannot write {}: {}; remove the existing file", move.to.string(), error.message()));
        }
    }
    published_ = true;
}

StagedFolder::~StagedFolder() {
    std::error_code ignored;
    fs::remove_all(staging_, ignored);
    if (created_target_ && !published_) {
        fs::remove(target_, ignored);  // only if it is empty
    }
}

}  // namespace tricoil::host
