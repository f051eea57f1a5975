#include "board/pose_text/pose_lines.hpp"

#include <cinttypes>
#include <cstdio>

#include "core/protocol/convert.hpp"

namespace tricoil::host {
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

std::string_view pose_csv_header() { return kHeader; }

std::string_view pose_line(const protocol::PoseMessage& m, PoseFormat format, std::array<char, 512>& buffer) {
    const auto position = [&](std::size_t i) { return m.position[i] / protocol::kPositionPerMetre; };
    const auto quaternion = [&](std::size_t i) { return m.quaternion[i] / protocol::kQuaternionPerUnit; };
    const auto deviation = [&](std::size_t i) { return m.deviation[i] / protocol::kDeviationPerUnit; };
    // NOLINTNEXTLINE(clang-diagnostic-format-nonliteral): one of the two above, with the same conversions
    const int size =
        std::snprintf(buffer.data(), buffer.size(), format == PoseFormat::csv ? kCsv : kJson, m.sequence, m.time_us, m.sensor,
                      position(0), position(1), position(2), quaternion(0), quaternion(1), quaternion(2), quaternion(3),
                      deviation(0), deviation(1), deviation(2), deviation(3), deviation(4), deviation(5), is_valid(m) ? 1 : 0,
                      m.flags, m.tracker_state, 1e-2 * m.distortion, 1e-2 * m.snr_cdb);
    return {buffer.data(), static_cast<std::size_t>(size)};
}

}  // namespace tricoil::host
