// For programs that use Eigen: eigen() shows matrices and quaternions of the core as Eigen's, view() shows Eigen's matrices as
// parts of core's matrices; neither copies. Besides, a Matrix or Quaternion is constructed from any fixed-size Eigen expression
// or quaternion. Nothing in the core includes this file.
#pragma once

#include <Eigen/Geometry>

#include "core/linear/quaternion.hpp"

namespace tricoil {

template <typename Scalar, int Rows, int Columns, Order Storage>
using EigenMatrix = Eigen::Matrix<Scalar, Rows, Columns,
                                  Columns == 1                                ? int{Eigen::ColMajor}
                                  : Storage == Order::by_columns && Rows != 1 ? int{Eigen::ColMajor}
                                                                              : int{Eigen::RowMajor}>;

/// The entries of `m` as a matrix of Eigen; `m` must outlive the result.
template <typename Scalar, int Rows, int Columns, Order Storage>
Eigen::Map<EigenMatrix<Scalar, Rows, Columns, Storage>> eigen(Matrix<Scalar, Rows, Columns, Storage>& m) {
    return Eigen::Map<EigenMatrix<Scalar, Rows, Columns, Storage>>(m.data());
}
template <typename Scalar, int Rows, int Columns, Order Storage>
Eigen::Map<const EigenMatrix<Scalar, Rows, Columns, Storage>> eigen(const Matrix<Scalar, Rows, Columns, Storage>& m) {
    return Eigen::Map<const EigenMatrix<Scalar, Rows, Columns, Storage>>(m.data());
}
/// Of a temporary: a copy.
template <typename Scalar, int Rows, int Columns, Order Storage>
EigenMatrix<Scalar, Rows, Columns, Storage> eigen(const Matrix<Scalar, Rows, Columns, Storage>&& m) {
    return eigen(m);
}
/// Of a part of a matrix: a copy.
template <typename E, int Rows, int Columns, int RowStep, int ColumnStep>
EigenMatrix<std::remove_const_t<E>, Rows, Columns, Order::by_columns> eigen(
    const Block<E, Rows, Columns, RowStep, ColumnStep>& b) {
    return eigen(typename Block<E, Rows, Columns, RowStep, ColumnStep>::Plain(b));
}
template <typename Scalar>
Eigen::Map<Eigen::Quaternion<Scalar>> eigen(Quaternion<Scalar>& q) {
    return Eigen::Map<Eigen::Quaternion<Scalar>>(q.coeffs().data());
}
template <typename Scalar>
Eigen::Map<const Eigen::Quaternion<Scalar>> eigen(const Quaternion<Scalar>& q) {
    return Eigen::Map<const Eigen::Quaternion<Scalar>>(q.coeffs().data());
}
template <typename Scalar>
Eigen::Quaternion<Scalar> eigen(const Quaternion<Scalar>&& q) {
    return eigen(q);
}

template <typename Element, int Rows, int Columns, bool ByRows>
using EigenView = Block<Element, Rows, Columns, (ByRows ? Columns : 1), (ByRows ? 1 : Rows)>;

/// The entries of a fixed-size matrix of Eigen, which must outlive the result, as a part of a matrix.
template <typename Scalar, int Rows, int Columns, int Options>
auto view(Eigen::Matrix<Scalar, Rows, Columns, Options>& m) {
    return EigenView<Scalar, Rows, Columns, (Options & Eigen::RowMajor) != 0>(m.data());
}
template <typename Scalar, int Rows, int Columns, int Options>
auto view(const Eigen::Matrix<Scalar, Rows, Columns, Options>& m) {
    return EigenView<const Scalar, Rows, Columns, (Options & Eigen::RowMajor) != 0>(m.data());
}
template <typename Scalar, int Rows, int Columns, int Options>
void view(const Eigen::Matrix<Scalar, Rows, Columns, Options>&& m) = delete;  // the result would refer to a temporary

}  // namespace tricoil
