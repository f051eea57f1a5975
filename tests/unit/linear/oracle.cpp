#include "tests/unit/linear/oracle.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>

namespace tricoil {
namespace {

using Eigen::MatrixXd;
template <typename M>
using View = Eigen::Map<const M>;

View<MatrixXd> eigen(const Oracle& m) { return {m.data(), m.rows(), m.cols()}; }
View<Eigen::VectorXd> column(const Oracle& m) { return {m.data(), m.size()}; }
View<Eigen::Matrix3d> matrix3(const Oracle& m) { return View<Eigen::Matrix3d>(m.data()); }
View<Eigen::Vector3d> vector3(const Oracle& v) { return View<Eigen::Vector3d>(v.data()); }
View<Eigen::Quaterniond> quaternion_view(const Oracle& q) { return View<Eigen::Quaterniond>(q.data()); }

Oracle oracle(const MatrixXd& m) {
    Oracle copy(m.rows(), m.cols());
    Eigen::Map<MatrixXd>(copy.data(), m.rows(), m.cols()) = m;
    return copy;
}

}  // namespace

Oracle Oracle::Constant(Index rows, Index columns, double value) { return oracle(MatrixXd::Constant(rows, columns, value)); }
Oracle Oracle::Identity(Index rows, Index columns) { return oracle(MatrixXd::Identity(rows, columns)); }
Oracle Oracle::Unit(Index rows, Index k) { return oracle(Eigen::VectorXd::Unit(rows, k)); }

Oracle Oracle::operator-() const { return oracle(-eigen(*this)); }
Oracle Oracle::operator+(const Oracle& b) const { return oracle(eigen(*this) + eigen(b)); }
Oracle Oracle::operator-(const Oracle& b) const { return oracle(eigen(*this) - eigen(b)); }
Oracle Oracle::operator*(double factor) const { return oracle(eigen(*this) * factor); }
Oracle Oracle::operator/(double divisor) const { return oracle(eigen(*this) / divisor); }
Oracle Oracle::operator*(const Oracle& b) const { return oracle(eigen(*this).lazyProduct(eigen(b))); }
bool Oracle::operator==(const Oracle& b) const { return eigen(*this) == eigen(b); }
Oracle Oracle::cwiseProduct(const Oracle& b) const { return oracle(eigen(*this).cwiseProduct(eigen(b))); }
Oracle Oracle::cwiseQuotient(const Oracle& b) const { return oracle(eigen(*this).cwiseQuotient(eigen(b))); }
Oracle Oracle::cwiseMax(const Oracle& b) const { return oracle(eigen(*this).cwiseMax(eigen(b))); }
Oracle Oracle::cwiseMin(const Oracle& b) const { return oracle(eigen(*this).cwiseMin(eigen(b))); }
Oracle Oracle::cwiseAbs() const { return oracle(eigen(*this).cwiseAbs()); }
Oracle Oracle::cwiseAbs2() const { return oracle(eigen(*this).cwiseAbs2()); }
// Eigen's vectorized square root takes denormals for zero.
Oracle Oracle::cwiseSqrt() const {
    return oracle(eigen(*this).unaryExpr([](double x) { return std::sqrt(x); }));
}
Oracle Oracle::cwiseInverse() const { return oracle(eigen(*this).cwiseInverse()); }
Oracle Oracle::transpose() const { return oracle(eigen(*this).transpose()); }
Oracle Oracle::asDiagonal() const { return oracle(column(*this).asDiagonal()); }
Oracle Oracle::in_float() const { return oracle(eigen(*this).cast<float>().cast<double>()); }
bool Oracle::allFinite() const { return eigen(*this).allFinite(); }
bool Oracle::isZero(double tolerance) const { return eigen(*this).isZero(tolerance); }
bool Oracle::isIdentity(double tolerance) const { return eigen(*this).isIdentity(tolerance); }

double Oracle::maxCoeff() const { return eigen(*this).maxCoeff(); }
double Oracle::minCoeff() const { return eigen(*this).minCoeff(); }
double Oracle::maxCoeff(Index* index) const { return column(*this).maxCoeff(index); }
double Oracle::minCoeff(Index* index) const { return column(*this).minCoeff(index); }
double Oracle::sum() const { return eigen(*this).sum(); }
double Oracle::mean() const { return eigen(*this).mean(); }
double Oracle::trace() const { return eigen(*this).trace(); }
double Oracle::squaredNorm() const { return eigen(*this).squaredNorm(); }
double Oracle::norm() const { return eigen(*this).norm(); }
double Oracle::dot(const Oracle& b) const { return column(*this).dot(column(b)); }
Oracle Oracle::normalized() const { return oracle(eigen(*this).normalized()); }
Oracle Oracle::stableNormalized() const { return oracle(eigen(*this).stableNormalized()); }
Oracle Oracle::sums_of_columns() const { return oracle(eigen(*this).colwise().sum()); }
Oracle Oracle::means_of_columns() const { return oracle(eigen(*this).colwise().mean()); }
Oracle Oracle::norms_of_columns() const { return oracle(eigen(*this).colwise().norm()); }
Oracle Oracle::squared_norms_of_columns() const { return oracle(eigen(*this).colwise().squaredNorm()); }

Oracle Oracle::row(Index i) const { return oracle(eigen(*this).row(i)); }
Oracle Oracle::col(Index j) const { return oracle(eigen(*this).col(j)); }
Oracle Oracle::block(Index i, Index j, Index rows, Index columns) const {
    return oracle(eigen(*this).block(i, j, rows, columns));
}
Oracle Oracle::topLeftCorner(Index rows, Index columns) const { return oracle(eigen(*this).topLeftCorner(rows, columns)); }
Oracle Oracle::topRightCorner(Index rows, Index columns) const { return oracle(eigen(*this).topRightCorner(rows, columns)); }
Oracle Oracle::bottomLeftCorner(Index rows, Index columns) const { return oracle(eigen(*this).bottomLeftCorner(rows, columns)); }
Oracle Oracle::bottomRightCorner(Index rows, Index columns) const {
    return oracle(eigen(*this).bottomRightCorner(rows, columns));
}
Oracle Oracle::topRows(Index n) const { return oracle(eigen(*this).topRows(n)); }
Oracle Oracle::middleRows(Index i, Index n) const { return oracle(eigen(*this).middleRows(i, n)); }
Oracle Oracle::bottomRows(Index n) const { return oracle(eigen(*this).bottomRows(n)); }
Oracle Oracle::leftCols(Index n) const { return oracle(eigen(*this).leftCols(n)); }
Oracle Oracle::middleCols(Index j, Index n) const { return oracle(eigen(*this).middleCols(j, n)); }
Oracle Oracle::rightCols(Index n) const { return oracle(eigen(*this).rightCols(n)); }
Oracle Oracle::segment(Index i, Index n) const { return oracle(column(*this).segment(i, n)); }
Oracle Oracle::head(Index n) const { return oracle(column(*this).head(n)); }
Oracle Oracle::tail(Index n) const { return oracle(column(*this).tail(n)); }
Oracle Oracle::diagonal() const { return oracle(eigen(*this).diagonal()); }
Oracle Oracle::reshaped() const { return oracle(eigen(*this).reshaped()); }
Oracle Oracle::plus_to_columns(const Oracle& b) const { return oracle(eigen(*this).colwise() + column(b)); }
Oracle Oracle::repeated_column(Index columns) const { return oracle(column(*this).replicate(1, columns)); }

Oracle Oracle::cross(const Oracle& b) const { return oracle(vector3(*this).cross(vector3(b))); }
double Oracle::determinant() const { return matrix3(*this).determinant(); }
Oracle Oracle::inverse() const { return oracle(matrix3(*this).inverse()); }
double Oracle::largest_eigenvalue() const {
    return Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(matrix3(*this), Eigen::EigenvaluesOnly).eigenvalues()(2);
}

Oracle Oracle::quaternion(const Oracle& rotation) { return oracle(Eigen::Quaterniond(matrix3(rotation)).coeffs()); }
Oracle Oracle::conjugate() const { return oracle(quaternion_view(*this).conjugate().coeffs()); }
Oracle Oracle::times(const Oracle& q) const { return oracle((quaternion_view(*this) * quaternion_view(q)).coeffs()); }
Oracle Oracle::rotate(const Oracle& vector) const { return oracle(quaternion_view(*this) * vector3(vector)); }
Oracle Oracle::slerp(double t, const Oracle& q) const {
    return oracle(quaternion_view(*this).slerp(t, quaternion_view(q)).coeffs());
}
Oracle Oracle::toRotationMatrix() const { return oracle(quaternion_view(*this).toRotationMatrix()); }

CholeskyOracle::CholeskyOracle(const Oracle& a) : ok(false), lower(a), inverse_of_lower(a) {
    const Eigen::LLT<MatrixXd> factors(eigen(a));
    ok = factors.info() == Eigen::Success;
    if (ok) {
        lower = oracle(factors.matrixL());
        inverse_of_lower = oracle(factors.matrixL().solve(MatrixXd::Identity(a.rows(), a.cols())));
    }
}

}  // namespace tricoil
