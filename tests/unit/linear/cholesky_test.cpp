// Factors and solutions agree with Eigen's.
#include "core/linear/cholesky.hpp"

#include "tests/unit/linear/comparison.hpp"

namespace tricoil {
namespace {

template <typename Scalar>
class LinearCholesky : public Linear<Scalar> {};
TYPED_TEST_SUITE(LinearCholesky, Scalars);

template <typename Scalar, int N>
void check_cholesky(const Matrix<Scalar, N, N>& a, const Matrix<Scalar, N, 2>& b) {
    const CholeskyOracle reference(oracle(a));
    const Cholesky<Scalar, N> ours(a);
    ASSERT_EQ(ours.ok(), reference.ok);
    if (!ours.ok()) {
        return;
    }
    // Backward errors: Higham, "Accuracy and stability of numerical algorithms", section 10.1.
    const Oracle factor = reference.lower.cwiseAbs();
    const auto after_factors = [&](const Oracle& v) { return factor * (factor.transpose() * v.cwiseAbs()); };
    const Matrix<Scalar, N, 2> x = ours.solve(b);
    expect_near(a * x, oracle(b), after_factors(oracle(x)) + oracle(b).cwiseAbs(), 4 * N);
    const Oracle expected = reference.inverse_of_lower * oracle(b);
    const Oracle inverse = reference.inverse_of_lower.cwiseAbs();
    const Oracle effect = inverse * after_factors(inverse.transpose() * expected.cwiseAbs());
    expect_near(ours.solve_lower(b), expected, effect, 4 * N);
}

TYPED_TEST(LinearCholesky, CholeskySolvesLikeEigen) {
    using Scalar = TypeParam;
    for (int n = 0; n < 100; ++n) {
        const auto root = this->template random<6, 6>();
        check_cholesky<Scalar, 6>(root * root.transpose() + Scalar(0.1) * Mat6<Scalar>::Identity(),
                                  this->template random<6, 2>());
        check_cholesky<Scalar, 6>(root + root.transpose(), this->template random<6, 2>());  // mostly indefinite
        const Mat6<Scalar> definite = root * root.transpose() + Mat6<Scalar>::Identity();
        Mat6<Scalar> lower = definite;
        for (int i = 0; i < 6; ++i) {
            for (int j = i + 1; j < 6; ++j) {
                lower(i, j) = std::numeric_limits<Scalar>::quiet_NaN();  // not read
            }
        }
        EXPECT_EQ((Cholesky<Scalar, 6>(lower).solve(root)), (Cholesky<Scalar, 6>(definite).solve(root)));
    }
    const Mat3<Scalar> last_pivot_is_zero = Vec3<Scalar>(1, 1, 0).asDiagonal();
    for (const auto& a : {Mat3<Scalar>::Zero(), Mat3<Scalar>::Ones(), Mat3<Scalar>::Constant(-1), last_pivot_is_zero}) {
        EXPECT_FALSE(CholeskyOracle(oracle(a)).ok);
        EXPECT_FALSE((Cholesky<Scalar, 3>(a).ok()));
    }
    for (Index entry = 0; entry < 3; ++entry) {
        Mat3<Scalar> a = Mat3<Scalar>::Identity();
        a(2, entry) = std::numeric_limits<Scalar>::quiet_NaN();
        EXPECT_FALSE((Cholesky<Scalar, 3>(a).ok()));
    }
}

TYPED_TEST(LinearCholesky, SumsHaveTheStatedOrder) {
    using Scalar = TypeParam;
    using Column = Matrix<Scalar, 5, 1>;
    const Scalar large = std::is_same_v<Scalar, float> ? Scalar(0x1p12) : Scalar(0x3p25);
    const Scalar square = large * large;  // square + 1 is square
    Matrix<Scalar, 5, 5> a = Matrix<Scalar, 5, 5>::Identity();
    // Of the factor from the first to the last: square + 1 + 1. Of the solution from the last to the first: 1 + 1 + square.
    a.row(3) = Column(large, 1, 1, square + 4, 0);
    a.row(4) = Column(large, 1, 1, square + 4, square + 20);
    const Column b(large, 1, 1, square + 4, square + 8);
    EXPECT_EQ((Cholesky<Scalar, 5>(a).solve_lower(b)), Column(large, 1, 1, 1, 1));
}

}  // namespace
}  // namespace tricoil
