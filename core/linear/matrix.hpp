// Fixed-size matrices and vectors. Each operation computes its result at once: there are no expression types.
// Sums of terms are added from the last term to the first, t0 + (t1 + (t2 + ...)), so every machine computes the same bits.
#pragma once

#include <cmath>
#include <concepts>
#include <cstddef>
#include <limits>
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
    static constexpr int kRowStep = Storage == Order::by_columns ? 1 : Columns;
    static constexpr int kColumnStep = Storage == Order::by_columns ? Rows : 1;
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

template <typename M>
constexpr bool kOwns = false;  // its entries
template <typename S, int Rows, int Columns, Order Storage>
constexpr bool kOwns<Matrix<S, Rows, Columns, Storage>> = true;

/// A matrix type of another library (see linear/eigen.hpp), from which matrices are constructed entry by entry.
template <typename M>
concept ForeignMatrix = requires(const M& m) {
    { M::RowsAtCompileTime } -> std::convertible_to<int>;
    m.eval().coeff(0, 0);
};

/// Assignments of at most this number of terms are written out, so that entries stay in registers.
template <typename Scalar>
constexpr int kWrittenOut = 256 / sizeof(Scalar);
#if defined(__arm__)
template <>
constexpr int kWrittenOut<double> =
    26;  // no products of 3x3 matrices: boards use double only in the self-check, where flash counts
#endif

/// Operations of matrices, and of parts of matrices.
template <typename Derived>
class Dense {
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
    using Plain = Matrix<Scalar, kRows, kColumns>;
    template <int Rows, int Columns>
    using Part = Block<Element, Rows, Columns, kRowStep, kColumnStep>;
    template <int Rows, int Columns>
    using ConstPart = Block<const Scalar, Rows, Columns, kRowStep, kColumnStep>;

    static constexpr Plain Constant(Scalar value) {
        Plain m;
        m.setConstant(value);
        return m;
    }
    static constexpr Plain Zero() { return Constant(Scalar(0)); }
    static constexpr Plain Ones() { return Constant(Scalar(1)); }
    static constexpr Plain Identity() {
        return NullaryExpr([](int i, int j) { return Scalar(i == j); });
    }
    static constexpr Plain Unit(Index k) {
        Plain m = Zero();
        m(k) = Scalar(1);
        return m;
    }
    static constexpr Plain UnitX() { return Unit(0); }
    static constexpr Plain UnitY() { return Unit(1); }
    static constexpr Plain UnitZ() { return Unit(2); }
    /// Entries entry(i, j), or successive values entry().
    template <typename F>
    static constexpr Plain NullaryExpr(F entry) {
        Plain m;
        m.assign([&](int i, int j) {
            if constexpr (std::is_invocable_v<F>) {
                return entry();
            } else {
                return entry(i, j);
            }
        });
        return m;
    }

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
    template <int Rows, int Columns>
    constexpr auto topLeftCorner() const {
        return block<Rows, Columns>(0, 0);
    }
    template <int Rows, int Columns>
    constexpr auto topLeftCorner() {
        return block<Rows, Columns>(0, 0);
    }
    template <int Rows, int Columns>
    constexpr auto topRightCorner() const {
        return block<Rows, Columns>(0, kColumns - Columns);
    }
    template <int Rows, int Columns>
    constexpr auto topRightCorner() {
        return block<Rows, Columns>(0, kColumns - Columns);
    }
    template <int Rows, int Columns>
    constexpr auto bottomLeftCorner() const {
        return block<Rows, Columns>(kRows - Rows, 0);
    }
    template <int Rows, int Columns>
    constexpr auto bottomLeftCorner() {
        return block<Rows, Columns>(kRows - Rows, 0);
    }
    template <int Rows, int Columns>
    constexpr auto bottomRightCorner() const {
        return block<Rows, Columns>(kRows - Rows, kColumns - Columns);
    }
    template <int Rows, int Columns>
    constexpr auto bottomRightCorner() {
        return block<Rows, Columns>(kRows - Rows, kColumns - Columns);
    }
    template <int N>
    constexpr auto topRows() const {
        return block<N, kColumns>(0, 0);
    }
    template <int N>
    constexpr auto topRows() {
        return block<N, kColumns>(0, 0);
    }
    template <int N>
    constexpr auto bottomRows() const {
        return block<N, kColumns>(kRows - N, 0);
    }
    template <int N>
    constexpr auto bottomRows() {
        return block<N, kColumns>(kRows - N, 0);
    }
    template <int N>
    constexpr auto middleRows(Index i) const {
        return block<N, kColumns>(i, 0);
    }
    template <int N>
    constexpr auto middleRows(Index i) {
        return block<N, kColumns>(i, 0);
    }
    template <int N>
    constexpr auto leftCols() const {
        return block<kRows, N>(0, 0);
    }
    template <int N>
    constexpr auto leftCols() {
        return block<kRows, N>(0, 0);
    }
    template <int N>
    constexpr auto middleCols(Index j) const {
        return block<kRows, N>(0, j);
    }
    template <int N>
    constexpr auto middleCols(Index j) {
        return block<kRows, N>(0, j);
    }
    template <int N>
    constexpr auto rightCols() const {
        return block<kRows, N>(0, kColumns - N);
    }
    template <int N>
    constexpr auto rightCols() {
        return block<kRows, N>(0, kColumns - N);
    }
    template <int N>
    constexpr auto segment(Index i) const {
        return Block < const Scalar, kColumns == 1 ? N : 1, kColumns == 1 ? 1 : N, kRowStep, kColumnStep > (&(*this)(i));
    }
    template <int N>
    constexpr auto segment(Index i) {
        return Block < Element, kColumns == 1 ? N : 1, kColumns == 1 ? 1 : N, kRowStep, kColumnStep > (&(*this)(i));
    }
    template <int N>
    constexpr auto head() const {
        return segment<N>(0);
    }
    template <int N>
    constexpr auto head() {
        return segment<N>(0);
    }
    template <int N>
    constexpr auto tail() const {
        return segment<N>(kSize - N);
    }
    template <int N>
    constexpr auto tail() {
        return segment<N>(kSize - N);
    }
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

