// Preloaded into a program: makes one call of the C library fail.
//
// TRICOIL_FAULT="CALL:COUNT:ERRNO:PATH": the COUNT-th (from 1) call of CALL (open, read, write, fsync, rename) on a file whose
// path contains PATH fails with the number ERRNO, and so do all later calls; with "CALL!" only that call fails.
#include <dlfcn.h>
#include <fcntl.h>
#include <sys/uio.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <cstdarg>
#include <cstdlib>
#include <cstring>
#include <string>
#include <string_view>

namespace {

struct Fault {
    std::string call;
    long count = 0;
    int error = 0;
    std::string path;
    bool once = false;
};

/// Text up to the next colon, which is removed with it.
std::string take(std::string_view& rest) {
    const auto end = rest.find(':');
    const std::string part(rest.substr(0, end));
    rest.remove_prefix(end == std::string_view::npos ? rest.size() : end + 1);
    return part;
}

const Fault& fault() {
    static const Fault wanted = [] {
        Fault f;
        if (const char* text = std::getenv("TRICOIL_FAULT"); text != nullptr) {
            std::string_view rest = text;
            f.call = take(rest);
            f.once = f.call.ends_with('!');
            f.call.resize(f.call.size() - (f.once ? 1 : 0));
            f.count = std::atol(take(rest).c_str());
            f.error = std::atoi(take(rest).c_str());
            f.path = rest;
        }
        return f;
    }();
    return wanted;
}

bool fails(const char* call, std::string_view path) {
    static std::atomic<long> seen = 0;
    const Fault& f = fault();
    if (f.call != call || path.find(f.path) == std::string_view::npos) {
        return false;
    }
    const long now = ++seen;
    if (f.once ? now != f.count : now < f.count) {
        return false;
    }
    errno = f.error;
    return true;
}

bool fails(const char* call, int descriptor) {
    if (fault().call != call) {
        return false;
    }
    const int before = errno;
    std::array<char, 4096> path{};
    const ssize_t n = ::readlink(("/proc/self/fd/" + std::to_string(descriptor)).c_str(), path.data(), path.size());
    errno = before;
    return n > 0 && fails(call, std::string_view(path.data(), static_cast<std::size_t>(n)));
}

template <typename Function>
Function next(const char* name) {
    return reinterpret_cast<Function>(::dlsym(RTLD_NEXT, name));  // NOLINT: dlsym returns void*
}

}  // namespace

extern "C" {

int open(const char* path, int flags, ...) {  // NOLINT: its own form
    va_list arguments;
    va_start(arguments, flags);
    const unsigned mode = va_arg(arguments, unsigned);
    va_end(arguments);
    static const auto real = next<int (*)(const char*, int, ...)>("open");
    return fails("open", path) ? -1 : real(path, flags, mode);
}

int open64(const char* path, int flags, ...) {  // NOLINT: its own form
    va_list arguments;
    va_start(arguments, flags);
    const unsigned mode = va_arg(arguments, unsigned);
    va_end(arguments);
    static const auto real = next<int (*)(const char*, int, ...)>("open64");
    return fails("open", path) ? -1 : real(path, flags, mode);
}

ssize_t read(int descriptor, void* data, std::size_t size) {
    static const auto real = next<ssize_t (*)(int, void*, std::size_t)>("read");
    return fails("read", descriptor) ? -1 : real(descriptor, data, size);
}

ssize_t write(int descriptor, const void* data, std::size_t size) {
    static const auto real = next<ssize_t (*)(int, const void*, std::size_t)>("write");
    return fails("write", descriptor) ? -1 : real(descriptor, data, size);
}

ssize_t writev(int descriptor, const iovec* parts, int count) {
    static const auto real = next<ssize_t (*)(int, const iovec*, int)>("writev");
    return fails("write", descriptor) ? -1 : real(descriptor, parts, count);
}

int fsync(int descriptor) {
    static const auto real = next<int (*)(int)>("fsync");
    return fails("fsync", descriptor) ? -1 : real(descriptor);
}

int fdatasync(int descriptor) {
    static const auto real = next<int (*)(int)>("fdatasync");
    return fails("fsync", descriptor) ? -1 : real(descriptor);
}

int rename(const char* from, const char* to) {
    static const auto real = next<int (*)(const char*, const char*)>("rename");
    return fails("rename", to) ? -1 : real(from, to);
}
}
