// Matrices and quaternions of Eigen and of the core share their entries.
#include "core/linear/eigen.hpp"

#include <utility>

#include "tests/unit/linear/comparison.hpp"

namespace tricoil {
namespace {

class LinearEigen : public Linear<double> {};

template <typename M>
void expect_equal(const M& m, const Eigen::MatrixXd& expected) {
    for (int i = 0; i < expected.rows(); ++i) {
        for (int j = 0; j < expected.cols(); ++j) {
            EXPECT_EQ(m(i, j), expected(i, j));
        }
    }
}

TEST_F(LinearEigen, SeesTheCoresMatrices) {
    auto columns = this->random<3, 4>();
    Matrix<double, 3, 4, Order::by_rows> rows = columns;
    EXPECT_EQ(eigen(columns).data(), columns.data());
    EXPECT_EQ(eigen(std::as_const(columns)).data(), columns.data());
    EXPECT_EQ(eigen(rows).data(), rows.data());
    expect_equal(columns, eigen(columns));
    expect_equal(columns, eigen(std::as_const(rows)));
    expect_equal(columns, eigen(Matrix<double, 3, 4>(columns)));
    expect_equal(columns.bottomRows<2>(), eigen(columns.bottomRows<2>()));
    eigen(rows)(2, 1) = 77;
    EXPECT_EQ(rows(2, 1), 77);
    const Matrix<double, 3, 4> from_expression = 2 * eigen(columns);
    expect_same(from_expression, columns * 2.0);
    const Matrix<double, 3, 4, Order::by_rows> from_dynamic = Eigen::MatrixXd(eigen(columns));
    expect_same(from_dynamic, columns);
}

TEST_F(LinearEigen, MatricesAreSeenByTheCore) {
    const auto columns = this->random<3, 4>();
    EigenMatrix<double, 3, 4, Order::by_columns> theirs = eigen(columns);
    const EigenMatrix<double, 3, 4, Order::by_rows> theirs_by_rows = eigen(columns);
    EXPECT_EQ(view(theirs).data(), theirs.data());
    expect_same(view(theirs), columns);
    expect_same(view(theirs_by_rows), columns);
    view(theirs).col(2).setZero();
    EXPECT_TRUE(theirs.col(2).isZero(0));
}

TEST_F(LinearEigen, CommasFillRowAfterRow) {
    const auto block = this->random<2, 2>();
    const auto column = this->random<2, 1>();
    const auto row = this->random<1, 3>();
    Mat3<double> a;
    Eigen::Matrix3d expected;
    a << block, column, row;
    expected << eigen(block), eigen(column), eigen(row);
    expect_equal(a, expected);
    a << 1, 2, 3, 4, 5, 6, 7, 8, 9;
    expected << 1, 2, 3, 4, 5, 6, 7, 8, 9;
    expect_equal(a, expected);
}

TEST_F(LinearEigen, QuaternionsShareTheirEntries) {
    Quaternion<double> q(1, 2, 3, 4);
    EXPECT_EQ(eigen(q).coeffs().data(), q.coeffs().data());
    EXPECT_EQ(eigen(std::as_const(q)).coeffs().data(), q.coeffs().data());
    EXPECT_EQ(eigen(std::as_const(q)).w(), 1);
    EXPECT_EQ(eigen(Quaternion<double>(1, 2, 3, 4)).z(), 4);
    eigen(q).x() = 9;
    EXPECT_EQ(q.x(), 9);
    const Quaternion<double> back = Eigen::Quaterniond(1, 2, 3, 4);
    expect_same(back.coeffs(), Matrix<double, 4, 1>(2, 3, 4, 1));
}

}  // namespace
}  // namespace tricoil