    // Entry by entry.
    template <typename F>
    constexpr auto unaryExpr(F f) const {
        Matrix<std::remove_cvref_t<std::invoke_result_t<F, Scalar>>, kRows, kColumns> m;
        m.assign([&](int i, int j) { return f((*this)(i, j)); });
        return m;
    }
    template <typename B, typename F>
    constexpr auto binaryExpr(const Dense<B>& b, F f) const {
        static_assert(kRows == Dense<B>::kRows && kColumns == Dense<B>::kColumns);
        Matrix<std::invoke_result_t<F, Scalar, typename Dense<B>::Scalar>, kRows, kColumns> m;
        m.assign([&](int i, int j) { return f((*this)(i, j), b(i, j)); });
        return m;
    }
    template <typename To>
    constexpr auto cast() const {
        return unaryExpr([](Scalar a) { return static_cast<To>(a); });
    }
    constexpr auto real() const {
        return unaryExpr([](const Scalar& a) { return a.real(); });
    }
    constexpr auto imag() const {
        return unaryExpr([](const Scalar& a) { return a.imag(); });
    }
    constexpr Plain operator-() const {
        return unaryExpr([](Scalar a) -> Scalar { return -a; });
    }
    constexpr Plain cwiseAbs() const {
        return unaryExpr([](Scalar a) -> Scalar { return std::abs(a); });
    }
    constexpr Plain cwiseAbs2() const {
        return unaryExpr([](Scalar a) -> Scalar { return a * a; });
    }
    constexpr Plain cwiseSqrt() const {
        return unaryExpr([](Scalar a) -> Scalar { return std::sqrt(a); });
    }
    constexpr Plain cwiseInverse() const {
        return unaryExpr([](Scalar a) -> Scalar { return Scalar(1) / a; });
    }
    template <typename B>
    constexpr Plain cwiseProduct(const Dense<B>& b) const {
        return binaryExpr(b, [](Scalar p, Scalar q) -> Scalar { return p * q; });
    }
    template <typename B>
    constexpr Plain cwiseQuotient(const Dense<B>& b) const {
        return binaryExpr(b, [](Scalar p, Scalar q) -> Scalar { return p / q; });
    }
    template <typename B>
    constexpr Plain cwiseMax(const Dense<B>& b) const {
        return binaryExpr(b, [](Scalar p, Scalar q) -> Scalar { return p < q ? q : p; });
    }
    template <typename B>
    constexpr Plain cwiseMin(const Dense<B>& b) const {
        return binaryExpr(b, [](Scalar p, Scalar q) -> Scalar { return q < p ? q : p; });
    }
    constexpr Plain cwiseMax(Scalar b) const { return cwiseMax(Constant(b)); }
    constexpr Plain cwiseMin(Scalar b) const { return cwiseMin(Constant(b)); }

