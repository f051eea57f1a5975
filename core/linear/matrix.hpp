// Fixed-size matrices and vectors. Each operation computes its result at once: there are no expression types.
// Sums and products add terms from last to first, t0 + (t1 + (t2 + ...)), decompositions as written: all machines agree in bits.
#pragma once

#include <concepts>
#include <type_traits>

#include "core/linear/dense.hpp"

namespace tricoil {

/// A matrix type of another library (see linear/eigen.hpp), from which matrices are constructed entry by entry.
template <typename M>
concept ForeignMatrix = requires(const M& m) {
    { M::RowsAtCompileTime } -> std::convertible_to<int>;
    m.eval().coeff(0, 0);
};

/// Owns its entries. The default constructor leaves them undefined, Matrix{} sets them to zero.
template <typename Scalar_, int Rows, int Columns, Order Storage>
class Matrix : public Dense<Matrix<Scalar_, Rows, Columns, Storage>> {
    using Base = Dense<Matrix>;

public:
    using Scalar = Scalar_;
    static constexpr int kSize = Rows * Columns;

    constexpr Matrix() = default;
    constexpr Matrix(const Matrix&) = default;
    constexpr Matrix& operator=(const Matrix&) = default;
    template <typename B>
    constexpr Matrix& operator=(const Dense<B>& b) {  // which may be a part of this matrix
        return *this = Matrix(b);
    }
    /// The entries of a vector.
    template <typename... E>
    requires(sizeof...(E) == kSize && kSize >= 2 && (Rows == 1 || Columns == 1) &&
             (std::convertible_to<E, Scalar> && ...)) constexpr Matrix(const E&... entries)
        : entries_{static_cast<Scalar>(entries)...} {}
    constexpr explicit Matrix(const Scalar* entries) {
        for (int n = 0; n < kSize; ++n) {
            entries_[n] = entries[n];
        }
    }
    template <typename B>
    requires(Dense<B>::kRows == Rows && Dense<B>::kColumns == Columns) constexpr Matrix(const Dense<B>& b) {
        this->assign([&](int i, int j) -> const Scalar& { return b(i, j); });
    }
    /// A column from a row, and a row from a column.
    template <typename B>
    requires(Dense<B>::kRows == Columns && Dense<B>::kColumns == Rows && Rows != Columns &&
             (Rows == 1 || Columns == 1)) constexpr Matrix(const Dense<B>& b)
        : Matrix(b.transpose()) {}
    constexpr Matrix(const DiagonalMatrix<Scalar, Rows>& d) {
        this->setZero();
        this->diagonal() = d.entries;
    }
    template <ForeignMatrix M>
    requires((int{M::RowsAtCompileTime} == Rows || int{M::RowsAtCompileTime} < 0) &&
             (int{M::ColsAtCompileTime} == Columns || int{M::ColsAtCompileTime} < 0)) Matrix(const M& m) {
        const auto& value = m.eval();
        this->assign([&](int i, int j) { return value.coeff(i, j); });
    }

    constexpr Scalar* data() { return entries_; }
    constexpr const Scalar* data() const { return entries_; }
    constexpr Scalar* begin() { return entries_; }
    constexpr Scalar* end() { return entries_ + kSize; }
    constexpr const Scalar* begin() const { return entries_; }
    constexpr const Scalar* end() const { return entries_ + kSize; }

private:
    Scalar entries_[kSize];
};

/// A part of a matrix, which must outlive it. Assignment changes that matrix; the right side may overlap.
template <typename Element_, int Rows, int Columns, int RowStep, int ColumnStep>
class Block : public Dense<Block<Element_, Rows, Columns, RowStep, ColumnStep>> {
    using Base = Dense<Block>;

public:
    constexpr explicit Block(Element_* first) : first_(first) {}
    constexpr Block(const Block&) = default;
    constexpr Block& operator=(const Block& b) { return *this = typename Base::Plain(b); }
    template <typename B>
    constexpr Block& operator=(const Dense<B>& b) {
        return *this = typename Base::Plain(b);
    }
    constexpr Block& operator=(const typename Base::Plain& b) {
        return this->assign([&](int i, int j) -> const auto& { return b(i, j); });
    }
    constexpr Element_* data() const { return first_; }

    /// Of a vector.
    class Iterator {
    public:
        constexpr explicit Iterator(Element_* at) : at_(at) {}
        constexpr Element_& operator*() const { return *at_; }
        constexpr Iterator& operator++() {
            at_ += Base::kStep;
            return *this;
        }
        constexpr bool operator==(const Iterator&) const = default;

    private:
        Element_* at_;
    };
    constexpr Iterator begin() const { return Iterator(first_); }
    constexpr Iterator end() const { return Iterator(first_ + Base::kSize * Base::kStep); }

private:
    Element_* first_;
};

/// Operations on each column.
template <typename Element_, int Rows, int Columns, int RowStep, int ColumnStep>
class ColumnsOf {
    using Scalar = std::remove_const_t<Element_>;
    using Row = Matrix<Scalar, 1, Columns>;

public:
    constexpr explicit ColumnsOf(Element_* first) : matrix_(first) {}
    constexpr Row norm() const {
        return each([](const auto& column) { return column.norm(); });
    }
    constexpr Row squaredNorm() const {
        return each([](const auto& column) { return column.squaredNorm(); });
    }
    constexpr Row sum() const {
        return each([](const auto& column) { return column.sum(); });
    }
    constexpr Row mean() const {
        return each([](const auto& column) { return column.mean(); });
    }
    template <typename B>
    constexpr void operator=(const Dense<B>& column) {
        for (int j = 0; j < Columns; ++j) {
            matrix_.col(j) = column;
        }
    }
    template <typename B>
    constexpr void operator+=(const Dense<B>& column) {
        for (int j = 0; j < Columns; ++j) {
            matrix_.col(j) += column;
        }
    }
    template <typename B>
    constexpr void operator-=(const Dense<B>& column) {
        *this += -column;
    }
    template <typename B>
    constexpr Matrix<Scalar, Rows, Columns> operator-(const Dense<B>& column) const {
        Matrix<Scalar, Rows, Columns> difference = matrix_;
        difference.colwise() -= column;
        return difference;
    }

private:
    template <typename F>
    constexpr Row each(F f) const {
        return Row::NullaryExpr([&](int, int j) { return f(matrix_.col(j)); });
    }

