// Output file that is written completely or not at all.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "drivers/posix/file_descriptor.hpp"

namespace tricoil::host {

/// Path of the standard output.
constexpr const char* kStandardOutput = "-";

/// Writes a temporary file beside `path`; commit() renames it to the target of `path`, following symbolic links. Without commit()
/// the temporary file is removed and an older file stays unchanged. A pipe, terminal, device, or file that is the standard output
/// is written directly and never replaced. "-" is the standard output; then print_text() prints to standard error.
class OutputFile {
public:
    /// mode: permissions of a new file; 0600: also if it replaces an older one. Throws InputError, naming the path, if it is a
    /// folder or write-protected, or the file cannot be created.
    explicit OutputFile(const std::filesystem::path& path, unsigned mode = 0666);
    ~OutputFile();

    /// Throws DeviceError, naming the path, if the text cannot be written.
    void write(std::string_view text);
    /// Replaces bytes that were written before, unless the file is written directly. Throws DeviceError like write().
    void replace(std::size_t at, std::string_view text);
    /// Writes buffered text. Throws DeviceError like write().
    void flush();
    /// Flushes to the disk and renames. Throws DeviceError like write(), InputError if the file cannot be renamed.
    void commit();

private:
    void open_standard_output();
    void open_aside(unsigned mode);
    [[noreturn]] void fail() const;

    std::filesystem::path path_;   // as given by the user
    std::filesystem::path place_;  // without symbolic links
    std::filesystem::path aside_;  // temporary file; empty: written directly
    drivers::FileDescriptor file_;
    std::string buffer_;
};

/// Replaces the file, or the target of a symbolic link, by a new one with `text` that only this user can read.
void write_private_file(const std::filesystem::path& path, std::string_view text);

/// Writes `text` through an OutputFile and throws like it.
void write_whole_file(const std::filesystem::path& path, const std::string& text);

}  // namespace tricoil::host
