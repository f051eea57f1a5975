#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <cmath>

#include "core/linear/eigen.hpp"
#include "sim/dense_algebra.hpp"

namespace tricoil {

Eigen::VectorXd singular_values(const Eigen::MatrixXd& a) { return Eigen::JacobiSVD<Eigen::MatrixXd>(a).singularValues(); }

Mat3<double> nearest_rotation(const Mat3<double>& m) {
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(eigen(m), Eigen::ComputeFullU | Eigen::ComputeFullV);
    const Mat3<double>& u = svd.matrixU();
    const Mat3<double>& v = svd.matrixV();
    const double sign = (u * v.transpose()).determinant() < 0 ? -1 : 1;
    return u * Vec3<double>(1, 1, sign).asDiagonal() * v.transpose();
}

Similarity fit_similarity(const Eigen::Matrix3Xd& from, const Eigen::Matrix3Xd& to) {
    const Eigen::Matrix4d m = Eigen::umeyama(from, to, true);
    Similarity s;
    s.scale = std::cbrt(m.topLeftCorner<3, 3>().determinant());
    s.rotation = m.topLeftCorner<3, 3>() / s.scale;
    s.translation = m.topRightCorner<3, 1>();
    return s;
}

}  // namespace tricoil
