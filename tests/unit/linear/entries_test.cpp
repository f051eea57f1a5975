// Operations on single entries have the same bits as Eigen's.
#include "tests/unit/linear/oracle.hpp"

namespace tricoil {
namespace {

template <typename Scalar>
class LinearEntries : public Linear<Scalar> {
protected:
    template <int Rows, int Columns>
    void check_entries() {
        for (const auto& a : this->template any<Rows, Columns>()) {
            for (const auto& b : this->template any<Rows, Columns>()) {
                const Oracle<Scalar> ea = oracle(a);
                const Oracle<Scalar> eb = oracle(b);
                const auto expect_both = [&](auto f) { expect_same(f(a, b), f(ea, eb)); };
                expect_both([](const auto& m, const auto& n) { return m + n; });
                expect_both([](const auto& m, const auto& n) { return m - n; });
                expect_both([](const auto& m, const auto& n) { return m.cwiseProduct(n); });
                expect_both([](const auto& m, const auto& n) { return m.cwiseQuotient(n); });
                EXPECT_EQ(a == b, ea == eb);
                EXPECT_EQ(a == a, ea == ea);
            }
            const Oracle<Scalar> ea = oracle(a);
            const auto expect_both = [&](auto f) { expect_same(f(a), f(ea)); };
            expect_both([](const auto& m) { return -m; });
            expect_both([](const auto& m) { return m * Scalar(0.3); });
            expect_both([](const auto& m) { return Scalar(0.3) * m; });
            expect_both([](const auto& m) { return m / Scalar(0.3); });
            expect_both([](const auto& m) { return m.cwiseAbs(); });
            expect_both([](const auto& m) { return m.cwiseAbs2(); });
            expect_both([](const auto& m) { return m.cwiseInverse(); });
            expect_same(a.template cast<float>(), ea.template cast<float>());
            expect_both([](const auto& m) { return m.transpose(); });
            // Eigen's vectorized square root takes denormals for zero.
            expect_same(a.cwiseAbs().cwiseSqrt(), ea.cwiseAbs().unaryExpr([](Scalar x) { return std::sqrt(x); }));
            EXPECT_EQ(a.allFinite(), ea.allFinite());
            for (const Scalar tolerance : {Scalar(0), Scalar(1e-3), Scalar(10)}) {
                EXPECT_EQ(a.isZero(tolerance), ea.isZero(tolerance));
            }
            auto changed = a;
            auto expected = ea;
            changed += a * Scalar(2);
            expected += ea * Scalar(2);
            changed -= a / Scalar(7);
            expected -= ea / Scalar(7);
            changed *= Scalar(3);
            expected *= Scalar(3);
            changed /= Scalar(11);
            expected /= Scalar(11);
            expect_same(changed, expected);
        }
        for (const auto& a : this->template finite<Rows, Columns>()) {
            const auto b = this->template random<Rows, Columns>();
            expect_same(a.cwiseMax(b), oracle(a).cwiseMax(oracle(b)));
            expect_same(a.cwiseMin(b), oracle(a).cwiseMin(oracle(b)));
            EXPECT_EQ(a.maxCoeff(), oracle(a).maxCoeff());
            EXPECT_EQ(a.minCoeff(), oracle(a).minCoeff());
        }
    }
};
TYPED_TEST_SUITE(LinearEntries, Scalars);

TYPED_TEST(LinearEntries, HaveTheSameBits) {
    this->template check_entries<3, 1>();
    this->template check_entries<3, 3>();
    this->template check_entries<3, 12>();
}
}  // namespace
}  // namespace tricoil
