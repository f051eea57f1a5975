// Parts of matrices refer to the entries that Eigen's parts refer to.
#include <utility>

#include "core/linear/eigen.hpp"
#include "tests/unit/linear/oracle.hpp"

namespace tricoil {
namespace {

template <typename Scalar>
class LinearParts : public Linear<Scalar> {};
TYPED_TEST_SUITE(LinearParts, Scalars);

TYPED_TEST(LinearParts, PartsReferToTheSameEntries) {
    using Scalar = TypeParam;
    auto a = this->template random<6, 9>();
    Oracle<Scalar> ea = oracle(a);
    const auto expect_both = [&](auto part) {
        expect_same(part(std::as_const(a)), part(std::as_const(ea)));
        part(a) *= Scalar(-2);
        part(ea) *= Scalar(-2);
        expect_same(a, ea);
        part(a).setConstant(Scalar(0.7));
        part(ea).setConstant(Scalar(0.7));
        expect_same(a, ea);
        a = this->template random<6, 9>();
        ea = oracle(a);
    };
    expect_both([](auto& m) { return m.row(4); });
    expect_both([](auto& m) { return m.col(7); });
    expect_both([](auto& m) { return m.template block<2, 3>(1, 5); });
    expect_both([](auto& m) { return m.template topLeftCorner<2, 3>(); });
    expect_both([](auto& m) { return m.template topRightCorner<2, 3>(); });
    expect_both([](auto& m) { return m.template bottomLeftCorner<2, 3>(); });
    expect_both([](auto& m) { return m.template bottomRightCorner<2, 3>(); });
    expect_both([](auto& m) { return m.template topRows<2>(); });
    expect_both([](auto& m) { return m.template middleRows<2>(3); });
    expect_both([](auto& m) { return m.template bottomRows<2>(); });
    expect_both([](auto& m) { return m.template leftCols<4>(); });
    expect_both([](auto& m) { return m.template middleCols<4>(2); });
    expect_both([](auto& m) { return m.template rightCols<4>(); });
    expect_both([](auto& m) { return m.transpose(); });
    expect_both([](auto& m) { return m.diagonal(); });
    expect_both([](auto& m) { return m.col(3).template segment<2>(1); });
    expect_both([](auto& m) { return m.row(3).template head<4>(); });
    expect_both([](auto& m) { return m.row(3).template tail<4>(); });
    expect_both([](auto& m) { return m.transpose().row(2).template tail<3>(); });
    expect_same(a.reshaped(), ea.reshaped());
    a.template leftCols<3>() = Matrix<Scalar, 6, 3>(a.template middleCols<3>(1));
    ea.template leftCols<3>() = ea.template middleCols<3>(1).eval();
    expect_same(a, ea);
    a.template topLeftCorner<6, 6>() = a.template topLeftCorner<6, 6>().transpose();  // overlaps
    ea.template topLeftCorner<6, 6>() = ea.template topLeftCorner<6, 6>().transpose().eval();
    expect_same(a, ea);
    a.colwise() -= a.col(2);
    ea.colwise() -= ea.col(2).eval();
    expect_same(a, ea);
}

TYPED_TEST(LinearParts, CommasFillRowAfterRow) {
    using Scalar = TypeParam;
    const auto block = this->template random<2, 2>();
    const auto column = this->template random<2, 1>();
    const auto row = this->template random<1, 3>();
    Mat3<Scalar> a;
    Oracle<Scalar> ea(3, 3);
    a << block, column, row;
    ea << oracle(block), oracle(column), oracle(row);
    expect_same(a, ea);
    a << 1, 2, 3, 4, 5, 6, 7, 8, 9;
    ea << 1, 2, 3, 4, 5, 6, 7, 8, 9;
    expect_same(a, ea);
}

TYPED_TEST(LinearParts, EigenSharesTheMemory) {
    using Scalar = TypeParam;
    auto columns = this->template random<3, 4>();
    Matrix<Scalar, 3, 4, Order::by_rows> rows = columns;
    EXPECT_EQ(eigen(columns).data(), columns.data());
    EXPECT_EQ(eigen(std::as_const(columns)).data(), columns.data());
    EXPECT_EQ(eigen(rows).data(), rows.data());
    EXPECT_EQ(columns.data() + 1, &columns(1, 0));
    EXPECT_EQ(rows.data() + 1, &rows(0, 1));
    expect_same(columns, rows);
    expect_same(columns, Oracle<Scalar>(eigen(columns)));
    expect_same(rows, Oracle<Scalar>(eigen(rows)));
    eigen(rows)(2, 1) = Scalar(77);
    EXPECT_EQ(rows(2, 1), Scalar(77));
    Quaternion<Scalar> q(1, 2, 3, 4);
    EXPECT_EQ(eigen(q).coeffs().data(), q.coeffs().data());
    EXPECT_EQ(eigen(q).w(), Scalar(1));
    EXPECT_EQ(eigen(q).z(), Scalar(4));
    eigen(q).x() = Scalar(9);
    EXPECT_EQ(q.x(), Scalar(9));
    const Quaternion<Scalar> back = Eigen::Quaternion<Scalar>(1, 2, 3, 4);
    expect_same(back.coeffs(), Matrix<Scalar, 4, 1>(2, 3, 4, 1));
    const Matrix<Scalar, 3, 4> from_expression = Scalar(2) * eigen(rows);
    expect_same(from_expression, rows * Scalar(2));
    const Matrix<Scalar, 3, 4, Order::by_rows> from_dynamic =
        Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic>(eigen(columns));
    expect_same(from_dynamic, columns);
    EigenMatrix<Scalar, 3, 4, Order::by_columns> theirs = eigen(columns);
    const EigenMatrix<Scalar, 3, 4, Order::by_rows> theirs_by_rows = eigen(columns);
    EXPECT_EQ(view(theirs).data(), theirs.data());
    expect_same(view(theirs), columns);
    expect_same(view(theirs_by_rows), columns);
    view(theirs).col(2).setZero();
    EXPECT_TRUE(theirs.col(2).isZero(0));
    expect_same(columns.row(1), Oracle<Scalar>(eigen(columns.row(1))));
}

}  // namespace
}  // namespace tricoil
