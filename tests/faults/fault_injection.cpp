// Preloaded into a program: makes one call of the C library fail, or delays all calls of the file system.
//
// TRICOIL_FAULT="CALL:COUNT:ERRNO:PATH": the COUNT-th (from 1) call of CALL (open, read, write, fsync, rename, close) on a file
// whose path contains PATH fails with the number ERRNO, and so do all later calls; with "CALL!" only that call fails.
// TRICOIL_FAULT="delay:MS:0:PATH": every call on a path that contains PATH begins MS milliseconds later. Also those are delayed
// that never fail.
#include <dirent.h>
#include <dlfcn.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <sys/uio.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstdarg>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>
#include <string_view>
#include <thread>

namespace {

constexpr const char* kDelay = "delay";

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
    if ((f.call != call && f.call != kDelay) || path.find(f.path) == std::string_view::npos) {
        return false;
    }
    if (f.call == kDelay) {
        std::this_thread::sleep_for(std::chrono::milliseconds(f.count));
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
    if (fault().call != call && fault().call != kDelay) {
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

ssize_t pwrite(int descriptor, const void* data, std::size_t size, off_t at) {
    static const auto real = next<ssize_t (*)(int, const void*, std::size_t, off_t)>("pwrite");
    return fails("write", descriptor) ? -1 : real(descriptor, data, size, at);
}

ssize_t writev(int descriptor, const iovec* parts, int count) {
    static const auto real = next<ssize_t (*)(int, const iovec*, int)>("writev");
    return fails("write", descriptor) ? -1 : real(descriptor, parts, count);
}

int fsync(int descriptor) {
    static const auto real = next<int (*)(int)>("fsync");
    return fails("fsync", descriptor) ? -1 : real(descriptor);
}

int close(int descriptor) {
    static const auto real = next<int (*)(int)>("close");
    const bool has_failed = fails("close", descriptor);  // before the path of the descriptor is lost
    const int result = real(descriptor);
    if (has_failed) {
        errno = fault().error;
    }
    return has_failed ? -1 : result;
}

int fdatasync(int descriptor) {
    static const auto real = next<int (*)(int)>("fdatasync");
    return fails("fsync", descriptor) ? -1 : real(descriptor);
}

// Calls that are only delayed.

int stat(const char* path, struct stat* result) {
    static const auto real = next<int (*)(const char*, struct stat*)>("stat");
    (void)fails("stat", path);
    return real(path, result);
}

int lstat(const char* path, struct stat* result) {
    static const auto real = next<int (*)(const char*, struct stat*)>("lstat");
    (void)fails("stat", path);
    return real(path, result);
}

int statvfs(const char* path, struct statvfs* result) {
    static const auto real = next<int (*)(const char*, struct statvfs*)>("statvfs");
    (void)fails("stat", path);
    return real(path, result);
}

int access(const char* path, int mode) {
    static const auto real = next<int (*)(const char*, int)>("access");
    (void)fails("stat", path);
    return real(path, mode);
}

int mkdir(const char* path, mode_t mode) {
    static const auto real = next<int (*)(const char*, mode_t)>("mkdir");
    (void)fails("mkdir", path);
    return real(path, mode);
}

int unlink(const char* path) {
    static const auto real = next<int (*)(const char*)>("unlink");
    (void)fails("unlink", path);
    return real(path);
}

DIR* opendir(const char* path) {
    static const auto real = next<DIR* (*)(const char*)>("opendir");
    (void)fails("opendir", path);
    return real(path);
}

std::FILE* fopen64(const char* path, const char* mode) {
    static const auto real = next<std::FILE* (*)(const char*, const char*)>("fopen64");
    (void)fails("fopen", path);
    return real(path, mode);
}

int ftruncate(int descriptor, off_t size) {
    static const auto real = next<int (*)(int, off_t)>("ftruncate");
    (void)fails("ftruncate", descriptor);
    return real(descriptor, size);
}

int rename(const char* from, const char* to) {
    static const auto real = next<int (*)(const char*, const char*)>("rename");
    return fails("rename", to) ? -1 : real(from, to);
}
}
