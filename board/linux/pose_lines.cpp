#include "board/linux/pose_writer.hpp"

#include <array>
#include <cerrno>
#include <cinttypes>
#include <cstring>

#include "board/host/errors.hpp"
#include "core/protocol/convert.hpp"

namespace tricoil::linux_board {
namespace {

constexpr const char* kHeader =
    "sequence,time_us,sensor,x_m,y_m,z_m,qw,qx,qy,qz,std_x_m,std_y_m,std_z_m,std_rx_rad,std_ry_rad,std_rz_rad,valid,flags,state,"
    "distortion_chi_square,snr_db\n";
constexpr const char* kCsv =
    "%" PRIu32 ",%" PRId64 ",%u,%.7f,%.7f,%.7f,%.9f,%.9f,%.9f,%.9f,%.7f,%.7f,%.7f,%.7f,%.7f,%.7f,%d,%u,%u,%.2f,%.2f\n";
constexpr const char* kJson = "{\"sequence\":%" PRIu32 ",\"time_us\":%" PRId64
                              ",\"sensor\":%u,\"position_m\":[%.7f,%.7f,%.7f],\"q_wxyz\":[%.9f,%.9f,%.9f,%.9f],\"std_m_rad\":[%."
                              "7f,%.7f,%.7f,%.7f,%.7f,%.7f],"
                              "\"valid\":%d,\"flags\":%u,\"state\":%u,\"distortion_chi_square\":%.2f,\"snr_db\":%.2f}\n";

bool is_valid(const protocol::PoseMessage& pose) { return (pose.flags & tracking::kInvalidating.bits()) == 0; }

}  // namespace

PoseWriter::PoseWriter(std::FILE* stream, PoseFormat format) : file_(stream), format_(format) {}

PoseWriter::PoseWriter(const std::string& path, PoseFormat format) : path_(path), owned_(true), format_(format) {
    file_ = std::fopen(path.c_str(), "w");
    if (file_ == nullptr) {
        throw host::InputError(path + ": cannot be written (" + std::strerror(errno) + "); choose another file");
    }
    failed_ = format_ == PoseFormat::csv && std::fputs(kHeader, file_) < 0;
}

PoseWriter::~PoseWriter() {
    if (owned_ && file_ != nullptr) {
        std::fclose(file_);
    }
}

void PoseWriter::write(const protocol::PoseMessage& m) {
    const auto position = [&](std::size_t i) { return m.position[i] / protocol::kPositionPerMetre; };
    const auto quaternion = [&](std::size_t i) { return m.quaternion[i] / protocol::kQuaternionPerUnit; };
    const auto deviation = [&](std::size_t i) { return m.deviation[i] / protocol::kDeviationPerUnit; };
    std::array<char, 512> line{};
    // NOLINTNEXTLINE(clang-diagnostic-format-nonliteral): one of the two above, with the same conversions
    const int size =
        std::snprintf(line.data(), line.size(), format_ == PoseFormat::csv ? kCsv : kJson, m.sequence, m.time_us, m.sensor,
                      position(0), position(1), position(2), quaternion(0), quaternion(1), quaternion(2), quaternion(3),
                      deviation(0), deviation(1), deviation(2), deviation(3), deviation(4), deviation(5), is_valid(m) ? 1 : 0,
                      m.flags, m.tracker_state, 1e-2 * m.distortion, 1e-2 * m.snr_cdb);
    const auto bytes = static_cast<std::size_t>(size);
    failed_ = failed_ || std::fwrite(line.data(), 1, bytes, file_) != bytes;
}

void PoseWriter::close() {
    if (file_ == nullptr) {
        return;
    }
    failed_ = (owned_ ? std::fclose(file_) : std::fflush(file_)) != 0 || failed_;
    file_ = nullptr;
    if (failed_) {
        throw host::DeviceError((path_.empty() ? std::string("standard output") : path_) +
                                ": poses could not be written completely; is the disk full?");
    }
}

}  // namespace tricoil::linux_board
