#include "board/support/whole_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <vector>

#include "board/support/errors.hpp"

namespace tricoil::host {
namespace fs = std::filesystem;

namespace {

constexpr const char* kStagingPrefix = ".unfinished-";
constexpr int kMaxLinks = 40;  // as the kernel
constexpr fs::perms kAnyWrite = fs::perms::owner_write | fs::perms::group_write | fs::perms::others_write;

[[noreturn]] void refuse(const fs::path& path, const std::string& why) {
    throw InputError(fmt::format("cannot write {}: {}; choose another file or folder", path.string(), why));
}

/// Where links lead, also to a file that is not there yet.
fs::path without_links(const fs::path& path) {
    fs::path place = path;
    std::error_code error;
    for (int links = 0; fs::is_symlink(place, error); ++links) {
        if (links == kMaxLinks) {
            refuse(path, "its symbolic links lead nowhere");
        }
        place = place.parent_path() / fs::read_symlink(place, error);  // an absolute one replaces the parent
    }
    return place;
}

/// For pipes, terminals and devices: as they are, in order with what the program prints.
void write_directly(const fs::path& path, const std::string& text) {
    std::error_code ignored;
    const bool is_stdout = fs::equivalent(path, "/dev/stdout", ignored);
    std::FILE* const file = is_stdout ? stdout : std::fopen(path.c_str(), "w");
    if (file == nullptr) {
        refuse(path, std::strerror(errno));
    }
    const bool written = std::fwrite(text.data(), 1, text.size(), file) == text.size();
    const bool flushed = std::fflush(file) == 0;
    const bool closed = is_stdout || std::fclose(file) == 0;
    if (!written || !flushed || !closed) {
        throw DeviceError(path.string() + ": could not be written completely");
    }
}

void replace_file(const fs::path& path, const fs::path& place, const std::string& text, fs::file_status old) {
    fs::path aside = place;
    aside += fmt::format(".part-{}", ::getpid());
    std::error_code ignored;
    std::ofstream file(aside, std::ios::binary);
    file << text;
    file.close();
    if (!file) {
        const std::string why = std::strerror(errno);
        fs::remove(aside, ignored);
        refuse(path, why);
    }
    std::error_code error;
    if (fs::exists(old)) {
        fs::permissions(aside, old.permissions(), ignored);
    }
    fs::rename(aside, place, error);
    if (error) {
        fs::remove(aside, ignored);
        refuse(path, error.message());
    }
}

/// Removes staging folders that nobody holds a lock on: their programs were killed.
void sweep(const fs::path& target) {
    std::error_code ignored;
    for (const auto& entry : fs::directory_iterator(target, ignored)) {
        if (!entry.path().filename().string().starts_with(kStagingPrefix) || entry.is_symlink(ignored)) {
            continue;
        }
        const int folder = ::open(entry.path().c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
        if (folder < 0) {
            continue;
        }
        if (::flock(folder, LOCK_EX | LOCK_NB) == 0) {
            fs::remove_all(entry.path(), ignored);
        }
        ::close(folder);
    }
}

}  // namespace

void refuse_write_protected(const fs::path& path) {
    std::error_code error;
    const fs::file_status status = fs::status(path, error);
    if (fs::is_regular_file(status) &&
        ((status.permissions() & kAnyWrite) == fs::perms::none || ::access(path.c_str(), W_OK) != 0)) {
        refuse(path, "it is write-protected");
    }
}

void write_whole_file(const fs::path& path, const std::string& text) {
    std::error_code error;
    const fs::file_status status = fs::status(path, error);
    if (fs::is_directory(status)) {
        refuse(path, "it is a folder");
    }
    // Standard output sent to a file is a regular file, but to replace it would lose what else is printed there.
    if (fs::exists(status) && (!fs::is_regular_file(status) || fs::equivalent(path, "/dev/stdout", error))) {
        write_directly(path, text);
        return;
    }
    refuse_write_protected(path);
    replace_file(path, without_links(path), text, status);
}

StagedFolder::StagedFolder(const fs::path& target) {
    if (target.empty()) {
        throw InputError("the name of the output folder is empty; name a folder, or . for this one");
    }
    target_ = fs::absolute(target).lexically_normal();
    if (!target_.has_filename()) {
        target_ = target_.parent_path();  // a trailing slash
    }
    std::error_code error;
    const bool is_other = fs::exists(target_, error) && !fs::is_directory(target_, error);
    created_target_ = !is_other && fs::create_directory(target_, error);
    if (error || is_other) {
        const std::string why = is_other ? "it is a file" : error.message();
        throw InputError(
            fmt::format("cannot use output folder {}: {}; create its parent or choose another", target.string(), why));
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
    lock_ = ::open(staging_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    ::flock(lock_, LOCK_EX | LOCK_NB);
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
        if (fs::exists(status) && !fs::is_regular_file(status)) {
            throw InputError(fmt::format("cannot write {}: it is no regular file; remove what is in the way", to.string()));
        }
        refuse_write_protected(to);
        moves.push_back({entry.path(), without_links(to)});
    }
    for (const Move& move : moves) {
        std::error_code error;
        fs::rename(move.from, move.to, error);
        if (error) {
            throw InputError(fmt::format("cannot write {}: {}; remove what is in the way", move.to.string(), error.message()));
        }
    }
    published_ = true;
}

StagedFolder::~StagedFolder() {
    std::error_code ignored;
    fs::remove_all(staging_, ignored);
    if (lock_ >= 0) {
        ::close(lock_);
    }
    if (created_target_ && !published_) {
        fs::remove(target_, ignored);  // only if nothing else has come to lie in it
    }
}

}  // namespace tricoil::host
