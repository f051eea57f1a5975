#include "board/host/figures/whole_file.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>

#include "board/host/errors.hpp"

namespace tricoil::host {
namespace fs = std::filesystem;

void write_whole_file(const fs::path& path, const std::string& text) {
    fs::path aside = path;
    aside += fmt::format(".part-{}", ::getpid());
    std::error_code ignored;
    std::ofstream file(aside, std::ios::binary);
    file << text;
    file.close();
    if (!file) {
        const std::string why = std::strerror(errno);
        fs::remove(aside, ignored);
        throw InputError(fmt::format("cannot write {}: {}; choose another file or folder", path.string(), why));
    }
    std::error_code error;
    fs::rename(aside, path, error);
    if (error) {
        fs::remove(aside, ignored);
        throw InputError(fmt::format("cannot write {}: {}; choose another file or folder", path.string(), error.message()));
    }
}

StagedFolder::StagedFolder(const fs::path& target) : target_(fs::absolute(target).lexically_normal()) {
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
    staging_ = target_ / fmt::format(".unfinished-{}", ::getpid());
    fs::create_directory(staging_, error);
    if (error) {
        if (created_target_) {
            std::error_code ignored;
            fs::remove(target_, ignored);
        }
        throw InputError(fmt::format("cannot write into output folder {}: {}; choose another", target.string(), error.message()));
    }
}

void StagedFolder::publish() {
    for (const auto& entry : fs::directory_iterator(staging_)) {
        std::error_code error;
        fs::rename(entry.path(), target_ / entry.path().filename(), error);
        if (error) {
            throw InputError(fmt::format("cannot write {}: {}; remove what is in the way",
                                         (target_ / entry.path().filename()).string(), error.message()));
        }
    }
    published_ = true;
}

StagedFolder::~StagedFolder() {
    std::error_code ignored;
    fs::remove_all(staging_, ignored);
    if (created_target_ && !published_) {
        fs::remove(target_, ignored);  // only if nothing else has come to lie in it
    }
}

}  // namespace tricoil::host