    Block<Element_, Rows, Columns, RowStep, ColumnStep> matrix_;
};

template <typename Scalar_, int N>
struct DiagonalMatrix {
    Matrix<Scalar_, N, 1> entries;
};

/// Fills a matrix row after row.
template <typename Derived>
class CommaInput {
    using D = Dense<Derived>;

public:
    constexpr explicit CommaInput(Derived& matrix) : matrix_(matrix) {}
    template <std::convertible_to<typename D::Scalar> T>
    constexpr CommaInput& put(const T& value) {
        return put(Matrix<typename D::Scalar, 1, 1>::Constant(static_cast<typename D::Scalar>(value)));
    }
    template <typename B>
    constexpr CommaInput& put(const Dense<B>& b) {
        if (column_ == D::kColumns) {
            column_ = 0;
            row_ += height_;
        }
        height_ = Dense<B>::kRows;
#pragma GCC unroll 6
        for (int j = 0; j < Dense<B>::kColumns; ++j) {
#pragma GCC unroll 6
            for (int i = 0; i < Dense<B>::kRows; ++i) {
                matrix_(row_ + i, column_ + j) = b(i, j);
            }
        }
        column_ += Dense<B>::kColumns;
        return *this;
    }
    template <typename T>
    constexpr CommaInput& operator,(const T& value) {
        return put(value);
    }
    constexpr Derived& finished() { return matrix_; }

private:
    Derived& matrix_;
    int row_ = 0;
    int column_ = 0;
    int height_ = 1;
};

template <typename A, typename B>
constexpr typename Dense<A>::Plain operator+(const Dense<A>& a, const Dense<B>& b) {
    using Scalar = typename Dense<A>::Scalar;
    return a.binaryExpr(b, [](Scalar p, Scalar q) -> Scalar { return p + q; });
}
template <typename A, typename B>
constexpr typename Dense<A>::Plain operator-(const Dense<A>& a, const Dense<B>& b) {
    using Scalar = typename Dense<A>::Scalar;
    return a.binaryExpr(b, [](Scalar p, Scalar q) -> Scalar { return p - q; });
}
template <typename A>
constexpr typename Dense<A>::Plain operator*(const Dense<A>& a, typename Dense<A>::Scalar factor) {
    using Scalar = typename Dense<A>::Scalar;
    return a.unaryExpr([factor](Scalar p) -> Scalar { return p * factor; });
}
template <typename A>
constexpr typename Dense<A>::Plain operator*(typename Dense<A>::Scalar factor, const Dense<A>& a) {
    return a * factor;
}
template <typename A>
constexpr typename Dense<A>::Plain operator/(const Dense<A>& a, typename Dense<A>::Scalar divisor) {
    using Scalar = typename Dense<A>::Scalar;
    return a.unaryExpr([divisor](Scalar p) -> Scalar { return p / divisor; });
}
template <typename A, typename B>
constexpr Matrix<typename Dense<A>::Scalar, Dense<A>::kRows, Dense<B>::kColumns> operator*(const Dense<A>& a, const Dense<B>& b) {
    using Scalar = typename Dense<A>::Scalar;
    constexpr int kInner = Dense<A>::kColumns;
    static_assert(kInner == Dense<B>::kRows);
    Matrix<Scalar, Dense<A>::kRows, Dense<B>::kColumns> m;
    m.template assign<kInner>([&](int i, int j) {
        Scalar sum = a(i, kInner - 1) * b(kInner - 1, j);
#pragma GCC unroll 16
        for (int k = kInner - 2; k >= 0; --k) {
            sum = a(i, k) * b(k, j) + sum;
        }
        return sum;
    });
    return m;
}
template <typename S, typename B>
constexpr typename Dense<B>::Plain operator*(const DiagonalMatrix<S, Dense<B>::kRows>& d, const Dense<B>& b) {
    return Dense<B>::NullaryExpr([&](int i, int j) { return d.entries(i) * b(i, j); });
}
template <typename S, typename A>
constexpr typename Dense<A>::Plain operator*(const Dense<A>& a, const DiagonalMatrix<S, Dense<A>::kColumns>& d) {
    return Dense<A>::NullaryExpr([&](int i, int j) { return a(i, j) * d.entries(j); });
}

/// Writes the entries row after row.
template <typename A>
constexpr void copy_rows(const Dense<A>& a, typename Dense<A>::Scalar* out) {
    for (int i = 0; i < Dense<A>::kRows; ++i) {
        for (int j = 0; j < Dense<A>::kColumns; ++j) {
            *out++ = a(i, j);
        }
    }
}

template <typename Scalar>
using Vec3 = Matrix<Scalar, 3, 1>;
template <typename Scalar>
using Mat3 = Matrix<Scalar, 3, 3>;
template <typename Scalar>
using Vec6 = Matrix<Scalar, 6, 1>;
template <typename Scalar>
using Mat6 = Matrix<Scalar, 6, 6>;

}  // namespace tricoil
