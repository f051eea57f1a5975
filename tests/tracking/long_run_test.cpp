// Stability in float over long times, and the heap.
#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <new>

#include <Eigen/Core>

#include "tests/support/column_replay.hpp"
#include "tests/support/hand_like.hpp"

namespace {
std::atomic<long> allocations{0};
}
// Counts calls and forwards to glibc's allocator: Eigen allocates with malloc, not with operator new.
extern "C" void* __libc_malloc(std::size_t size);  // NOLINT(readability-identifier-naming): glibc's name
extern "C" void* malloc(std::size_t size) {
    ++allocations;
    return __libc_malloc(size);
}

namespace tricoil::tracking {
namespace {

/// Hand motion at 240 Hz for TRICOIL_LONG_RUN_S seconds (default 60; a day: 86,400).
TEST(LongRun, FloatStaysSound) {
    const char* given = std::getenv("TRICOIL_LONG_RUN_S");
    const double duration_s = given != nullptr ? std::atof(given) : 60;
    const auto hand = test::hand_like(1);
    const sim::StillMotion still(hand.at(0));
    auto filter = test::scaat_filter<float>(test::scaat_params<float>(true));
    double worst_norm = 0;
    double worst_m = 0;
    std::size_t invalid = 0;
    std::size_t poses = 0;
    // Alternates ten seconds of rest and of motion. Time continues, the motion repeats.
    for (int stretch = 0; 10.0 * stretch < duration_s; ++stretch) {
        const sim::Motion& motion = stretch % 2 == 0 ? static_cast<const sim::Motion&>(hand) : still;
        const Microseconds offset = microseconds_from_seconds(10.0 * stretch);
        test::replay<float>(motion, {true, test::sigma_for_cost(0.05e-3), static_cast<std::uint64_t>(stretch + 1), 0, 10},
                            [&](Column<float> column) {
                                const double t = to_seconds(column.midpoint);
                                column.midpoint += offset;
                                const auto e = filter.update(column);
                                if (!e || t < 0.1) {
                                    return;
                                }
                                ++poses;
                                invalid += e->valid() ? 0U : 1U;
                                worst_norm = std::max(worst_norm, std::abs(static_cast<double>(e->q_source_sensor.norm()) - 1));
                                worst_m = std::max(worst_m, (e->position_m.cast<double>() - motion.at(t).position_m).norm());
                                const auto& p = filter.motion().covariance;
                                if (poses % 7 == 0) {
                                    ASSERT_EQ((p - p.transpose()).cwiseAbs().maxCoeff(), 0.0F);
                                    ASSERT_TRUE((Cholesky<double, 12>(p.cast<double>()).ok()));
                                }
                            });
    }
    std::printf("%.0f s, %zu poses, %zu invalid, worst %.3f mm, quaternion norm off by %.2e\n", duration_s, poses, invalid,
                1e3 * worst_m, worst_norm);
    EXPECT_LT(worst_norm, 1e-6);
    EXPECT_LT(worst_m, 5e-3);
    EXPECT_LT(invalid, poses / 10'000 + 1);
}

TEST(Heap, TheTrapFires) {
    const long before = allocations;
    Eigen::MatrixXd* m = new Eigen::MatrixXd(20, 20);
    delete m;
    EXPECT_GE(allocations - before, 2);
}

TEST(Heap, TheFilterDoesNotAllocate) {
    const auto motion = test::hand_like(1);
    auto filter = test::scaat_filter<float>(test::scaat_params<float>(true));
    long counted = 0;
    test::replay<float>(motion, {true, 1e-6, 1, 0, 5}, [&](Column<float> column) {
        const double t = to_seconds(column.midpoint);
        column.in_phase *= t > 2 && t < 2.5 ? -1.0F : 1.0F;  // lost and acquired again during the run
        const long before = allocations;
        (void)filter.update(column);
        (void)filter.tick(column.midpoint + Microseconds{500});
        counted += allocations - before;
    });
    EXPECT_GE(filter.counters().acquisitions, 2U);
    EXPECT_EQ(counted, 0);
}

}  // namespace
}  // namespace tricoil::tracking
