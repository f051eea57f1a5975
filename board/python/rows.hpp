// Rows of NumPy structured arrays.
#pragma once

#include <pybind11/numpy.h>

#include <cstdint>

#include "board/host/smooth/smoother.hpp"
#include "core/tracking/pose_estimate.hpp"
#include "sim/motion/motion.hpp"

namespace tricoil::python {

using Array = pybind11::array_t<double, pybind11::array::c_style | pybind11::array::forcecast>;

/// Pose of a tracker. Fields that the C interface has too have its names and units, except time_s.
struct PoseRow {
    double time_s = 0;
    std::uint32_t sequence = 0;
    std::uint16_t flags = 0;
    std::uint8_t sensor = 0;
    bool valid = false;
    double position_m[3]{};
    double quaternion_wxyz[4]{};
    double covariance[6][6]{};  // position (m), then small rotation (rad), source frame
    double couplings[3][3]{};   // sensor coil, source coil
    double distortion_m = 0;
    double snr_db = 0;
    double predicted_error_m = 0;  // NaN: the motion is not known yet
};

struct TruthRow {
    double position_m[3]{};
    double quaternion_wxyz[4]{};
};

/// Solution of one signal matrix.
struct SolutionRow {
    double position_m[3]{};
    double quaternion_wxyz[4]{};
    double covariance[6][6]{};
    double chi_square = 0;  // misfit to a dipole, 3 degrees of freedom
    bool solved = false;
};

/// Pose of the smoother, with rates in the source frame.
struct SmoothedRow {
    double time_s = 0;
    bool valid = false;
    double position_m[3]{};
    double quaternion_wxyz[4]{};
    double covariance[6][6]{};
    double velocity_m_s[3]{};
    double angular_rate_rad_s[3]{};
    double rate_covariance[6][6]{};  // of velocity, then angular rate
};

/// Registers the row types with NumPy. Call it once.
void register_rows();

PoseRow to_row(const tracking::PoseEstimate<double>& estimate);
TruthRow to_row(const sim::Pose& pose);
SmoothedRow to_row(const host::SmoothedPose& smoothed);
void put(const Quat<double>& q, double (&wxyz)[4]);
void put(const Vec3<double>& v, double (&xyz)[3]);
void put(const Mat6<double>& m, double (&rows)[6][6]);

/// Array of one dimension that owns the rows, without a copy.
template <typename Row>
pybind11::array_t<Row> to_array(std::vector<Row>&& rows) {
    auto* const owned = new std::vector<Row>(std::move(rows));
    const pybind11::capsule owner(owned, [](void* p) { delete static_cast<std::vector<Row>*>(p); });
    return pybind11::array_t<Row>(static_cast<pybind11::ssize_t>(owned->size()), owned->data(), owner);
}

}  // namespace tricoil::python
