// Invalid time stamps: both trackers refuse and count them, and recover from a clock restart.
#include <gtest/gtest.h>

#include <limits>

#include "tests/support/column_replay.hpp"
#include "tests/support/hand_like.hpp"

namespace tricoil::tracking {
namespace {

template <typename T>
class Clock : public ::testing::Test {};

// Confined to one hemisphere, because the duration of a clock restart and the motion during it are unknown.
struct Filtered {
    static auto make(bool tdm) {
        auto params = test::scaat_params<double>(tdm);
        params.common.confined = true;
        return test::scaat_filter<double>(params);
    }
};
struct Direct {
    static auto make(bool tdm) {
        auto params = test::direct_params<double>(tdm, true);
        params.common.confined = true;
        return DirectTracker<double>(params);
    }
};
using Trackers = ::testing::Types<Filtered, Direct>;
TYPED_TEST_SUITE(Clock, Trackers);

/// Plays three seconds, with time stamps changed by `stamp`. Returns the valid poses after the first second, and all poses.
template <typename Make, typename Stamp>
std::pair<std::size_t, TrackerCounters> play(bool tdm, Stamp&& stamp) {
    auto tracker = Make::make(tdm);
    const auto motion = test::hand_like(2);
    std::size_t valid = 0;
    test::replay<double>(motion, {tdm, 1e-6, 1, 0, 3}, [&](Column<double> column) {
        const double t = to_seconds(column.midpoint);
        stamp(column);
        const auto e = tracker.update(column);
        valid += t > 1 && e && e->valid() ? 1U : 0U;
    });
    return {valid, tracker.counters()};
}

TYPED_TEST(Clock, OneStampFarAheadCostsItsColumnsOnly) {
    for (const bool tdm : {true, false}) {
        for (const std::int64_t ahead_us : {200'000LL, 3'600'000'000LL}) {
            const auto [valid, counters] = play<TypeParam>(tdm, [&](Column<double>& column) {
                column.midpoint += to_us(column.midpoint) == 1'000'000 ? Microseconds{ahead_us} : Microseconds{0};
            });
            EXPECT_GT(valid, tdm ? 1420U : 470U);
            EXPECT_EQ(counters.of(Rejection::time_backwards), 0U);
            EXPECT_EQ(counters.acquisitions, 1U);
        }
    }
}

TYPED_TEST(Clock, RestartIsFollowed) {
    for (const bool tdm : {true, false}) {
        const auto [valid, counters] = play<TypeParam>(tdm, [&](Column<double>& column) {
            column.midpoint += to_us(column.midpoint) < 1'000'000 ? Microseconds{100'000'000} : Microseconds{0};
        });
        EXPECT_GT(valid, tdm ? 1400U : 460U);
        EXPECT_GT(counters.of(Rejection::time_backwards), 2U);
        EXPECT_LT(counters.of(Rejection::time_backwards), 50U);
    }
}

/// Time stamps at the ends of the range and around zero: no arithmetic overflows 64 bits.
TYPED_TEST(Clock, ExtremeStampsAreRefused) {
    auto tracker = TypeParam::make(true);
    Column<double> column;
    column.state = Excitation::s1;
    column.in_phase.setConstant(1e-3);
    column.sigma.setConstant(1e-6);
    for (const std::int64_t us : {std::numeric_limits<std::int64_t>::max(), std::numeric_limits<std::int64_t>::min(),
                                  std::numeric_limits<std::int64_t>::min() + 1}) {
        column.midpoint = device_time_us(us);
        EXPECT_FALSE(tracker.update(column).has_value());
        EXPECT_FALSE(tracker.tick(column.midpoint).has_value());
    }
    EXPECT_EQ(tracker.counters().accepted, 0U);
}

/// The newest 60 columns are sent twice, at 960 frames/s: each is used once.
TEST(Duplicates, AreKnownAtEveryRate) {
    auto filter = Filtered::make(false);
    const auto motion = test::hand_like(2);
    std::vector<Column<double>> sent;
    for (int frame = 0; frame < 960; ++frame) {
        for (int j = 0; j < 3; ++j) {
            Column<double> column;
            column.state = single_coil(j);
            column.midpoint = device_time_us(frame * 1'000'000LL / 960);
            const auto truth = motion.at(to_seconds(column.midpoint));
            column.in_phase = field::column_model<double>(test::kCoupling, truth.position_m,
                                                          geometry::attitude_matrix(truth.q_source_sensor), j)
                                  .column;
            column.sigma.setConstant(1e-6);
            sent.push_back(column);
            (void)filter.update(column);
        }
    }
    const auto accepted = filter.counters().accepted;
    for (std::size_t n = 1; n <= 60; ++n) {
        (void)filter.update(sent[sent.size() - n]);
    }
    EXPECT_EQ(filter.counters().accepted, accepted);
}

template <typename Scalar>
class Values : public ::testing::Test {};
using Scalars = ::testing::Types<float, double>;
TYPED_TEST_SUITE(Values, Scalars);

/// Couplings with overflowing squares and sigmas with over- or underflowing squares are refused; they would make the state
/// infinite.
TYPED_TEST(Values, WithoutASquareAreRefused) {
    using Scalar = TypeParam;
    const auto expect_refused = [](auto& tracker, Scalar coupling, Scalar sigma, Rejection reason) {
        Column<Scalar> column;
        column.state = Excitation::s1;
        column.in_phase.setConstant(coupling);
        column.sigma.setConstant(sigma);
        (void)tracker.update(column);
        EXPECT_EQ(tracker.counters().of(reason), 1U) << coupling << ' ' << sigma;
    };
    const Scalar big = Scalar(2) * std::sqrt(std::numeric_limits<Scalar>::max());
    const Scalar small = Scalar(0.5) * std::sqrt(std::numeric_limits<Scalar>::min());
    auto filter = test::scaat_filter<Scalar>(test::scaat_params<Scalar>(true));
    auto direct = test::direct_tracker<Scalar>(true, true);
    expect_refused(filter, big, Scalar(1e-6), Rejection::not_finite);
    expect_refused(direct, big, Scalar(1e-6), Rejection::not_finite);
    for (const Scalar sigma : {small, big}) {
        auto another_filter = test::scaat_filter<Scalar>(test::scaat_params<Scalar>(true));
        auto another_direct = test::direct_tracker<Scalar>(true, true);
        expect_refused(another_filter, Scalar(1e-3), sigma, Rejection::bad_sigma);
        expect_refused(another_direct, Scalar(1e-3), sigma, Rejection::bad_sigma);
    }
}

}  // namespace
}  // namespace tricoil::tracking
