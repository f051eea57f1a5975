#include "board/record/recording.hpp"

#include <fmt/format.h>

#include <array>
#include <filesystem>

#include "board/support/errors.hpp"
#include "core/base/crc32.hpp"

namespace tricoil::host {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kLongestDescription = std::size_t{1} << 20U;

/// Path of a file of a recording, which must be a regular file: a device or a pipe need not have an end.
std::string path_of(const std::string& folder, const char* name) {
    const fs::path path = fs::path(folder) / name;
    std::error_code error;
    const fs::file_status status = fs::status(path, error);
    refuse_if(fs::exists(status) && !fs::is_regular_file(status), "{}: is not a regular file; is this a recording?",
              path.string());
    return path.string();
}

nlohmann::json read_description(const std::string& folder) {
    refuse_if(!fs::is_directory(folder), "{}: {}; give a folder written by --record", folder,
              fs::exists(folder) ? "is not a folder" : "does not exist");
    const std::string path = path_of(folder, kDescriptionFile);
    refuse_if(!fs::exists(path), "{}: does not exist; is this a recording?", path);
    nlohmann::json description = nlohmann::json::parse(read_text(path, kLongestDescription), nullptr, false);
    refuse_if(!description.is_object() || description.value("format", nlohmann::json()) != kRecordingFormat,
              "{}: is not the description of a tricoil recording", path);
    const nlohmann::json version = description.value("version", nlohmann::json());
    if (version != kRecordingVersion && version != kOldestRecordingVersion) {
        throw InputError(fmt::format("{}: recording format version {}; this program reads versions {} and {}", path,
                                     version.dump(), kOldestRecordingVersion, kRecordingVersion));
    }
    return description;
}

}  // namespace

RecordLines::RecordLines(const std::string& folder, RecordFile file)
    : path_(path_of(folder, kRecordFiles[static_cast<std::size_t>(file)])), reader_(path_) {
    std::string header;
    const std::string& known = record_headers()[static_cast<std::size_t>(file)];
    const std::string_view old = file == RecordFile::inputs ? old_input_header() : std::string_view(known);
    if (next(header) && header != known && header != old) {  // a killed program may leave an empty file
        throw InputError(path_ + ":1: wrong header");
    }
    added_ = header == known ? "" : kUnknownLevels;
}

bool RecordLines::next(std::string& line) {
    if (!reader_.next_whole(line)) {
        return false;
    }
    line += added_;
    return true;
}

Recording::Recording(const std::string& folder, const std::function<void()>& each_block)
    : folder_(folder), description_(read_description(folder)) {
    const std::string path = (fs::path(folder) / kDescriptionFile).string();
    if (const auto trackers = description_.value("trackers", nlohmann::json()); !trackers.is_null()) {
        settings_ = settings_from_json(trackers, path + ": trackers");
    }
    complete_ = description_.value("complete", nlohmann::json()) == true;
    if (!complete_) {
        return;
    }
    const auto files = description_.value("files", nlohmann::json());
    for (const char* name : kRecordFiles) {
        refuse_if(!files.is_object() || !files.contains(name), "{}: files.{} is missing", path, name);
        check_file(name, files[name], each_block);
    }
}

void Recording::refuse_as_output(const std::string& path) const {
    std::error_code error;
    const fs::path within = fs::weakly_canonical(path, error).lexically_relative(fs::weakly_canonical(folder_, error));
    refuse_if(!within.empty() && *within.begin() != "..", "{}: lies in the folder of the recording; choose another --out", path);
}

void Recording::check_file(const char* name, const nlohmann::json& extent, const std::function<void()>& each_block) const {
    const std::string path = path_of(folder_, name);
    std::ifstream file(path, std::ios::binary);
    if (!file) {
        throw InputError(path + ": cannot be opened; the recording is incomplete");
    }
    std::uint64_t bytes = 0;
    std::uint32_t crc = 0;
    std::array<char, 65536> buffer{};
    while (file.read(buffer.data(), buffer.size()) || file.gcount() > 0) {
        const auto count = static_cast<std::size_t>(file.gcount());
        crc = crc32_continued(crc, {reinterpret_cast<const std::uint8_t*>(buffer.data()), count});  // NOLINT: bytes as such
        bytes += count;
        if (each_block) {
            each_block();
        }
    }
    if (file.bad()) {
        throw DeviceError(path + ": cannot be read to its end; check the disk");
    }
    refuse_if(extent.value("bytes", nlohmann::json()) != bytes || extent.value("crc32", nlohmann::json()) != crc,
              "{}: was changed since it was recorded (size or CRC differ from {})", path, kDescriptionFile);
}

}  // namespace tricoil::host
