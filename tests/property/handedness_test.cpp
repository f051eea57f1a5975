// Wrong-handed wiring is detected in noise.
#include <gtest/gtest.h>

#include "core/solver/direct.hpp"
#include "tests/support/random_poses.hpp"

namespace tricoil::solver {
namespace {

TEST(Handedness, DetectedInAllOf10000CasesAt26Decibels) {
    constexpr std::uint64_t kSeed = 26;
    test::RandomPoses random(kSeed);
    int mistaken = 0;
    for (int i = 0; i < 10'000; ++i) {
        const double range = random.uniform(0.15, 1.2);
        const double sigma = field::coupling_strength(1.0, range) * std::pow(10, -26.0 / 20);
        Mat3<double> x = test::unit_signal(range * random.direction(), random.attitude());
        const bool reversed = i % 2 == 1;
        if (reversed) {
            x.col(i % 3) *= -1;
        }
        x += sigma * random.gaussian_matrix();
        const auto s = solve_direct<double>(x, 1.0);
        mistaken += s->right_handed == reversed ? 1 : 0;
        mistaken += solve_direct<float>(x.cast<float>(), 1.0F)->right_handed == reversed ? 1 : 0;
    }
    std::cout << "mistaken: " << mistaken << " of 20000 (float and double), seed " << kSeed << "\n";
    EXPECT_EQ(mistaken, 0);
}

}  // namespace
}  // namespace tricoil::solver
