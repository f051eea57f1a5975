// The paper's examples against reference numbers of an independent prototype.
#include "sim/paper/paper_simulation.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>

#include "board/support/errors.hpp"
#include "sim/paper/singularities.hpp"

namespace tricoil::paper {
namespace {

using error_model::KappaForm;
using error_model::Loop;

double largest(const std::vector<Update>& updates, double (*value)(const Update&)) {
    double worst = 0;
    for (const Update& update : updates) {
        worst = std::max(worst, std::abs(value(update)));
    }
    return worst;
}

double e_rho(const Update& u) { return u.measured.position.range_m; }
double e_alpha(const Update& u) { return u.measured.position.azimuth_rad; }
double e_beta(const Update& u) { return u.measured.position.elevation_rad; }
double predicted_e_rho(const Update& u) { return u.predicted.range_m; }
double predicted_e_beta(const Update& u) { return u.predicted.elevation_rad; }
double predicted_e_alpha(const Update& u) { return u.predicted.azimuth_rad; }
double rho_difference(const Update& u) { return u.predicted.range_m - u.measured.position.range_m; }
double beta_difference(const Update& u) { return u.predicted.elevation_rad - u.measured.position.elevation_rad; }
double position_error(const Update& u) { return u.position_error_m.norm(); }

std::vector<Update> run(const char* name, Loop loop, KappaForm kappa = KappaForm::exact) {
    SimulationParams params;
    params.loop = loop;
    params.kappa = kappa;
    return simulate(example(name), params);
}

std::vector<Update> run_vectors(const char* name, int passes) {
    SimulationParams params;
    params.loop = Loop::closed;
    params.form = Form::vectors;
    params.passes = passes;
    return simulate(example(name), params);
}

TEST(PaperExamples, ExampleOneOpenLoop) {
    const auto updates = run("I", Loop::open);
    ASSERT_EQ(updates.size(), 2'401U);
    EXPECT_NEAR(largest(updates, e_rho), 0.030113, 5e-7);
    EXPECT_NEAR(largest(updates, e_alpha), 0.019278, 5e-7);
    EXPECT_EQ(largest(updates, e_beta), 0);
    EXPECT_LT(largest(updates, rho_difference), 1e-12);
    EXPECT_NEAR(largest(run("I", Loop::open, KappaForm::two), predicted_e_alpha), 0.003797, 5e-7);
}

TEST(PaperExamples, ExampleTwoOpenLoop) {
    const auto updates = run("II", Loop::open);
    EXPECT_NEAR(largest(updates, e_rho), 0.030333, 5e-7);
    EXPECT_NEAR(updates.back().measured.position.elevation_rad, -4.56889, 5e-6);
    EXPECT_LT(largest(updates, rho_difference), 1e-12);
    EXPECT_LT(largest(updates, beta_difference), 1e-6);
    EXPECT_NEAR(run("II", Loop::open, KappaForm::two).back().predicted.elevation_rad, 3.5764, 5e-5);
}

/// (38) and remark 1: all errors vanish with the update time. Range and accumulated angles are of second order.
TEST(PaperExamples, ErrorsVanishWithTheSquareOfTheUpdateTime) {
    const auto errors_at = [](const char* name, double update_s) {
        SimulationParams params;
        params.duration_s = 2;
        params.update_s = update_s;
        const auto updates = simulate(example(name), params);
        return std::array{
            largest(updates, e_rho),           largest(updates, e_alpha),           largest(updates, e_beta),
            largest(updates, predicted_e_rho), largest(updates, predicted_e_alpha), largest(updates, predicted_e_beta)};
    };
    for (const char* name : {"I", "II"}) {
        for (const double update_s : {1.0 / 480, 1.0 / 960, 1.0 / 1920}) {
            const auto coarse = errors_at(name, update_s);
            const auto fine = errors_at(name, update_s / 2);
            for (std::size_t n = 0; n < coarse.size(); ++n) {
                EXPECT_NEAR(fine[n], coarse[n] / 4, 0.1 * coarse[n] / 4)
                    << name << " quantity " << n << " at " << update_s << " s";
            }
        }
    }
}

/// Fig. 5. The attitude passes close to poles of (18), so that errors grow without limit.
TEST(PaperExamples, OrientationOpenLoopIsChaotic) {
    Example changed = example("orientation");
    changed.attitude.amplitude *= 1 + 1e-13;
    const auto first = simulate(example("orientation"), {});
    const auto second = simulate(changed, {});
    const auto difference_rad = [&](double time_s) {
        const auto n = static_cast<std::size_t>(std::lround(time_s * 240));
        const auto& a = first[n].measured.attitude;
        const auto& b = second[n].measured.attitude;
        return std::hypot(a.azimuth_rad - b.azimuth_rad, a.elevation_rad - b.elevation_rad, a.roll_rad - b.roll_rad);
    };
    EXPECT_LT(difference_rad(1), 1e-6);
    EXPECT_GT(difference_rad(2.5), 1);
}

TEST(PaperExamples, ExamplesOneAndTwoClosedLoop) {
    const double one = largest(run("I", Loop::closed), e_alpha);
    EXPECT_LE(one, 0.00182);
    EXPECT_NEAR(one, 0.001811, 1e-6);
    const double two = largest(run("II", Loop::closed), e_beta);
    EXPECT_LE(two, 0.00191);
    EXPECT_NEAR(two, 0.001904, 1e-6);
}

TEST(PaperExamples, ExampleThreeIsAStaircaseToMinusSevenTenths) {
    EXPECT_NEAR(largest(run("III", Loop::open), e_beta), 0.71, 0.01);
}

TEST(PaperExamples, ExampleThreePoleFreeFormHasNoJumps) {
    const double one_pass = largest(run_vectors("III", 1), position_error);
    EXPECT_LE(one_pass, 0.0182);
    EXPECT_NEAR(one_pass, 0.018153, 1e-5);
    const double two_passes = largest(run_vectors("III", 2), position_error);
    EXPECT_LT(two_passes, 1e-6);
    EXPECT_GT(two_passes, 1e-7);
    EXPECT_GT(largest(run("III", Loop::closed), position_error), 0.3) << "the angle form jumps";
}

/// Chained exact steps equal the simulation of the examples with orientation, in both loops, up to the first pole.
TEST(PaperExamples, ExactStepsFollowTheOrientationExamples) {
    SimulationParams params;
    params.duration_s = 0.3;  // before the first pole of theta
    for (const Loop loop : {Loop::open, Loop::closed}) {
        params.loop = loop;
        for (const char* name : {"orientation", "IIIo"}) {
            for (const Update& update : simulate(example(name), params)) {
                EXPECT_NEAR(update.exact.attitude.roll_rad, update.measured.attitude.roll_rad, 1e-10) << name;
                EXPECT_NEAR(update.exact.attitude.azimuth_rad, update.measured.attitude.azimuth_rad, 1e-10) << name;
                EXPECT_NEAR(update.exact.position.azimuth_rad, update.measured.position.azimuth_rad, 1e-10) << name;
            }
        }
    }
}

/// Table of approximations in core/error_model/README.md: largest error of each over all updates in open loop.
TEST(Approximations, HaveTheErrorsOfTheTable) {
    struct Column {
        const char* name;
        double kappa_29, range_29_m, range_two_m, elevation_28, elevation_32, azimuth_33, azimuth_36;
    };
    using error_model::elevation_increment_error;
    using error_model::kappa;
    using error_model::measured_azimuth_increment;
    using error_model::range_error;
    for (const Column& table :
         {Column{"I", 7e-16, 2e-15, 30.1e-3, 0, 0, 1.1e-3, 2.3e-3}, Column{"II", 1e-15, 8e-16, 30.3e-3, 1e-16, 3.4e-3, 0, 0},
          Column{"III", 3.4e-4, 0.18e-3, 18.2e-3, 5.5e-6, 2.5e-4, 1.9e-3, 2.0e-3}}) {
        Column worst{};
        const auto updates = run(table.name, Loop::open);
        for (std::size_t n = 1; n < updates.size(); ++n) {
            const auto& before = updates[n - 1].real.position;
            const auto& now = updates[n].real.position;
            const error_model::LineOfSightStep<double> step{before.elevation_rad, now.azimuth_rad - before.azimuth_rad,
                                                            now.elevation_rad - before.elevation_rad};
            const auto include = [](double& largest, double difference) { largest = std::max(largest, std::abs(difference)); };
            const auto off = [&](KappaForm form, auto value) { return value(form) - value(KappaForm::exact); };
            const auto range = [&](KappaForm form) { return range_error(now.range_m, kappa(form, step)); };
            const auto elevation = [&](KappaForm form) { return elevation_increment_error(form, step); };
            const auto azimuth = [&](KappaForm form) { return measured_azimuth_increment(form, step, 0.0); };  // times cos(beta)
            include(worst.kappa_29, kappa(KappaForm::paper, step) - kappa(KappaForm::exact, step));
            include(worst.range_29_m, off(KappaForm::paper, range));
            include(worst.range_two_m, off(KappaForm::two, range));
            include(worst.elevation_28, off(KappaForm::paper, elevation));
            include(worst.elevation_32, off(KappaForm::two, elevation));
            include(worst.azimuth_33, off(KappaForm::paper, azimuth));
            include(worst.azimuth_36, off(KappaForm::two, azimuth));
        }
        // Two digits are printed, so rounding differences are below that.
        const auto agrees = [&](double measured, double printed) {
            EXPECT_NEAR(measured, printed, printed < 1e-12 ? 3e-15 : 0.05 * printed) << table.name;
        };
        agrees(worst.kappa_29, table.kappa_29);
        agrees(worst.range_29_m, table.range_29_m);
        agrees(worst.range_two_m, table.range_two_m);
        agrees(worst.elevation_28, table.elevation_28);
        agrees(worst.elevation_32, table.elevation_32);
        agrees(worst.azimuth_33, table.azimuth_33);
        agrees(worst.azimuth_36, table.azimuth_36);
    }
}

/// Remark 2 predicts wrong instants in closed loop (angle form), and at constant azimuth.
TEST(Singularities, AreNotPredictedByRemark2InClosedLoop) {
    SimulationParams params;
    const auto two = compare_singularities(simulate(example("II"), params), params.update_s);
    EXPECT_EQ(two.predicted_s.size(), 101U);
    EXPECT_EQ(two.false_alarms, 101);
    EXPECT_EQ(two.jumps_s.size(), 0U);
    params.loop = Loop::closed;
    const auto updates = simulate(example("III"), params);
    const auto closed = compare_singularities(updates, params.update_s);
    EXPECT_GT(closed.missed, 0);
    EXPECT_GT(closed.false_alarms, closed.hits);
    // The prediction assumes a known attitude; the exact steps compute it and follow the loop to its first pole.
    double predicted_off = 0;
    double exact_off = 0;
    for (const Update& u : updates) {
        if (u.time_s < 0.46) {
            predicted_off = std::max(predicted_off, std::abs(beta_difference(u)));
            exact_off = std::max(exact_off, std::abs(u.exact.position.elevation_rad - u.measured.position.elevation_rad));
        }
    }
    EXPECT_NEAR(predicted_off, 4.5e-4, 0.1e-4);
    EXPECT_LT(exact_off, 1e-12);
}

TEST(Singularities, OfExampleThreeArePredictedWithinOneUpdate) {
    SimulationParams params;
    const auto report = compare_singularities(simulate(example("III"), params), params.update_s);
    EXPECT_EQ(report.predicted_s.size(), 15U);
    EXPECT_EQ(report.jumps_s.size(), 14U);
    EXPECT_EQ(report.hits, 14);
    EXPECT_EQ(report.missed, 0);
    EXPECT_EQ(report.false_alarms, 1);
    EXPECT_LE(report.worst_distance_s, params.update_s);
    ASSERT_EQ(report.passages_s.size(), report.predicted_s.size());
    for (std::size_t n = 0; n < report.passages_s.size(); ++n) {
        EXPECT_NEAR(report.passages_s[n], report.predicted_s[n], params.update_s);
    }
}

/// Instants are 64-bit microseconds: the same motion while the count passes 2^32.
TEST(Singularities, AreDetectedAcrossThe32BitWrap) {
    SimulationParams params;
    params.duration_s = 2;
    const auto reference = compare_singularities(simulate(example("III"), params), params.update_s);
    params.start = device_time_us((std::int64_t{1} << 32) - 440'000);  // the first pole is passed at 442 ms
    const auto updates = simulate(example("III"), params);
    const auto report = compare_singularities(updates, params.update_s);
    EXPECT_GT(to_us(updates.back().stamp), std::int64_t{1} << 32);
    ASSERT_EQ(report.predicted_s.size(), reference.predicted_s.size());
    for (std::size_t n = 0; n < report.predicted_s.size(); ++n) {
        EXPECT_DOUBLE_EQ(report.predicted_s[n], reference.predicted_s[n]);
    }
}

TEST(BadInput, IsRefusedByName) {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    for (const double update_s : {0.0, -1.0, nan, 2.0, 1e-9}) {
        SimulationParams params;
        params.update_s = update_s;
        EXPECT_THROW(simulate(example("I"), params), std::invalid_argument) << update_s;
    }
    for (const double rate : {nan, 1e300, -1e5}) {
        Example bad = example("I");
        bad.azimuth.amplitude = rate;
        EXPECT_THROW(simulate(bad, {}), std::invalid_argument) << rate;
    }
    EXPECT_THROW(example("IV"), std::invalid_argument);
    Example too_fast = example("II");
    too_fast.elevation.offset = 300;  // more than 54.7 degrees per update
    EXPECT_THROW(simulate(too_fast, {}), std::invalid_argument);
    SimulationParams open_vectors;
    open_vectors.form = Form::vectors;
    EXPECT_THROW(simulate(example("I"), open_vectors), std::invalid_argument);
}

}  // namespace
}  // namespace tricoil::paper
