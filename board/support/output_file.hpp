// A file that is written whole or not at all.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "drivers/posix/file_descriptor.hpp"

namespace tricoil::host {

/// Writes beside `path`; commit() renames it into place, through symbolic links to where they lead. Without commit() nothing is
/// left of it, and an older file stays as it was. What is there and is no regular file (a pipe, a terminal, a device) is written
/// to directly, never replaced; so is a file that is the program's standard output.
class OutputFile {
public:
    /// mode: of a file that is not there yet. Throws InputError, naming the path, if it is a folder or write-protected or the
    /// file cannot be made.
    explicit OutputFile(const std::filesystem::path& path, unsigned mode = 0666);
    ~OutputFile();
    OutputFile(const OutputFile&) = delete;
    OutputFile& operator=(const OutputFile&) = delete;

    /// Throws DeviceError, naming the path, if the disk or device does not take the text.
    void write(std::string_view text);
    /// Flushes to the disk and renames. Throws DeviceError as write() does, InputError if the place cannot be taken.
    void commit();

private:
    void open_aside(unsigned mode);
    void flush();
    [[noreturn]] void fail() const;

    std::filesystem::path path_;   // as the user named it
    std::filesystem::path place_;  // without symbolic links
    std::filesystem::path aside_;  // empty: written to directly
    drivers::FileDescriptor file_;
    std::string buffer_;
};

/// Writes `text` into a new file that this user alone may read, in place of an older one.
void write_private_file(const std::filesystem::path& path, std::string_view text);

/// Throws InputError if `path` is an existing file without permission to write: the owner protects it, root or not.
void refuse_write_protected(const std::filesystem::path& path);

/// Where symbolic links lead, also to a file that is not there yet. Throws InputError for links that lead nowhere.
std::filesystem::path without_links(const std::filesystem::path& path);

}  // namespace tricoil::host
