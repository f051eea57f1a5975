// Example of a program that uses Eigen: poses in the frame of a table.
#include <cstdio>

#include <Eigen/Geometry>

#include <tricoil/core/tracking/pose_estimate.hpp>
#include <tricoil/eigen.hpp>

using namespace tricoil;

/// Pose of the sensor in the table's frame. eigen() refers to the estimate's numbers.
Eigen::Isometry3f on_table(const Eigen::Isometry3f& source_on_table, const tracking::PoseEstimate<float>& pose) {
    return source_on_table * Eigen::Translation3f(eigen(pose.position_m)) * eigen(pose.q_source_sensor);
}

int main() {
    tracking::PoseEstimate<float> pose;  // as a tracker returns it
    const Eigen::Vector3f known_m(0.1F, 0.2F, 0.3F);
    pose.position_m = view(known_m);                                                               // refers to known_m
    pose.q_source_sensor = Eigen::Quaternionf(Eigen::AngleAxisf(0.5F, Eigen::Vector3f::UnitZ()));  // copies four numbers

    Eigen::Isometry3f source_on_table = Eigen::Isometry3f::Identity();
    source_on_table.translate(Eigen::Vector3f(1, 0, 0));
    const Eigen::Vector3f p = on_table(source_on_table, pose).translation();
    const Eigen::Matrix3f covariance = eigen(pose.covariance).topLeftCorner<3, 3>();

    std::printf("on the table: %.3f %.3f %.3f m, trace of the covariance %.1f\n", p.x(), p.y(), p.z(), covariance.trace());
    return (p - Eigen::Vector3f(1.1F, 0.2F, 0.3F)).norm() < 1e-6F ? 0 : 1;
}
