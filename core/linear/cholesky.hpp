// Cholesky factors of small symmetric matrices.
#pragma once

#include <cmath>

#include "core/linear/matrix.hpp"

namespace tricoil {

/// A = L L^T of a symmetric N x N matrix.
template <typename Scalar, int N>
class Cholesky {
public:
    using Square = Matrix<Scalar, N, N>;
    using Vector = Matrix<Scalar, N, 1>;

    Cholesky() = default;
    /// Reads the lower triangle. ok() is false if `a` is not positive definite; the factor is then unusable.
    explicit Cholesky(const Square& a) {
        for (int k = 0; k < N; ++k) {
            Scalar squares = 0;
            for (int j = 0; j < k; ++j) {
                squares += l_(k, j) * l_(k, j);
            }
            const Scalar pivot = a(k, k) - squares;
            if (!(pivot > 0)) {
                return;
            }
            l_(k, k) = std::sqrt(pivot);
            for (int i = k + 1; i < N; ++i) {
                Scalar product = 0;
                for (int j = 0; j < k; ++j) {
                    product += l_(i, j) * l_(k, j);
                }
                l_(i, k) = (a(i, k) - product) / l_(k, k);
            }
        }
        ok_ = true;
    }

    [[nodiscard]] bool ok() const { return ok_; }

    /// L^-1 B, column by column.
    template <int Columns>
    [[nodiscard]] Matrix<Scalar, N, Columns> solve_lower(const Matrix<Scalar, N, Columns>& b) const {
        Matrix<Scalar, N, Columns> x;
        for (int j = 0; j < Columns; ++j) {
            Vector column = b.col(j);
            forward<0>(column);
            x.col(j) = column;
        }
        return x;
    }

    /// A^-1 B, column by column.
    template <int Columns>
    [[nodiscard]] Matrix<Scalar, N, Columns> solve(const Matrix<Scalar, N, Columns>& b) const {
        Matrix<Scalar, N, Columns> x;
        for (int j = 0; j < Columns; ++j) {
            Vector column = b.col(j);
            forward<0>(column);
            backward<N - 1>(column);
            x.col(j) = column;
        }
        return x;
    }

private:
    template <int Row>
    void forward(Vector& x) const {
        if constexpr (Row < N) {
            x(Row) = (x(Row) - sum<0, Row>([&](int j) { return l_(Row, j) * x(j); })) / l_(Row, Row);
            forward<Row + 1>(x);
        }
    }

    template <int Row>
    void backward(Vector& x) const {
        if constexpr (Row >= 0) {
            x(Row) = (x(Row) - sum<Row + 1, N>([&](int j) { return l_(j, Row) * x(j); })) / l_(Row, Row);
            backward<Row - 1>(x);
        }
    }

    /// Sum of term(j) for j in [Begin, End), from the last to the first.
    template <int Begin, int End, typename Term>
    static Scalar sum(const Term& term) {
        if constexpr (Begin >= End) {
            return Scalar(0);
        } else if constexpr (End - Begin == 1) {
            return term(Begin);
        } else {
            return term(Begin) + sum<Begin + 1, End>(term);
        }
    }

    Square l_;  // only the lower triangle is used
    bool ok_ = false;
};

}  // namespace tricoil
