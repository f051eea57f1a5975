#include "board/support/python_part.hpp"

#include <dlfcn.h>
#include <sys/wait.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <fstream>
#include <initializer_list>
#include <memory>
#include <string_view>

#include "board/support/errors.hpp"
#include "board/support/line_reader.hpp"

namespace tricoil::host {

std::filesystem::path program_part(const char* name, const std::string& user) {
    std::error_code failure;
    const auto own = std::filesystem::read_symlink("/proc/self/exe", failure).parent_path();
    if (failure) {
        throw DeviceError(user + ": cannot find the folder of this program: mount /proc");
    }
    return (own / (own.filename() == "tricoil" ? "." : "../libexec/tricoil") / name).lexically_normal();
}

namespace {

constexpr int kMostFiles = 1024;  // that may be open here
using Marks = std::initializer_list<std::string_view>;

/// False for a pipe, which would lose what is read.
bool begins_with(const std::string& path, Marks marks) {
    std::error_code failure;
    std::string begin(8, '\0');
    return std::filesystem::is_regular_file(path, failure) && std::ifstream(path, std::ios::binary).read(begin.data(), 8) &&
           std::any_of(marks.begin(), marks.end(), [&](std::string_view mark) { return begin.starts_with(mark); });
}

}  // namespace

drivers::FileDescriptor temporary_file() {
    const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::tmpfile(), std::fclose);
    return drivers::FileDescriptor(file ? ::dup(::fileno(file.get())) : -1);
}

pid_t start_program(const std::string& path, std::vector<std::string> words, int out, int err) {
    std::vector<char*> arguments;
    for (std::string& word : words) {
        arguments.push_back(word.data());
    }
    arguments.push_back(nullptr);
    const pid_t child = ::fork();
    if (child == 0) {
        ::dup2(out, STDOUT_FILENO);
        ::dup2(err, STDERR_FILENO);
        for (int file = STDERR_FILENO + 1; file < kMostFiles; ++file) {
            ::close(file);
        }
        ::execv(path.c_str(), arguments.data());
        ::_exit(127);
    }
    return child;
}

drivers::FileDescriptor table_of_arrays(const std::string& path) {
    if (!begins_with(path, {"\x93NUMPY", "PK\x03\x04", "MATLAB ", "\x89HDF\r\n"})) {
        return {};
    }
    drivers::FileDescriptor table = temporary_file();
    Dl_info own{};
    ::dladdr(reinterpret_cast<const void*>(&table_of_arrays), &own);
    const std::filesystem::path object(own.dli_fname);
    const bool is_package = object.filename().string().starts_with("_tricoil.");  // the Python module
    const std::string python = is_package ? std::filesystem::read_symlink("/proc/self/exe").string() : kPython;
    const std::string script = is_package ? object.parent_path() / "_program.py" : program_part("_program.py", path);
    const pid_t child =
        table.is_open() ? start_program(python, {python, "-I", script, "table", "--", path}, table.get(), table.get()) : -1;
    int status = -1;
    while (child > 0 && ::waitpid(child, &status, 0) < 0 && errno == EINTR) {
    }
    if (status != 0) {
        std::string said;
        LineReader(path, table.is_open() ? fmt::format("/proc/self/fd/{}", table.get()) : "/dev/null").next(said);
        refuse_if(said.starts_with("tricoil: "), "{}", said.substr(9));
        throw DeviceError(path + ": NumPy and MAT files need the package python3-tricoil; or save a table as CSV");
    }
    return table;
}

drivers::FileDescriptor plain_text_of(const std::string& path) {
    if (!begins_with(path, {"\xFF\xFE", "\xFE\xFF"})) {
        return table_of_arrays(path);
    }
    drivers::FileDescriptor text = temporary_file();
    std::ofstream out(fmt::format("/proc/self/fd/{}", text.get()));
    LineReader lines(path);
    for (std::string line; lines.next(line);) {
        out << line << '\n';
    }
    if (!out.flush()) {
        throw DeviceError(path + ": there is no space for its text in the folder of temporary files");
    }
    return text;
}

}  // namespace tricoil::host
