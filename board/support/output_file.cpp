#include "board/support/output_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>

#include "board/support/errors.hpp"
#include "board/support/terminal_text.hpp"

namespace tricoil::host {
namespace fs = std::filesystem;

namespace {

constexpr std::size_t kBufferBytes = std::size_t{64} << 10U;
constexpr int kMaxLinks = 40;        // as in the kernel
constexpr unsigned kPrivate = 0600;  // a file with these permissions never gets those of an older one
constexpr fs::perms kAnyWrite = fs::perms::owner_write | fs::perms::group_write | fs::perms::others_write;

[[noreturn]] void refuse(const fs::path& path, const std::string& reason) {
    throw InputError(fmt::format("cannot write {}: {}; choose another file or folder", path.string(), reason));
}

/// Target of symbolic links; the target file need not exist. Throws InputError for unresolvable links.
fs::path without_links(const fs::path& path) {
    fs::path place = path;
    std::error_code error;
    for (int links = 0; fs::is_symlink(place, error); ++links) {
        if (links == kMaxLinks) {
            refuse(path, "broken symbolic link");
        }
        place = place.parent_path() / fs::read_symlink(place, error);  // an absolute target replaces the parent
    }
    return place;
}

/// Throws InputError if `path` is an existing file without write permission, also for root.
void refuse_write_protected(const fs::path& path) {
    std::error_code error;
    const fs::file_status status = fs::status(path, error);
    if (fs::is_regular_file(status) &&
        ((status.permissions() & kAnyWrite) == fs::perms::none || ::access(path.c_str(), W_OK) != 0)) {
        refuse(path, "it is write-protected");
    }
}

/// Flushes the folder, so that a renamed file survives a power failure. Errors are ignored: some file systems do not support it.
void sync_folder_of(const fs::path& place) {
    const fs::path folder = place.has_parent_path() ? place.parent_path() : fs::path(".");
    const drivers::FileDescriptor opened(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
    (void)::fsync(opened.get());
}

}  // namespace

OutputFile::OutputFile(const fs::path& path, unsigned mode) : path_(path) {
    if (path == kStandardOutput) {
        path_ = "standard output";
        open_standard_output();
        print_text_to_standard_error();
        return;
    }
    std::error_code error;
    const fs::file_status status = fs::status(path, error);
    if (fs::is_directory(status)) {
        refuse(path, "it is a folder");
    }
    // If standard output is redirected to this file, replacing the file would lose the other output.
    const bool is_stdout = mode != kPrivate && fs::exists(status) && fs::equivalent(path, "/dev/stdout", error);
    if (is_stdout) {
        open_standard_output();
    } else if (fs::exists(status) && !fs::is_regular_file(status)) {
        file_.reset(::open(path.c_str(), O_WRONLY | O_CLOEXEC));
    } else {
        refuse_write_protected(path);
        place_ = without_links(path);
        open_aside(mode);
    }
    if (file_.get() < 0) {
        refuse(path, std::strerror(errno));
    }
}

void OutputFile::open_standard_output() {
    std::fflush(stdout);
    file_.reset(::fcntl(STDOUT_FILENO, F_DUPFD_CLOEXEC, 0));
    if (file_.get() < 0) {
        refuse(path_, std::strerror(errno));
    }
}

void OutputFile::open_aside(unsigned mode) {
    aside_ = place_;
    aside_ += fmt::format(".part-{}", ::getpid());
    (void)::unlink(aside_.c_str());  // left by a killed program with the same process number
    file_.reset(::open(aside_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, mode));
    struct stat old {};
    if (mode != kPrivate && file_.get() >= 0 && ::stat(place_.c_str(), &old) == 0) {
        (void)::fchmod(file_.get(), old.st_mode & 07777U);
    }
}

void write_private_file(const fs::path& path, std::string_view text) {
    OutputFile file(path, kPrivate);
    file.write(text);
    file.commit();
}

OutputFile::~OutputFile() {
    if (!aside_.empty()) {
        (void)::unlink(aside_.c_str());
    }
}

void OutputFile::fail() const {
    throw DeviceError(
        fmt::format("{}: could not be written completely ({}); is the disk full?", path_.string(), std::strerror(errno)));
}

void OutputFile::write(std::string_view text) {
    buffer_ += text;
    if (buffer_.size() >= kBufferBytes) {
        flush();
    }
}

void OutputFile::replace(std::size_t at, std::string_view text) {
    flush();
    if (!aside_.empty()) {  // a regular file
        (void)::lseek(file_.get(), static_cast<off_t>(at), SEEK_SET);
        buffer_ = text;
        flush();
        (void)::lseek(file_.get(), 0, SEEK_END);
    }
}

void OutputFile::flush() {
    for (std::size_t done = 0; done < buffer_.size();) {
        const ssize_t n = ::write(file_.get(), buffer_.data() + done, buffer_.size() - done);
        if (n < 0 && errno != EINTR) {
            fail();
        }
        done += n > 0 ? static_cast<std::size_t>(n) : 0;
    }
    buffer_.clear();
}

void OutputFile::commit() {
    flush();
    if (aside_.empty()) {
        return;
    }
    if (::fsync(file_.get()) != 0) {
        fail();
    }
    if (::rename(aside_.c_str(), place_.c_str()) != 0) {
        refuse(path_, std::strerror(errno));
    }
    aside_.clear();
    sync_folder_of(place_);
}

void write_whole_file(const fs::path& path, const std::string& text) {
    OutputFile file(path);
    file.write(text);
    file.commit();
}

}  // namespace tricoil::host
