// Invalid columns: each is refused with its reason, counted, and leaves the tracker state unchanged.
#include <gtest/gtest.h>

#include <cstring>
#include <limits>

#include "tests/support/column_replay.hpp"
#include "tests/support/hand_like.hpp"

namespace tricoil::tracking::scaat {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

class FilterInput : public ::testing::Test {
protected:
    void SetUp() override {
        const auto motion = test::hand_like(3);
        test::ReplayParams params;
        params.sigma = 1e-6;
        test::replay<double>(motion, params, [&](const Column<double>& column) {
            filter_.update(column);
            last_ = column;
        });
        ASSERT_EQ(filter_.state(), TrackerState::tracking);
    }

    /// Next valid column.
    Column<double> next() const {
        Column<double> c = last_;
        c.midpoint += Microseconds{1389};
        return c;
    }

    void expect_refused(const Column<double>& column, Rejection reason) {
        const State<double> before = filter_.motion();
        const auto counted = filter_.counters().of(reason);
        EXPECT_FALSE(filter_.update(column).has_value());
        EXPECT_EQ(filter_.counters().of(reason), counted + 1);
        const State<double>& after = filter_.motion();
        EXPECT_EQ(before.time, after.time);
        EXPECT_EQ(before.position_m, after.position_m);
        EXPECT_EQ(before.q_source_sensor.coeffs(), after.q_source_sensor.coeffs());
        EXPECT_EQ(before.velocity_m_s, after.velocity_m_s);
        EXPECT_EQ(before.rate_rad_s, after.rate_rad_s);
        EXPECT_EQ(before.covariance, after.covariance);
    }

