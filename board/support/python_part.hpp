// Files of the program beside its executable, and what it hands over to Python.
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <string>
#include <vector>

#include "drivers/posix/file_descriptor.hpp"

namespace tricoil::host {

constexpr const char* kPython = "/usr/bin/python3";  // for which the package is built

/// A file of ../libexec/tricoil from the folder of this executable. `user`: for the message of the DeviceError, without /proc.
std::filesystem::path program_part(const char* name, const std::string& user);

/// Without a name; closed if there is no space.
drivers::FileDescriptor temporary_file();

/// Starts a program with these words, the first of which is its name. Returns -1 if the system has no room for it.
pid_t start_program(const std::string& path, std::vector<std::string> words, int out, int err);

/// Arrays (NumPy, MAT) as a table, which the Python package makes; closed for other files. Throws InputError if the file is
/// damaged, DeviceError without Python.
drivers::FileDescriptor table_of_arrays(const std::string& path);

/// The same, and the text of a file in UTF-16, for readers of plain text: a LineReader reads UTF-16 itself.
drivers::FileDescriptor plain_text_of(const std::string& path);

}  // namespace tricoil::host