    // Reductions. Largest and smallest entries of matrices with NaN are undefined.
    constexpr Scalar sum() const {
        return sum_of([this](int n) { return entry(n); });
    }
    constexpr Scalar mean() const { return sum() / kSize; }
    constexpr Scalar trace() const { return diagonal().sum(); }
    constexpr Scalar squaredNorm() const {
        static_assert(
            !requires(Scalar a) { a.imag(); }, "of complex numbers: eigen(m).squaredNorm()");
        return sum_of([this](int n) -> Scalar { return entry(n) * entry(n); });
    }
    constexpr Scalar norm() const { return std::sqrt(squaredNorm()); }
    template <typename B>
    constexpr Scalar dot(const Dense<B>& b) const {
        static_assert(kSize == Dense<B>::kSize);
        return sum_of([&](int n) -> Scalar { return entry(n) * b.entry(n); });
    }
    constexpr Scalar maxCoeff() const {
        return extreme([](Scalar a, Scalar b) { return b < a; });
    }
    constexpr Scalar minCoeff() const {
        return extreme([](Scalar a, Scalar b) { return a < b; });
    }
    /// Also the index of the entry, as in entry().
    template <std::integral I>
    constexpr Scalar maxCoeff(I* index) const {
        return entry(static_cast<int>(*index = I(best([](Scalar a, Scalar b) { return b < a; }))));
    }
    template <std::integral I>
    constexpr Scalar minCoeff(I* index) const {
        return entry(static_cast<int>(*index = I(best([](Scalar a, Scalar b) { return a < b; }))));
    }
    /// True if condition(entry) holds for all entries.
    template <typename F>
    [[nodiscard]] constexpr bool all(F condition) const {
        bool result = true;
        for (int n = 0; n < kSize; ++n) {
            result = result && condition(entry(n));
        }
        return result;
    }
    [[nodiscard]] constexpr bool allFinite() const {
        return sum_of([this](int n) -> Scalar { return Scalar(0) * entry(n); }) == Scalar(0);  // else NaN
    }
    [[nodiscard]] constexpr bool isZero(Scalar tolerance = Scalar(1e-12)) const {
        return all([tolerance](Scalar a) { return std::abs(a) <= tolerance; });
    }
    [[nodiscard]] constexpr bool isIdentity(Scalar tolerance = Scalar(1e-12)) const {
        return (*this - Identity()).isZero(tolerance);
    }
    /// Equal within `tolerance` times the smaller of the two Frobenius norms.
    template <typename B>
    [[nodiscard]] constexpr bool isApprox(const Dense<B>& b, Scalar tolerance = Scalar(1e-12)) const {
        const Scalar a2 = squaredNorm();
        const Scalar b2 = b.squaredNorm();
        return (*this - b).squaredNorm() <= tolerance * tolerance * (a2 < b2 ? a2 : b2);
    }
    template <typename B>
    constexpr bool operator==(const Dense<B>& b) const {
        bool result = true;
        for (int n = 0; n < kSize; ++n) {
            result = result && entry(n) == b.entry(n);
        }
        return result;
    }

    // Vectors and small square matrices.
    template <typename B>
    constexpr Matrix<Scalar, 3, 1> cross(const Dense<B>& b) const {
        static_assert(kSize == 3 && Dense<B>::kSize == 3);
        return {y() * b.z() - z() * b.y(), z() * b.x() - x() * b.z(), x() * b.y() - y() * b.x()};
    }
    /// Unit vector; a zero vector stays zero.
    constexpr Plain normalized() const {
        const Scalar squared = squaredNorm();
        return squared > Scalar(0) ? Plain(*this / std::sqrt(squared)) : Plain(*this);
    }
    /// The same for vectors of any length: squares neither overflow nor underflow.
    constexpr Plain stableNormalized() const {
        const Scalar largest = cwiseAbs().maxCoeff();
        return largest > Scalar(0) ? (*this / largest).normalized() : Plain(*this);
    }
    constexpr void normalize() { derived() = normalized(); }
    constexpr Scalar determinant() const {
        static_assert(kRows == kColumns && kRows >= 2 && kRows <= 3);
        if constexpr (kRows == 2) {
            return (*this)(0, 0) * (*this)(1, 1) - (*this)(0, 1) * (*this)(1, 0);
        } else {
            const auto minor = [this](int a, int b, int c) {
                return (*this)(0, a) * ((*this)(1, b) * (*this)(2, c) - (*this)(1, c) * (*this)(2, b));
            };
            return minor(0, 1, 2) - minor(1, 0, 2) + minor(2, 0, 1);
        }
    }
    /// Of 3x3, by cofactors. Entries are not finite if the matrix is singular.
    constexpr Plain inverse() const {
        static_assert(kRows == 3 && kColumns == 3);
        const auto cofactor = [this](int i, int j) {
            const int i1 = (i + 1) % 3;
            const int i2 = (i + 2) % 3;
            const int j1 = (j + 1) % 3;
            const int j2 = (j + 2) % 3;
            return (*this)(i1, j1) * (*this)(i2, j2) - (*this)(i1, j2) * (*this)(i2, j1);
        };
        const Matrix<Scalar, 3, 1> first_column(cofactor(0, 0), cofactor(1, 0), cofactor(2, 0));
        const Scalar scale = Scalar(1) / first_column.dot(col(0));
        return NullaryExpr([&](int i, int j) { return cofactor(j, i) * scale; });
    }
    constexpr DiagonalMatrix<Scalar, kSize> asDiagonal() const { return {Matrix<Scalar, kSize, 1>(*this)}; }

