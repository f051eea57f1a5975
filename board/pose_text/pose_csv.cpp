#include "board/pose_text/pose_csv.hpp"

#include <fmt/format.h>

#include <array>
#include <utility>

#include "board/pose_text/pose_fields.hpp"
#include "core/base/angle_units.hpp"

namespace tricoil::host {
namespace {

std::string header(const OutputFormat& format) {
    std::string angles;
    if (format.euler) {
        angles = fmt::format(",euler_{0}_1_deg,euler_{0}_2_deg,euler_{0}_3_deg", format.euler_name);
    }
    return fmt::format(
        "{0},{1},true_x_{2},true_y_{2},true_z_{2},true_qw,true_qx,true_qy,true_qz,error_position_m,"
        "error_orientation_rad{3}\n",
        pose_column_names(format.unit), kPredictedErrorNames, format.unit, angles);
}

std::string fields(const Vec3<double>& v) { return fmt::format("{:.7f},{:.7f},{:.7f}", v.x(), v.y(), v.z()); }

std::string fields(const Quat<double>& q) { return fmt::format("{:.8f},{:.8f},{:.8f},{:.8f}", q.w(), q.x(), q.y(), q.z()); }

tracking::PoseEstimate<double> pose_of(std::uint8_t sensor, const TruePose& truth) {
    tracking::PoseEstimate<double> e;
    e.sensor = sensor;
    e.position_m = truth.position_m;
    e.q_source_sensor = truth.q_source_sensor;
    return e;
}

}  // namespace

PoseCsv::PoseCsv(const std::string& path, OutputFormat format) : file_(path), format_(std::move(format)) {
    file_.write(header(format_));
}

void PoseCsv::write(const tracking::PoseEstimate<double>& estimate, const TruePose& true_pose) {
    if (format_.boresight_first && estimate.valid()) {
        tracking::boresight(format_.frame, estimate.q_source_sensor);
        format_.boresight_first = false;
    }
    const auto e = tracking::in_frame(format_.tips.at_tip(estimate), format_.frame);
    const auto truth = tracking::in_frame(format_.tips.at_tip(pose_of(estimate.sensor, true_pose)), format_.frame);
    const double scale = format_.units_per_m;
    std::array<char, kLongestPoseText> numbers{};
    std::string line(numbers.data(), put_csv(numbers_of(e, scale), numbers));
    line += ',';
    line += e.predicted_error ? fmt::format("{:.4f},{:.5f},", 1e3 * e.predicted_error->total.position_m,
                                            kDegrees * e.predicted_error->total.rotation_rad)
                              : std::string(",,");  // no error budget yet
    // Errors of the reported point, which is the tip if a tip offset is set.
    const double error_m = (e.position_m - truth.position_m).norm();
    line += fmt::format("{},{},{:.4e},{:.4e}", fields(scale * truth.position_m), fields(truth.q_source_sensor), error_m,
                        geometry::angle_between(estimate.q_source_sensor, true_pose.q_source_sensor));
    if (format_.euler) {
        const Vec3<double> angles = geometry::euler_angles<double>(e.q_source_sensor, *format_.euler) * kDegrees;
        line += fmt::format(",{:.5f},{:.5f},{:.5f}", angles(0), angles(1), angles(2));
    }
    line += '\n';
    file_.write(line);
}

}  // namespace tricoil::host
