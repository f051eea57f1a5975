// Shapes of matrix types, and access to their entries and parts.
#pragma once

#include <concepts>
#include <cstddef>
#include <type_traits>

namespace tricoil {

using Index = std::ptrdiff_t;

enum class Order { by_columns, by_rows };  // of the entries in memory

template <typename Scalar_, int Rows, int Columns, Order Storage = Order::by_columns>
class Matrix;
template <typename Element_, int Rows, int Columns, int RowStep, int ColumnStep>
class Block;
template <typename Element_, int Rows, int Columns, int RowStep, int ColumnStep>
class ColumnsOf;
template <typename Derived>
class CommaInput;
template <typename Scalar_, int N>
struct DiagonalMatrix;

/// Shape of a matrix type, and the distances of neighbouring entries in memory.
template <typename Derived>
struct Layout;
template <typename S, int Rows, int Columns, Order Storage>
struct Layout<Matrix<S, Rows, Columns, Storage>> {
    using Scalar = S;
    using Element = S;
    static constexpr int kRows = Rows;
    static constexpr int kColumns = Columns;
    static constexpr int kRowStep = Storage == Order::by_columns ? 1 : Columns;  // NOLINT(bugprone-branch-clone): vectors
    static constexpr int kColumnStep = Storage == Order::by_columns ? Rows : 1;  // NOLINT(bugprone-branch-clone)
};
template <typename E, int Rows, int Columns, int RowStep, int ColumnStep>
struct Layout<Block<E, Rows, Columns, RowStep, ColumnStep>> {
    using Scalar = std::remove_const_t<E>;
    using Element = E;
    static constexpr int kRows = Rows;
    static constexpr int kColumns = Columns;
    static constexpr int kRowStep = RowStep;
    static constexpr int kColumnStep = ColumnStep;
};

/// Function template that returns a part: of a matrix, and of a constant matrix, whose part is constant.
#define TRICOIL_PART(signature, part, ...) \
    template <__VA_ARGS__>                 \
    constexpr auto signature const {       \
        return part;                       \
    }                                      \
    template <__VA_ARGS__>                 \
    constexpr auto signature {             \
        return part;                       \
    }

/// Entries of a matrix, and its parts, which refer to it. Base of Dense.
template <typename Derived>
class Parts {
public:
    using Scalar = typename Layout<Derived>::Scalar;
    using Element = typename Layout<Derived>::Element;  // const Scalar in a part of a constant matrix
    static constexpr int kRows = Layout<Derived>::kRows;
    static constexpr int kColumns = Layout<Derived>::kColumns;
    static constexpr int kSize = kRows * kColumns;
    static constexpr int kRowStep = Layout<Derived>::kRowStep;
    static constexpr int kColumnStep = Layout<Derived>::kColumnStep;
    static constexpr int kStep = kColumns == 1 ? kRowStep : kColumnStep;  // of a vector
    static constexpr int kDiagonal = kRows < kColumns ? kRows : kColumns;
    template <int Rows, int Columns>
    using Part = Block<Element, Rows, Columns, kRowStep, kColumnStep>;
    template <int Rows, int Columns>
    using ConstPart = Block<const Scalar, Rows, Columns, kRowStep, kColumnStep>;

    static constexpr int rows() { return kRows; }
    static constexpr int cols() { return kColumns; }
    static constexpr int size() { return kSize; }
    constexpr Derived& derived() { return static_cast<Derived&>(*this); }
    constexpr const Derived& derived() const { return static_cast<const Derived&>(*this); }

    constexpr const Scalar& operator()(Index i, Index j) const { return first()[i * kRowStep + j * kColumnStep]; }
    constexpr Element& operator()(Index i, Index j) { return first()[i * kRowStep + j * kColumnStep]; }
    /// Entry i of a vector; of a matrix, entry i in the order in memory.
    constexpr const Scalar& operator()(Index i) const { return first()[i * linear_step()]; }
    constexpr Element& operator()(Index i) { return first()[i * linear_step()]; }
    constexpr const Scalar& operator[](Index i) const { return (*this)(i); }
    constexpr Element& operator[](Index i) { return (*this)(i); }
    constexpr const Scalar& x() const { return (*this)(0); }
    constexpr const Scalar& y() const { return (*this)(1); }
    constexpr const Scalar& z() const { return (*this)(2); }
    constexpr Element& x() { return (*this)(0); }
    constexpr Element& y() { return (*this)(1); }
    constexpr Element& z() { return (*this)(2); }

