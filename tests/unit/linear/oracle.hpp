// Eigen as the oracle of core/linear. oracle.cpp compiles its operations once; the tests that include this header compile without
// Eigen.
#pragma once

#include <vector>

#include "core/linear/matrix.hpp"

namespace tricoil {

/// A matrix whose operations are Eigen's, in double. Results of single operations on entries, rounded to float, have the bits of
/// the operation in float (Figueroa 1995, "When is double rounding innocuous?").
class Oracle {
public:
    Oracle(Index rows, Index columns) : rows_(rows), entries_(rows * columns) {}
    template <typename D>
    explicit Oracle(const Dense<D>& m) : Oracle(m.rows(), m.cols()) {
        for (int n = 0; n < m.size(); ++n) {
            entries_[n] = m(n % m.rows(), n / m.rows());
        }
    }
    static Oracle Constant(Index rows, Index columns, double value);
    static Oracle Identity(Index rows, Index columns);
    static Oracle Unit(Index rows, Index k);

    [[nodiscard]] Index rows() const { return rows_; }
    [[nodiscard]] Index cols() const { return size() / rows_; }
    [[nodiscard]] Index size() const { return static_cast<Index>(entries_.size()); }
    double* data() { return entries_.data(); }
    [[nodiscard]] const double* data() const { return entries_.data(); }
    double operator()(Index n) const { return entries_[n]; }  // column after column

    Oracle operator-() const;
    Oracle operator+(const Oracle& b) const;
    Oracle operator-(const Oracle& b) const;
    Oracle operator*(double factor) const;
    Oracle operator/(double divisor) const;
    Oracle operator*(const Oracle& b) const;
    bool operator==(const Oracle& b) const;
    [[nodiscard]] Oracle cwiseProduct(const Oracle& b) const;
    [[nodiscard]] Oracle cwiseQuotient(const Oracle& b) const;
    [[nodiscard]] Oracle cwiseMax(const Oracle& b) const;
    [[nodiscard]] Oracle cwiseMin(const Oracle& b) const;
    [[nodiscard]] Oracle cwiseAbs() const;
    [[nodiscard]] Oracle cwiseAbs2() const;
    [[nodiscard]] Oracle cwiseSqrt() const;
    [[nodiscard]] Oracle cwiseInverse() const;
    [[nodiscard]] Oracle transpose() const;
    [[nodiscard]] Oracle asDiagonal() const;
    [[nodiscard]] Oracle in_float() const;
    [[nodiscard]] bool allFinite() const;
    [[nodiscard]] bool isZero(double tolerance) const;
    [[nodiscard]] bool isIdentity(double tolerance) const;

    [[nodiscard]] double maxCoeff() const;
    [[nodiscard]] double minCoeff() const;
    double maxCoeff(Index* index) const;  // of a column, as the next
    double minCoeff(Index* index) const;
    [[nodiscard]] double sum() const;
    [[nodiscard]] double mean() const;
    [[nodiscard]] double trace() const;
    [[nodiscard]] double squaredNorm() const;
    [[nodiscard]] double norm() const;
    [[nodiscard]] double dot(const Oracle& b) const;
    [[nodiscard]] Oracle normalized() const;
    [[nodiscard]] Oracle stableNormalized() const;
    [[nodiscard]] Oracle sums_of_columns() const;
    [[nodiscard]] Oracle means_of_columns() const;
    [[nodiscard]] Oracle norms_of_columns() const;
    [[nodiscard]] Oracle squared_norms_of_columns() const;

    // Parts.
    [[nodiscard]] Oracle row(Index i) const;
    [[nodiscard]] Oracle col(Index j) const;
    [[nodiscard]] Oracle block(Index i, Index j, Index rows, Index columns) const;
    [[nodiscard]] Oracle topLeftCorner(Index rows, Index columns) const;
    [[nodiscard]] Oracle topRightCorner(Index rows, Index columns) const;
    [[nodiscard]] Oracle bottomLeftCorner(Index rows, Index columns) const;
    [[nodiscard]] Oracle bottomRightCorner(Index rows, Index columns) const;
    [[nodiscard]] Oracle topRows(Index n) const;
    [[nodiscard]] Oracle middleRows(Index i, Index n) const;
    [[nodiscard]] Oracle bottomRows(Index n) const;
    [[nodiscard]] Oracle leftCols(Index n) const;
    [[nodiscard]] Oracle middleCols(Index j, Index n) const;
    [[nodiscard]] Oracle rightCols(Index n) const;
    [[nodiscard]] Oracle segment(Index i, Index n) const;  // of a column, as the next two
    [[nodiscard]] Oracle head(Index n) const;
    [[nodiscard]] Oracle tail(Index n) const;
    [[nodiscard]] Oracle diagonal() const;
    [[nodiscard]] Oracle reshaped() const;
    [[nodiscard]] Oracle plus_to_columns(const Oracle& column) const;
    [[nodiscard]] Oracle repeated_column(Index columns) const;

    // Of 3x3, and columns of three.
    [[nodiscard]] Oracle cross(const Oracle& b) const;
    [[nodiscard]] double determinant() const;
    [[nodiscard]] Oracle inverse() const;
    [[nodiscard]] double largest_eigenvalue() const;  // of a symmetric matrix

    // Of quaternions, which are columns x, y, z, w.
    static Oracle quaternion(const Oracle& rotation);
    [[nodiscard]] Oracle conjugate() const;
    [[nodiscard]] Oracle times(const Oracle& q) const;
    [[nodiscard]] Oracle rotate(const Oracle& vector) const;
    [[nodiscard]] Oracle slerp(double t, const Oracle& q) const;
    [[nodiscard]] Oracle toRotationMatrix() const;

private:
    Index rows_;
    std::vector<double> entries_;
};

struct CholeskyOracle {
    explicit CholeskyOracle(const Oracle& a);

    bool ok;
    Oracle lower;
    Oracle inverse_of_lower;
};

}  // namespace tricoil
