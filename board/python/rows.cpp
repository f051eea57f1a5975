#include "board/python/rows.hpp"

#include <limits>

namespace tricoil::python {

void put(const Quat<double>& q, double (&wxyz)[4]) {
    wxyz[0] = q.w();
    wxyz[1] = q.x();
    wxyz[2] = q.y();
    wxyz[3] = q.z();
}

void put(const Vec3<double>& v, double (&xyz)[3]) { copy_rows(v, xyz); }

void put(const Mat6<double>& m, double (&rows)[6][6]) { copy_rows(m, &rows[0][0]); }

PoseRow to_row(const tracking::PoseEstimate<double>& estimate) {
    PoseRow row;
    row.time_s = to_seconds(estimate.time);
    row.sequence = estimate.sequence;
    row.flags = static_cast<std::uint16_t>(estimate.flags.bits());
    row.sensor = estimate.sensor;
    row.valid = estimate.valid();
    put(estimate.position_m, row.position_m);
    put(estimate.q_source_sensor, row.quaternion_wxyz);
    put(estimate.covariance, row.covariance);
    copy_rows(estimate.signal_matrix, &row.couplings[0][0]);
    row.distortion_m = estimate.distortion_m;
    row.snr_db = estimate.snr_db;
    row.predicted_error_m =
        estimate.predicted_error ? estimate.predicted_error->total.position_m : std::numeric_limits<double>::quiet_NaN();
    return row;
}

TruthRow to_row(const sim::Pose& pose) {
    TruthRow row;
    put(pose.position_m, row.position_m);
    put(pose.q_source_sensor, row.quaternion_wxyz);
    return row;
}

SmoothedRow to_row(const host::SmoothedPose& smoothed) {
    SmoothedRow row;
    row.time_s = to_seconds(smoothed.pose.time);
    row.valid = smoothed.pose.valid();
    put(smoothed.pose.position_m, row.position_m);
    put(smoothed.pose.q_source_sensor, row.quaternion_wxyz);
    put(smoothed.pose.covariance, row.covariance);
    put(smoothed.velocity_m_s, row.velocity_m_s);
    put(smoothed.rate_rad_s, row.angular_rate_rad_s);
    put(smoothed.rate_covariance, row.rate_covariance);
    return row;
}

void register_rows() {
    PYBIND11_NUMPY_DTYPE(PoseRow, time_s, sequence, flags, sensor, valid, position_m, quaternion_wxyz, covariance, couplings,
                         distortion_m, snr_db, predicted_error_m);
    PYBIND11_NUMPY_DTYPE(TruthRow, position_m, quaternion_wxyz);
    PYBIND11_NUMPY_DTYPE(SolutionRow, position_m, quaternion_wxyz, covariance, chi_square, solved);
    PYBIND11_NUMPY_DTYPE(SmoothedRow, time_s, valid, position_m, quaternion_wxyz, covariance, velocity_m_s, angular_rate_rad_s,
                         rate_covariance);
}

}  // namespace tricoil::python
