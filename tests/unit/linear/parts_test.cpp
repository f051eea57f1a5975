// Parts of matrices refer to the entries that Eigen's parts refer to. One scalar type: a part has no arithmetic of its own.
#include <algorithm>
#include <utility>

#include "tests/unit/linear/comparison.hpp"

namespace tricoil {
namespace {

using M = Matrix<double, 6, 9>;

class LinearParts : public Linear<double> {
protected:
    LinearParts() {
        for (int n = 0; n < a_.size(); ++n) {
            a_.data()[n] = n + 1;
        }
    }
    /// The part has the expected entries, and changing it changes those of the matrix, whose entries all differ.
    template <typename Part>
    void check(Part part, const Oracle& expected) {
        M a = a_;
        expect_same(part(std::as_const(a)), expected);
        expect_same(part(a), expected);
        part(a) *= -1;
        for (int n = 0; n < a.size(); ++n) {
            const double* end = expected.data() + expected.size();
            const bool belongs = std::find(expected.data(), end, a_.data()[n]) != end;
            EXPECT_EQ(a.data()[n], belongs ? -a_.data()[n] : a_.data()[n]);
        }
    }
    M a_;
};

TEST_F(LinearParts, OfMatrices) {
    const Oracle e(a_);
    check([](auto& m) { return m.row(4); }, e.row(4));
    check([](auto& m) { return m.col(7); }, e.col(7));
    check([](auto& m) { return m.template block<2, 3>(1, 5); }, e.block(1, 5, 2, 3));
    check([](auto& m) { return m.template topLeftCorner<2, 3>(); }, e.topLeftCorner(2, 3));
    check([](auto& m) { return m.template topRightCorner<2, 3>(); }, e.topRightCorner(2, 3));
    check([](auto& m) { return m.template bottomLeftCorner<2, 3>(); }, e.bottomLeftCorner(2, 3));
    check([](auto& m) { return m.template bottomRightCorner<2, 3>(); }, e.bottomRightCorner(2, 3));
    check([](auto& m) { return m.template topRows<2>(); }, e.topRows(2));
    check([](auto& m) { return m.template middleRows<2>(3); }, e.middleRows(3, 2));
    check([](auto& m) { return m.template bottomRows<2>(); }, e.bottomRows(2));
    check([](auto& m) { return m.template leftCols<4>(); }, e.leftCols(4));
    check([](auto& m) { return m.template middleCols<4>(2); }, e.middleCols(2, 4));
    check([](auto& m) { return m.template rightCols<4>(); }, e.rightCols(4));
    check([](auto& m) { return m.transpose(); }, e.transpose());
    check([](auto& m) { return m.diagonal(); }, e.diagonal());
    check([](auto& m) { return m.reshaped(); }, e.reshaped());
}

TEST_F(LinearParts, OfParts) {
    const Oracle e(a_);
    check([](auto& m) { return m.col(3).template segment<2>(1); }, e.col(3).segment(1, 2));
    check([](auto& m) { return m.row(3).template head<4>(); }, e.row(3).head(4).transpose());
    check([](auto& m) { return m.row(3).template tail<4>(); }, e.row(3).tail(4).transpose());
    check([](auto& m) { return m.transpose().row(2).template tail<3>(); }, e.col(2).tail(3).transpose());
    check([](auto& m) { return m.row(1).reshaped(); }, e.row(1).reshaped());
}

TEST_F(LinearParts, EntriesOfVectors) {
    const auto row = std::as_const(a_).row(2);
    const Oracle expected = Oracle(a_).row(2);
    for (Index i = 0; i < 9; ++i) {
        EXPECT_EQ(row(i), expected(i));
        EXPECT_EQ(row[i], expected(i));
    }
    expect_same(row.segment<2>(5), Oracle(a_).row(2).reshaped().segment(5, 2).transpose());
    expect_same(row.head<4>(), Oracle(a_).row(2).reshaped().head(4).transpose());
    expect_same(row.tail<4>(), Oracle(a_).row(2).reshaped().tail(4).transpose());
    EXPECT_EQ(row.x(), expected(0));
    EXPECT_EQ(row.y(), expected(1));
    EXPECT_EQ(row.z(), expected(2));
    a_.row(2)(3) = -3;
    a_.row(2)[4] = -4;
    a_.row(2).x() = -5;
    a_.row(2).y() = -6;
    a_.row(2).z() = -7;
    expect_same(row.head<5>(), Matrix<double, 1, 5>(-5, -6, -7, -3, -4));
}

TEST_F(LinearParts, ChangesMayOverlap) {
    const Oracle e(a_);
    const Oracle square = e.leftCols(6);
    M a = a_;
    const auto check_and_reset = [&](const Oracle& columns_1_to_3) {
        expect_same(a.middleCols<3>(1), columns_1_to_3);
        expect_same(a.col(0), e.col(0));
        expect_same(a.rightCols<5>(), e.rightCols(5));
        a = a_;
    };
    a.middleCols<3>(1) = a.leftCols<3>();
    check_and_reset(e.leftCols(3));
    a.middleCols<3>(1) += a.leftCols<3>();
    check_and_reset(e.middleCols(1, 3) + e.leftCols(3));
    a.leftCols<6>() = a.leftCols<6>().transpose();
    expect_same(a.leftCols<6>(), square.transpose());
    a = a_;
    a.leftCols<6>() += a.leftCols<6>().transpose();
    expect_same(a.leftCols<6>(), square + square.transpose());
    expect_same(a.rightCols<3>(), e.rightCols(3));
    Mat6<double> b = a_.leftCols<6>();
    b = b.transpose();
    expect_same(b, square.transpose());
    b.transpose() += b;
    expect_same(b, square + square.transpose());
    Matrix<double, 1, 9> row = a_.row(2);
    row += row;
    expect_same(row, e.row(2) * 2);
}

TEST_F(LinearParts, ColumnsAndRows) {
    const Oracle e(a_);
    const Oracle minus_column = e.plus_to_columns(-e.col(2));
    M a = a_;
    const auto check_and_reset = [&](const Oracle& expected) {
        expect_same(a, expected);
        a = a_;
    };
    a.colwise() = a_.col(2);
    check_and_reset(e.col(2).repeated_column(9));
    a.colwise() += a_.col(2);
    check_and_reset(e.plus_to_columns(e.col(2)));
    a.colwise() -= a_.col(2);
    check_and_reset(minus_column);
    a.rowwise() += a_.row(3).transpose();
    check_and_reset(e.transpose().plus_to_columns(e.row(3)).transpose());
    expect_same(a_.colwise() - a_.col(2), minus_column);
    expect_same(std::as_const(a_).colwise() - a_.col(2), minus_column);
    expect_same(std::as_const(a_).rowwise().sum(), e.transpose().sums_of_columns());
}

TEST_F(LinearParts, EntriesInMemory) {
    using ByRows = Matrix<double, 3, 4, Order::by_rows>;
    const auto columns = this->random<3, 4>();
    ByRows rows = columns;
    EXPECT_EQ(columns.data() + 1, &columns(1, 0));
    EXPECT_EQ(rows.data() + 1, &rows(0, 1));
    expect_same(rows, columns);
    double copied[12];
    copy_rows(columns, copied);
    expect_same(ByRows(copied), columns);
    expect_same(Matrix<double, 3, 4>(columns.data()), columns);
    const auto sum = [](const auto& m) {
        double total = 0;
        for (const double entry : m) {
            total += entry;
        }
        return total;
    };
    const Oracle e(a_);
    EXPECT_EQ(sum(std::as_const(a_)), e.sum());
    EXPECT_EQ(sum(a_.row(2)), e.row(2).sum());
    EXPECT_EQ(sum(a_.diagonal()), e.diagonal().sum());
    for (double& entry : a_) {
        entry = -entry;
    }
    expect_same(a_, -e);
}

TEST_F(LinearParts, VectorsAreRowsOrColumns) {
    const Vec3<double> column(1, 2, 3);
    const Matrix<double, 1, 3> row = column;
    expect_same(row, Oracle(column).transpose());
    expect_same(Vec3<double>(row), Oracle(column));
}

}  // namespace
}  // namespace tricoil