    ScaatTracker<double> filter_ = test::scaat_filter<double>(test::scaat_params<double>(true));
    Column<double> last_;
};

TEST_F(FilterInput, NotFinite) {
    for (const double bad : {kNaN, std::numeric_limits<double>::infinity()}) {
        Column<double> c = next();
        c.in_phase(1) = bad;
        expect_refused(c, Rejection::not_finite);
        c = next();
        c.quadrature(0) = bad;
        expect_refused(c, Rejection::not_finite);
    }
}

TEST_F(FilterInput, BadSigma) {
    for (const double bad : {0.0, -1.0, kNaN, std::numeric_limits<double>::infinity()}) {
        Column<double> c = next();
        c.sigma(2) = bad;
        expect_refused(c, Rejection::bad_sigma);
    }
}

TEST_F(FilterInput, UnknownState) {
    for (const auto state : {Excitation::off, Excitation::all, static_cast<Excitation>(77)}) {
        Column<double> c = next();
        c.state = state;
        expect_refused(c, Rejection::unknown_state);
    }
}

TEST_F(FilterInput, Duplicate) { expect_refused(last_, Rejection::duplicate); }

TEST_F(FilterInput, TimeBackwards) {
    Column<double> c = last_;
    c.midpoint -= Microseconds{10'001};
    expect_refused(c, Rejection::time_backwards);
}

/// Columns that arrive out of order within the limit are used and improve the estimate.
TEST(FilterLate, LateColumnsAreBetterThanNone) {
    const auto motion = test::hand_like(4);
    const double sigma = test::sigma_for_cost(0.2e-3);
    std::vector<Column<double>> columns;
    test::replay<double>(motion, {true, sigma, 1, 0, 10}, [&](const Column<double>& c) { columns.push_back(c); });
    enum class Delivery { in_time, late, never };
    const auto play = [&](Delivery delivery) {
        auto filter = test::scaat_filter<double>(test::scaat_params<double>(true));
        test::Score score;
        for (std::size_t n = 0; n < columns.size(); ++n) {
            if (delivery == Delivery::in_time || n < 100 || n % 3 != 0 || n + 3 > columns.size()) {
                if (const auto e = filter.update(columns[n])) {
                    score.add(*e, motion, sigma);
                }
            }
            if (n >= 102 && (n - 2) % 3 == 0 &&
                delivery == Delivery::late) {  // every column of S1 arrives after the next two: 2.8 ms late
                (void)filter.update(columns[n - 2]);
            }
        }
        EXPECT_EQ(filter.counters().of(Rejection::time_backwards), 0U);
        return score;
    };
    const auto late = play(Delivery::late);
    const auto in_time = play(Delivery::in_time);
    const auto without = play(Delivery::never);
    std::printf("one state late: %.3f mm, in time: %.3f mm\n", 1e3 * late.position().rms, 1e3 * in_time.position().rms);
    EXPECT_LT(late.position().rms, 1.5 * in_time.position().rms);
    EXPECT_LT(late.invalid, late.position_m.size() / 100);
    EXPECT_TRUE(without.position_m.empty());  // two coils do not determine a pose
}

TEST(FilterLate, TracksFromColumnsOutOfOrder) {
    const auto motion = test::hand_like(4);
    std::vector<Column<double>> columns;
    test::replay<double>(motion, {true, 1e-6, 1, 0, 2}, [&](const Column<double>& c) { columns.push_back(c); });
    auto filter = test::scaat_filter<double>(test::scaat_params<double>(true));
    std::size_t valid = 0;
    for (std::size_t n = 0; n + 1 < columns.size(); n += 2) {
        for (const std::size_t k : {n + 1, n}) {
            const auto e = filter.update(columns[k]);
            valid += e && e->valid() ? 1U : 0U;
        }
    }
    EXPECT_GT(valid, columns.size() * 9 / 10);
    EXPECT_EQ(filter.counters().of(Rejection::time_backwards), 0U);
}

/// A late good column does not clear flags of a newer column of its coil.
TEST_F(FilterInput, ALateColumnDoesNotClearTheFlagsOfANewerOne) {
    Column<double> saturated = next();
    saturated.state = last_.state;
    saturated.midpoint = last_.midpoint + Microseconds{4167};
    saturated.flags.set(ColumnFlag::saturated);
    EXPECT_FALSE(filter_.update(saturated)->valid());
    Column<double> late = last_;
    late.midpoint += Microseconds{100};
    const auto e = filter_.update(late);
    ASSERT_TRUE(e);
    EXPECT_TRUE(e->flags.has(PoseFlag::saturated));
}

/// Ten seconds without columns: stale at once, then lost; valid again when the sensor's motion has been measured.
TEST_F(FilterInput, LongGap) {
    const auto stale = filter_.tick(last_.midpoint + Microseconds{60'000});
    ASSERT_TRUE(stale.has_value());
    EXPECT_TRUE(stale->flags.has(PoseFlag::stale));
    // After ten seconds the sensor may be anywhere, so the hemisphere must be set.
    ASSERT_TRUE(filter_.set_hemisphere(Vec3<double>::UnitX()).ok());
    const auto motion = test::hand_like(3);
    test::ReplayParams params;
    params.sigma = 1e-6;
    params.begin_s = 11;
    params.duration_s = 16.5 / test::kSlotsPerSecond;
    int poses = 0;
    test::replay<double>(motion, params, [&](const Column<double>& column) {
        const auto estimate = filter_.update(column);
        poses += estimate && estimate->valid() ? 1 : 0;
        if (estimate && estimate->valid()) {
            EXPECT_LT((estimate->position_m - motion.at(to_seconds(estimate->time)).position_m).norm(), 2e-3);
        }
    });
    EXPECT_EQ(filter_.state(), TrackerState::tracking);
    EXPECT_GE(poses, 3);
    EXPECT_EQ(filter_.counters().acquisitions, 2U);
}

TEST(FilterParams, OutOfRangeIsRefusedWithAReason) {
    const auto expect_bad = [](auto change) {
        TrackerParams<float> params;
        ScaatParams<float> p;
        change(p, params.common);
        params.method = p;
        const Status status = check(params);
        EXPECT_EQ(status.code(), StatusCode::invalid_argument);
        EXPECT_NE(std::strlen(status.message()), 0U);
    };
    EXPECT_TRUE(check(TrackerParams<float>{{}, ScaatParams<float>{}}).ok());
    EXPECT_TRUE(check(TrackerParams<double>{{}, ScaatParams<double>{}}).ok());
    expect_bad([](auto& p, auto&) { p.gate = 0; });
    expect_bad([](auto& p, auto&) { p.gate = std::numeric_limits<float>::quiet_NaN(); });
    expect_bad([](auto& p, auto&) { p.gate = 1e-20F; });
    expect_bad([](auto& p, auto&) { p.process.smoothing = 3; });
    expect_bad([](auto& p, auto&) { p.process.rise = 1e6F; });
    expect_bad([](auto& p, auto&) { p.process.largest_step = 1e6F; });
    expect_bad([](auto& p, auto&) { p.coast_limit = Microseconds{1}; });
    expect_bad([](auto& p, auto&) { p.process.gain = 1; });
    expect_bad([](auto& p, auto&) { p.process.least_m2_s3 = 2; });
    expect_bad([](auto& p, auto&) { p.process.most_rad2_s3 = -1; });
    expect_bad([](auto& p, auto&) { p.start_speed_m_s = -3; });
    expect_bad([](auto& p, auto&) { p.coast_limit = Microseconds{0}; });
    expect_bad([](auto& p, auto& c) { p.coast_limit = c.max_column_span; });
    expect_bad([](auto&, auto& c) { c.window_s = 1e30F; });
    expect_bad([](auto& p, auto&) { p.start_speed_m_s = 1e20F; });
    expect_bad([](auto& p, auto&) { p.process.most_m2_s3 = 1e30F; });
    expect_bad([](auto& p, auto&) { p.inconsistent_above = 1e-9F; });
    expect_bad([](auto&, auto& c) { c.lost_after = Microseconds{1000}; });
    expect_bad([](auto& p, auto&) { p.max_lateness = Microseconds{-1}; });
    expect_bad([](auto& p, auto&) { p.predict_ahead = Microseconds{20'000'000}; });
    expect_bad([](auto&, auto& c) { c.hemisphere.x() = std::numeric_limits<float>::infinity(); });
}

TEST(FilterParams, InvalidCouplingConstantIsRefused) {
    TrackerParams<double> params{{}, ScaatParams<double>{}};
    for (const double bad : {0.0, -1.0, kNaN, std::numeric_limits<double>::infinity()}) {
        params.common.coupling_constant = bad;
        EXPECT_EQ(check(params).code(), StatusCode::invalid_argument);
    }
    params.common.coupling_constant = test::kCoupling;
    EXPECT_TRUE(check(params).ok());
}

/// Memory per sensor. An image of 40 KiB RAM has four sensors, so additional members must be noticed.
TEST(FilterSizes, AreWithinTheRamOfAnImage) {
    EXPECT_LE(sizeof(State<float>), 704U);
    EXPECT_LE(sizeof(TrackerParams<float>), 192U);
    EXPECT_LE(sizeof(DirectTracker<float>), 2544U);
    EXPECT_LE(4 * sizeof(ScaatTracker<float>), 13'664U);  // 224 bytes each are the virtual dipoles of the surroundings
    EXPECT_LT(sizeof(ScaatTracker<float>), 0.75 * static_cast<double>(sizeof(ScaatTracker<double>)));
}

}  // namespace
}  // namespace tricoil::tracking::scaat
