// Operations on matrices and parts of matrices: entry by entry, sums, norms, products of vectors, changes in place.
#pragma once

#include <cmath>
#include <concepts>
#include <type_traits>

#include "core/linear/parts.hpp"

namespace tricoil {

template <typename M>
constexpr bool kOwns = false;  // its entries
template <typename S, int Rows, int Columns, Order Storage>
constexpr bool kOwns<Matrix<S, Rows, Columns, Storage>> = true;

/// Assignments of at most this number of terms are written out, so that entries stay in registers.
template <typename Scalar>
constexpr int kWrittenOut = 256 / sizeof(Scalar);
#if defined(__arm__)
template <>
constexpr int kWrittenOut<double> =
    26;  // no products of 3x3 matrices: boards use double only in the self-check, where flash counts
#endif

/// Base of Matrix and Block.
template <typename Derived>
class Dense : public Parts<Derived> {
    using Base = Parts<Derived>;

public:
    using Base::block;
    using Base::col;
    using Base::derived;
    using Base::diagonal;
    using Base::entry;
    using Base::kColumns;
    using Base::kColumnStep;
    using Base::kRows;
    using Base::kRowStep;
    using Base::kSize;
    using Base::transpose;
    using Base::x;
    using Base::y;
    using Base::z;
    using typename Base::Element;
    using typename Base::Scalar;
    using Plain = Matrix<Scalar, kRows, kColumns>;

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

private:
    friend Derived;
    constexpr Dense() = default;
    constexpr Dense(const Dense&) = default;
    constexpr Dense& operator=(const Dense&) = default;

    /// Combines each entry with that of b, which may overlap.
    template <typename B, typename F>
    constexpr Derived& change(const Dense<B>& b, F f) {
        static_assert(kRows == Dense<B>::kRows && kColumns == Dense<B>::kColumns);
        if constexpr (kOwns<B> && (kColumns == 1 || kRowStep != Dense<B>::kColumnStep)) {
            return assign([&](int i, int j) { return f((*this)(i, j), b(i, j)); });
        } else {
            const typename Dense<B>::Plain copy = b;
            return assign([&](int i, int j) { return f((*this)(i, j), copy(i, j)); });
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

}  // namespace tricoil