    // Parts, which refer to this matrix.
    template <int Rows, int Columns>
    constexpr auto block(Index i, Index j) const {
        return ConstPart<Rows, Columns>(&(*this)(i, j));
    }
    template <int Rows, int Columns>
    constexpr auto block(Index i, Index j) {
        return Part<Rows, Columns>(&(*this)(i, j));
    }
    constexpr auto row(Index i) const { return block<1, kColumns>(i, 0); }
    constexpr auto row(Index i) { return block<1, kColumns>(i, 0); }
    constexpr auto col(Index j) const { return block<kRows, 1>(0, j); }
    constexpr auto col(Index j) { return block<kRows, 1>(0, j); }
    TRICOIL_PART(topLeftCorner(), (block<Rows, Columns>(0, 0)), int Rows, int Columns)
    TRICOIL_PART(topRightCorner(), (block<Rows, Columns>(0, kColumns - Columns)), int Rows, int Columns)
    TRICOIL_PART(bottomLeftCorner(), (block<Rows, Columns>(kRows - Rows, 0)), int Rows, int Columns)
    TRICOIL_PART(bottomRightCorner(), (block<Rows, Columns>(kRows - Rows, kColumns - Columns)), int Rows, int Columns)
    TRICOIL_PART(topRows(), (block<N, kColumns>(0, 0)), int N)
    TRICOIL_PART(bottomRows(), (block<N, kColumns>(kRows - N, 0)), int N)
    TRICOIL_PART(middleRows(Index i), (block<N, kColumns>(i, 0)), int N)
    TRICOIL_PART(leftCols(), (block<kRows, N>(0, 0)), int N)
    TRICOIL_PART(middleCols(Index j), (block<kRows, N>(0, j)), int N)
    TRICOIL_PART(rightCols(), (block<kRows, N>(0, kColumns - N)), int N)
    template <int N>
    constexpr auto segment(Index i) const {
        return Block < const Scalar, kColumns == 1 ? N : 1, kColumns == 1 ? 1 : N, kRowStep, kColumnStep > (&(*this)(i));
    }
    template <int N>
    constexpr auto segment(Index i) {
        return Block < Element, kColumns == 1 ? N : 1, kColumns == 1 ? 1 : N, kRowStep, kColumnStep > (&(*this)(i));
    }
    TRICOIL_PART(head(), (segment<N>(0)), int N)
    TRICOIL_PART(tail(), (segment<N>(kSize - N)), int N)
    constexpr auto transpose() const { return Block<const Scalar, kColumns, kRows, kColumnStep, kRowStep>(first()); }
    constexpr auto transpose() { return Block<Element, kColumns, kRows, kColumnStep, kRowStep>(first()); }
    constexpr auto diagonal() const { return Block<const Scalar, kDiagonal, 1, kRowStep + kColumnStep, 0>(first()); }
    constexpr auto diagonal() { return Block<Element, kDiagonal, 1, kRowStep + kColumnStep, 0>(first()); }
    /// All entries as one vector, in the order in memory.
    constexpr auto reshaped() const { return Block<const Scalar, kSize, 1, linear_step(), 0>(first()); }
    constexpr auto reshaped() { return Block<Element, kSize, 1, linear_step(), 0>(first()); }
    constexpr auto colwise() const { return ColumnsOf<const Scalar, kRows, kColumns, kRowStep, kColumnStep>(first()); }
    constexpr auto colwise() { return ColumnsOf<Element, kRows, kColumns, kRowStep, kColumnStep>(first()); }
    constexpr auto rowwise() const { return transpose().colwise(); }
    constexpr auto rowwise() { return transpose().colwise(); }

    /// Entry n, column after column.
    constexpr const Scalar& entry(int n) const {
        if constexpr (kRows == 1 || kColumns == 1) {
            return first()[n * kStep];
        } else if constexpr (kRowStep == 1 && kColumnStep == kRows) {
            return first()[n];
        } else {
            return (*this)(n % kRows, n / kRows);
        }
    }

protected:
    constexpr Parts() = default;
    constexpr Parts(const Parts&) = default;
    constexpr Parts& operator=(const Parts&) = default;

private:
    constexpr const Scalar* first() const { return derived().data(); }
    constexpr Element* first() { return derived().data(); }
    /// Step between successive entries in memory; of a matrix, only if there are no gaps.
    static constexpr int linear_step() {
        if constexpr (kColumns == 1 || kRows == 1) {
            return kStep;
        } else {
            static_assert(kRowStep * kColumnStep == (kRowStep == 1 ? kRows : kColumns));
            return 1;
        }
    }
};
#undef TRICOIL_PART

}  // namespace tricoil