    // Changes in place.
    constexpr Derived& setConstant(Scalar value) {
        return assign([value](int, int) { return value; });
    }
    constexpr Derived& setZero() { return setConstant(Scalar(0)); }
    constexpr Derived& setIdentity() {
        return assign([](int i, int j) { return Scalar(i == j); });
    }
    template <typename B>
    constexpr Derived& operator+=(const Dense<B>& b) {
        return change(b, [](Scalar p, Scalar q) -> Scalar { return p + q; });
    }
    template <typename B>
    constexpr Derived& operator-=(const Dense<B>& b) {
        return change(b, [](Scalar p, Scalar q) -> Scalar { return p - q; });
    }
    template <typename B>
    constexpr Derived& operator*=(const Dense<B>& b) {
        return derived() = *this * b;
    }
    constexpr Derived& operator*=(Scalar factor) {
        return assign([&](int i, int j) -> Scalar { return (*this)(i, j) * factor; });
    }
    constexpr Derived& operator/=(Scalar divisor) {
        return assign([&](int i, int j) -> Scalar { return (*this)(i, j) / divisor; });
    }
    /// Row after row: `m << a, b, c, d`. A vector or matrix fills its own shape.
    template <typename T>
    constexpr CommaInput<Derived> operator<<(const T& value) {
        return CommaInput<Derived>(derived()).put(value);
    }
    /// Sets the entries to value(i, j). `value` must not read entries of this matrix that are already set.
    template <int Terms = 1, typename F>
    constexpr Derived& assign(F value) {
        if constexpr (kSize * Terms <= kWrittenOut<Scalar>) {
#pragma GCC unroll 16
            for (int j = 0; j < kColumns; ++j) {
#pragma GCC unroll 16
                for (int i = 0; i < kRows; ++i) {
                    (*this)(i, j) = value(i, j);
                }
            }
        } else {
            for (int j = 0; j < kColumns; ++j) {
                for (int i = 0; i < kRows; ++i) {
                    (*this)(i, j) = value(i, j);
                }
            }
        }
        return derived();
    }

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

private:
    friend Derived;
    constexpr Dense() = default;
    constexpr Dense(const Dense&) = default;
    constexpr Dense& operator=(const Dense&) = default;

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
    /// Combines each entry with that of b, which may overlap.
    template <typename B, typename F>
    constexpr Derived& change(const Dense<B>& b, F f) {
        static_assert(kRows == Dense<B>::kRows && kColumns == Dense<B>::kColumns);
        if constexpr (kOwns<B> && (kColumns == 1 || kRowStep != Dense<B>::kColumnStep)) {
            return assign([&](int i, int j) { return f((*this)(i, j), b(i, j)); });
        } else {
            return change(typename Dense<B>::Plain(b), f);
        }
    }
    template <typename F>
    static constexpr Scalar sum_of(F term) {
        Scalar sum = term(kSize - 1);
#pragma GCC unroll 36
        for (int n = kSize - 2; n >= 0; --n) {
            sum = term(n) + sum;
        }
        return sum;
    }
    template <typename F>
    constexpr Scalar extreme(F better) const {
        Scalar found = entry(0);
#pragma GCC unroll 16
        for (int n = 1; n < kSize; ++n) {
            found = better(entry(n), found) ? entry(n) : found;
        }
        return found;
    }
    template <typename F>
    constexpr int best(F better) const {
        int found = 0;
        for (int n = 1; n < kSize; ++n) {
            if (better(entry(n), entry(found))) {
                found = n;
            }
        }
        return found;
    }
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
