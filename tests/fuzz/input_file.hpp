// Input of a fuzzer as a file, for readers that take a path.
#pragma once

#include <stdlib.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <string_view>

#include "board/support/errors.hpp"

namespace tricoil::fuzz {

/// Folder of this process, in /dev/shm if that exists. It is removed at the end.
class InputFolder {
public:
    InputFolder() {
        std::string pattern = std::filesystem::exists("/dev/shm") ? "/dev/shm/tricoil-fuzz-XXXXXX" : "/tmp/tricoil-fuzz-XXXXXX";
        if (::mkdtemp(pattern.data()) == nullptr) {
            std::abort();
        }
        path_ = pattern;
    }
    InputFolder(const InputFolder&) = delete;
    InputFolder& operator=(const InputFolder&) = delete;
    ~InputFolder() {
        std::error_code error;
        std::filesystem::remove_all(path_, error);
    }

    [[nodiscard]] const std::string& path() const { return path_; }

    /// Writes a file and returns its path.
    [[nodiscard]] std::string write(const std::string& name, std::string_view content) const {
        std::string path = path_ + "/" + name;
        std::FILE* file = std::fopen(path.c_str(), "wb");
        if (file == nullptr || std::fwrite(content.data(), 1, content.size(), file) != content.size() || std::fclose(file) != 0) {
            std::abort();
        }
        return path;
    }

private:
    std::string path_;
};

/// Writes the newest input to the file `name` and returns its path.
inline std::string input_file(const char* name, std::string_view content) {
    static const InputFolder folder;
    return folder.write(name, content);
}

inline std::string_view text_of(const std::uint8_t* data, std::size_t size) {
    return {reinterpret_cast<const char*>(data), size};  // NOLINT: bytes as text
}

/// Removes the first part of `rest`, up to a separator that no text file holds, and returns it.
inline std::string_view take_part(std::string_view& rest) {
    constexpr char kSeparator = '\x1e';
    const auto end = std::min(rest.find(kSeparator), rest.size());
    const std::string_view part = rest.substr(0, end);
    rest.remove_prefix(std::min(end + 1, rest.size()));
    return part;
}

/// Runs a reader, which accepts its input or throws an InputError with a message.
template <typename Reader>
void accept_or_refuse(Reader&& read) {
    try {
        read();
    } catch (const host::InputError& refusal) {
        if (std::string_view(refusal.what()).empty()) {
            std::abort();
        }
    } catch (const host::DeviceError&) {  // arrays, which Python reads
    }
}

}  // namespace tricoil::fuzz
