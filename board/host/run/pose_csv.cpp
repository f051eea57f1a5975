#include "board/host/run/pose_csv.hpp"

#include <fmt/format.h>

#include <cerrno>
#include <cmath>
#include <cstring>

#include "board/host/errors.hpp"
#include "board/host/figures/whole_file.hpp"

namespace tricoil::host {
namespace {

constexpr const char* kHeader =
    "sequence,time_us,x_m,y_m,z_m,qw,qx,qy,qz,std_x_m,std_y_m,std_z_m,std_rx_rad,std_ry_rad,std_rz_rad,valid,flags,state,"
    "distortion_chi_square,snr_db,predicted_error_mm,predicted_error_deg,true_x_m,true_y_m,true_z_m,true_qw,true_qx,true_qy,true_"
    "qz,error_position_m,"
    "error_orientation_rad\n";

std::string fields(const Vec3<double>& v) { return fmt::format("{:.7f},{:.7f},{:.7f}", v.x(), v.y(), v.z()); }

std::string fields(const Quat<double>& q) { return fmt::format("{:.8f},{:.8f},{:.8f},{:.8f}", q.w(), q.x(), q.y(), q.z()); }

}  // namespace

PoseCsv::PoseCsv(const std::string& path) : path_(path) {
    refuse_write_protected(path);
    file_ = std::fopen(path.c_str(), "w");  // through links, and to pipes and devices as they are
    if (file_ == nullptr) {
        throw InputError(fmt::format("{}: cannot be written ({}); choose another --out", path, std::strerror(errno)));
    }
    failed_ = std::fputs(kHeader, file_) < 0;
}

PoseCsv::~PoseCsv() {
    if (file_ != nullptr) {
        std::fclose(file_);
    }
}

void PoseCsv::write(const tracking::PoseEstimate<double>& e, const PoseError& error) {
    const Vec6<double> deviation = e.covariance.diagonal().cwiseSqrt();
    std::string line = fmt::format("{},{},{},{},", e.sequence, to_us(e.time), fields(e.position_m), fields(e.q_source_sensor));
    for (const double value : deviation) {
        line += fmt::format("{:.4e},", value);
    }
    line += fmt::format("{:d},{},{},{:.3f},{:.2f},", e.valid(), e.flags.bits(), static_cast<int>(e.state),
                        e.distortion_chi_square, e.snr_db);
    line += e.predicted_error
                ? fmt::format("{:.4f},{:.5f},", e.predicted_error->total.position_mm, e.predicted_error->total.orientation_deg)
                : std::string(",,");  // not known yet
    line += fmt::format("{},{},{:.4e},{:.4e}\n", fields(error.truth.position_m), fields(error.truth.q_source_sensor),
                        error.position_m, error.orientation_rad);
    failed_ = failed_ || std::fwrite(line.data(), 1, line.size(), file_) != line.size();
}

void PoseCsv::close() {
    if (file_ == nullptr) {
        return;
    }
    failed_ = std::fclose(file_) != 0 || failed_;
    file_ = nullptr;
    if (failed_) {
        throw DeviceError(path_ + ": could not be written completely; is the disk full?");
    }
}

}  // namespace tricoil::host
