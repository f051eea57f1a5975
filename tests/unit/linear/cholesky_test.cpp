// Factors and solutions agree with Eigen's.
#include <Eigen/Cholesky>

#include "core/linear/cholesky.hpp"
#include "tests/unit/linear/oracle.hpp"

namespace tricoil {
namespace {

template <typename Scalar>
class LinearCholesky : public Linear<Scalar> {};
TYPED_TEST_SUITE(LinearCholesky, Scalars);

template <typename Scalar, int N>
void check_cholesky(const Matrix<Scalar, N, N>& a, const Matrix<Scalar, N, 2>& b) {
    using Square = Eigen::Matrix<Scalar, N, N>;
    const Eigen::LLT<Square> reference(Square(oracle(a)));
    const Cholesky<Scalar, N> ours(a);
    ASSERT_EQ(ours.ok(), reference.info() == Eigen::Success);
    if (!ours.ok()) {
        return;
    }
    // Backward errors: Higham, "Accuracy and stability of numerical algorithms", section 10.1.
    const Square lower = reference.matrixL();
    const auto solve_lower = [&](auto right) {
        lower.template triangularView<Eigen::Lower>().solveInPlace(right);
        return right;
    };
    const Oracle<Scalar> factor = lower.cwiseAbs();
    const auto after_factors = [&](const Oracle<Scalar>& v) {
        const Oracle<Scalar> half = factor.transpose().lazyProduct(v.cwiseAbs());
        return Oracle<Scalar>(factor.lazyProduct(half));
    };
    const Matrix<Scalar, N, 2> x = ours.solve(b);
    expect_near(a * x, oracle(b), after_factors(oracle(x)) + oracle(b).cwiseAbs(), 4 * N);
    const Matrix<Scalar, N, 2> y = ours.solve_lower(b);
    const Oracle<Scalar> expected = solve_lower(Eigen::Matrix<Scalar, N, 2>(oracle(b)));
    const Oracle<Scalar> inverse = Square(solve_lower(Square(Square::Identity()))).cwiseAbs();
    const Oracle<Scalar> spread = inverse.transpose().lazyProduct(expected.cwiseAbs());
    const Oracle<Scalar> effect = inverse.lazyProduct(after_factors(spread));
    expect_near(y, expected, effect, 4 * N);
}

TYPED_TEST(LinearCholesky, CholeskySolvesLikeEigen) {
    using Scalar = TypeParam;
    for (int n = 0; n < 100; ++n) {
        const auto small = this->template random<3, 3>();
        check_cholesky<Scalar, 3>(small * small.transpose() + Scalar(0.1) * Mat3<Scalar>::Identity(),
                                  this->template random<3, 2>());
        const auto root = this->template random<6, 6>();
        check_cholesky<Scalar, 6>(root * root.transpose() + Scalar(0.1) * Mat6<Scalar>::Identity(),
                                  this->template random<6, 2>());
        check_cholesky<Scalar, 6>(root + root.transpose(), this->template random<6, 2>());  // mostly indefinite
    }
    for (const auto& a : {Mat3<Scalar>::Zero(), Mat3<Scalar>::Ones(), Mat3<Scalar>::Constant(-1)}) {
        EXPECT_FALSE((Cholesky<Scalar, 3>(a).ok()));
    }
    for (Index entry = 0; entry < 3; ++entry) {
        Mat3<Scalar> a = Mat3<Scalar>::Identity();
        a(2, entry) = std::numeric_limits<Scalar>::quiet_NaN();
        EXPECT_FALSE((Cholesky<Scalar, 3>(a).ok()));
    }
}

}  // namespace
}  // namespace tricoil
