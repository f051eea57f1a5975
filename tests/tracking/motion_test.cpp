// Motion errors of each tracker on generated motions: ratios, lag, prediction, rest, jumps, poles.
#include <gtest/gtest.h>

#include <random>

#include "core/geometry/rotations.hpp"
#include "tests/support/deviation_score.hpp"
#include "tests/support/hand_like.hpp"

namespace tricoil::tracking {
namespace {

using test::ReplayParams;
using test::Score;

Score play_filter(const sim::Motion& motion, const ReplayParams& params) {
    auto filter = test::scaat_filter<double>(test::scaat_params<double>(params.tdm, motion.at(params.begin_s).position_m));
    return test::play<double>(motion, params, filter);
}

Score play_direct(const sim::Motion& motion, const ReplayParams& params, bool deskew) {
    auto tracker = test::direct_tracker<double>(params.tdm, deskew, motion.at(params.begin_s).position_m);
    return test::play<double>(motion, params, tracker);
}

/// Naive, deskewed and filtered poses for several hand motions.
std::array<Score, 3> play_hands(double sigma) {
    std::array<Score, 3> scores;
    for (std::uint64_t seed = 1; seed <= 5; ++seed) {
        const auto motion = test::hand_like(seed);
        ReplayParams params;
        params.sigma = sigma;
        params.seed = seed;
        params.duration_s = 10;
        scores[0].add(play_direct(motion, params, false));
        scores[1].add(play_direct(motion, params, true));
        scores[2].add(play_filter(motion, params));
    }
    return scores;
}

TEST(GeneratedHand, WithoutNoise) {
    const auto [naive, deskewed, filtered] = play_hands(0);
    std::printf("naive %.3f mm, deskewed 1/%.1f, filtered 1/%.1f\n", 1e3 * naive.position().rms,
                naive.position().rms / deskewed.position().rms, naive.position().rms / filtered.position().rms);
    EXPECT_GT(naive.position().rms, 3e-3);
    EXPECT_GT(naive.position().rms / filtered.position().rms, 100);
    EXPECT_GT(naive.orientation().rms / filtered.orientation().rms, 100);
    EXPECT_GT(naive.position().rms / deskewed.position().rms, 12);
    EXPECT_LT(filtered.position().max, 1e-3);
}

TEST(GeneratedHand, WithLittleNoise) {
    const auto [naive, deskewed, filtered] = play_hands(test::sigma_for_cost(0.05e-3));
    std::printf("naive %.3f mm, filtered 1/%.1f\n", 1e3 * naive.position().rms, naive.position().rms / filtered.position().rms);
    EXPECT_GT(naive.position().rms / filtered.position().rms, 15);
    EXPECT_EQ(filtered.invalid, 0U);
}

TEST(GeneratedHand, WithMuchNoise) {
    const auto [naive, deskewed, filtered] = play_hands(test::sigma_for_cost(0.5e-3));
    std::printf("bound %.3f mm, filtered %.3f mm\n", 1e3 * filtered.static_bound_m(), 1e3 * filtered.position().rms);
    EXPECT_LT(filtered.position().rms, 0.7 * filtered.static_bound_m());
}

TEST(GeneratedHand, CovarianceIsHonest) {
    for (const double cost_m : {0.05e-3, 0.5e-3}) {
        const auto filtered = play_hands(test::sigma_for_cost(cost_m))[2];
        EXPECT_GT(filtered.nees_position_per_dof(), 0.5);
        EXPECT_LT(filtered.nees_position_per_dof(), 1.5);
        EXPECT_GT(filtered.nees_rotation_per_dof(), 0.5);
        EXPECT_LT(filtered.nees_rotation_per_dof(), 1.5);
        EXPECT_LE(static_cast<double>(filtered.beyond_5_sigma), 1e-3 * filtered.count());
    }
}

/// The time of a pose is the midpoint of its newest column: no lag at constant velocity.
TEST(Latency, ConstantVelocityDoesNotLag) {
    const Vec3<double> velocity(0.1, 0.9, -0.3);
    const Vec3<double> rate(0.5, -2, 4);
    const test::RampMotion motion({{0.5, -0.4, 0.2}, Quat<double>::Identity()}, velocity, rate);
    for (const double sigma : {0.0, test::sigma_for_cost(0.5e-3)}) {
        double lag_s = 0;
        double turn_lag_s = 0;
        int poses = 0;
        for (std::uint64_t seed = 1; seed <= 20; ++seed) {
            auto filter = test::scaat_filter<double>(test::scaat_params<double>(true));
            test::replay<double>(motion, {true, sigma, seed, 0, 1.0}, [&](const Column<double>& column) {
                const auto e = filter.update(column);
                const double t = to_seconds(column.midpoint);
                if (!e || t < 0.5) {
                    return;
                }
                EXPECT_EQ(e->time, column.midpoint);
                const auto truth = motion.at(t);
                lag_s -= (e->position_m - truth.position_m).dot(velocity) / velocity.squaredNorm();
                turn_lag_s -=
                    geometry::quaternion_to_rotation_vector<double>(e->q_source_sensor * truth.q_source_sensor.conjugate())
                        .dot(rate) /
                    rate.squaredNorm();
                ++poses;
            });
        }
        std::printf("sigma %.1e: lag %.2f us, turning %.2f us\n", sigma, 1e6 * lag_s / poses, 1e6 * turn_lag_s / poses);
        EXPECT_LT(std::abs(lag_s / poses), 1e-4);
        EXPECT_LT(std::abs(turn_lag_s / poses), 1e-4);
    }
}

/// At rest for a second, then 20 m/s^2 for 0.1 s, then 2 m/s.
class Start final : public sim::Motion {
public:
    static constexpr double kBegin_s = 1;
    static constexpr double kEnd_s = 1.1;
    [[nodiscard]] static Vec3<double> direction() { return Vec3<double>(0.3, 0.9, -0.2).normalized(); }

private:
    [[nodiscard]] sim::Pose do_at(double t) const override {
        const double a = std::clamp(t - kBegin_s, 0.0, kEnd_s - kBegin_s);
        const double way = 10 * a * a + 2 * std::max(t - kEnd_s, 0.0);
        return {Vec3<double>(0.5, -0.4, 0.2) + way * direction(), Quat<double>::Identity()};
    }
};

/// Low noise at rest must not cause a lag when the hand starts: at most 2 ms during acceleration, covered by the covariance, and
/// none from 30 ms after the acceleration ends.
TEST(Adaptivity, AStartingHandIsFollowedWithoutLag) {
    const Start motion;
    const double sigma = test::sigma_for_snr(60, 0.5);
    double starting_lag_s = 0;
    double moving_lag_s = 0;
    int starting = 0;
    int moving = 0;
    Score score;
    for (std::uint64_t seed = 1; seed <= 20; ++seed) {
        auto filter = test::scaat_filter<double>(test::scaat_params<double>(true));
        test::replay<double>(motion, {true, sigma, seed, 0, 1.5}, [&](const Column<double>& column) {
            const auto e = filter.update(column);
            const double t = to_seconds(column.midpoint);
            if (!e || t < Start::kBegin_s) {
                return;
            }
            score.add(*e, motion, sigma);
            const double along_m = (e->position_m - motion.at(t).position_m).dot(Start::direction());
            if (t > Start::kBegin_s + 0.05 && t < Start::kEnd_s) {
                starting_lag_s -= along_m / (20 * (t - Start::kBegin_s));
                ++starting;
            } else if (t > Start::kEnd_s + 0.03) {
                moving_lag_s -= along_m / 2;
                ++moving;
            }
        });
    }
    std::printf(
        "starting with 20 m/s^2: %.0f us behind from 50 ms on; at 2 m/s: %.1f us; error^2 / covariance %.2f, %zu invalid\n",
        1e6 * starting_lag_s / starting, 1e6 * moving_lag_s / moving, score.nees_position_per_dof(), score.invalid);
    EXPECT_LT(std::abs(starting_lag_s / starting), 2e-3);
    EXPECT_LT(std::abs(moving_lag_s / moving), 1e-4);
    EXPECT_LT(score.nees_position_per_dof(), 1.5);
    EXPECT_LE(static_cast<double>(score.beyond_5_sigma), 1e-3 * score.count());
}

/// A hand up to three times as fast as the recorded ones: the budget of deskewed poses contains the curvature of the couplings.
TEST(DirectBudget, ExplainsTheErrorsOfDeskewedPoses) {
    for (const double cost_m : {0.0, 0.05e-3}) {
        for (const double speed : {0.7, 1.4, 2.1}) {  // of the simulated hand
            double error = 0;
            double predicted = 0;
            for (std::uint64_t seed = 1; seed <= 5; ++seed) {
                const sim::HandMotion hand({0.75, 0, 0}, seed);
                const test::ScaledTime motion(hand, speed);
                auto tracker = test::direct_tracker<double>(true, true);
                test::replay<double>(motion, {true, test::sigma_for_cost(cost_m), seed, 0, 5}, [&](const Column<double>& column) {
                    const auto e = tracker.update(column);
                    if (e && e->predicted_error && to_seconds(e->time) > 0.5) {
                        error += (e->position_m - motion.at(to_seconds(e->time)).position_m).squaredNorm();
                        predicted += e->predicted_error->total.position_m * e->predicted_error->total.position_m;
                    }
                });
            }
            std::printf("cost %.2f mm, speed %.1f: predicted / measured %.3f\n", 1e3 * cost_m, speed,
                        std::sqrt(predicted / error));
            EXPECT_NEAR(std::sqrt(predicted / error), 1, 0.1);
        }
    }
}

TEST(Prediction, BeatsHoldingTheLastPose) {
    constexpr Microseconds kAhead{20'000};
    const auto motion = test::hand_like(7);
    auto params = test::scaat_params<double>(true);
    std::get<ScaatParams<double>>(params.method).predict_ahead = kAhead;
    auto filter = test::scaat_filter<double>(params);
    Score predicted;
    Score held;
    test::replay<double>(motion, {true, test::sigma_for_cost(0.05e-3), 1, 0, 10}, [&](const Column<double>& column) {
        const auto e = filter.update(column);
        if (!e) {
            return;
        }
        EXPECT_EQ(e->time, column.midpoint + kAhead);
        predicted.add(*e, motion, 0);
        auto last = *e;
        last.position_m = filter.motion().position_m;
        last.q_source_sensor = filter.motion().q_source_sensor;
        held.add(last, motion, 0);
    });
    std::printf("20 ms ahead: %.2f mm, held %.2f mm\n", 1e3 * predicted.position().rms, 1e3 * held.position().rms);
    EXPECT_GT(held.position().rms / predicted.position().rms, 3);
    EXPECT_GT(held.orientation().rms / predicted.orientation().rms, 3);
}

/// Deviations of predictions of simulated hands at half, usual and twice the speed. Without past predictions, as in images
/// (float), the limits are wider.
template <typename Scalar>
void expect_stated_deviation(double least, double most) {
    for (const bool tdm : {true, false}) {
        for (const int ahead_ms : {5, 20, 50, 100}) {
            test::DeviationScore all;
            std::size_t invalid = 0;  // without prediction
            for (const double speed : {1.5, 3.0}) {
                const auto hand = test::hand_like(4);
                const test::ScaledTime motion(hand, speed);
                const ReplayParams params{tdm, test::sigma_for_cost(0.05e-3), 2, 0, 8};
                const auto score = test::score_predictions<Scalar>(motion, params, Microseconds{1000 * ahead_ms});
                std::printf("%s, speed %.1f, %3d ms: %.3f mm, stated / actual: position %.2f, rotation %.2f\n",
                            tdm ? "TDM" : "FDM", speed, ahead_ms, 1e3 * score.rms_m(), score.ratio(), score.rotation_ratio());
                EXPECT_GT(score.ratio(), least);
                EXPECT_LT(score.ratio(), most);
                EXPECT_GT(score.rotation_ratio(), least);
                EXPECT_LT(score.rotation_ratio(), most);
                all.add(score);
                invalid += test::score_predictions<Scalar>(motion, params, Microseconds{0}).invalid;
            }
            EXPECT_LE(all.invalid, invalid);
        }
    }
}

TEST(Prediction, StatesItsDeviation) { expect_stated_deviation<double>(0.8, 1.3); }

TEST(Prediction, StatesItsDeviationInFloat) { expect_stated_deviation<float>(0.6, 1.6); }

/// A shaken sensor: 2 Hz, 0.1 m, up to 16 m/s^2. The errors of past predictions show that its acceleration turns with the
/// position.
TEST(Prediction, FollowsAnAcceleration) {
    const sim::LineMotion motion({{0.7, 0, 0}, Quat<double>::Identity()}, {0.1, 0.05, 0}, 2);
    for (const bool tdm : {true, false}) {
        const ReplayParams params{tdm, test::sigma_for_cost(0.05e-3), 3, 0, 6};
        constexpr double kAhead_s = 0.05;
        double constant_velocity = 0;
        std::size_t count = 0;
        auto filter = test::scaat_filter<double>(test::scaat_params<double>(tdm));
        test::replay<double>(motion, params, [&](const Column<double>& column) {
            const auto e = filter.update(column);
            if (e && to_seconds(e->time) > 0.5) {
                const Vec3<double> there = e->position_m + kAhead_s * filter.motion().velocity_m_s;
                constant_velocity += (there - motion.at(to_seconds(e->time) + kAhead_s).position_m).squaredNorm();
                ++count;
            }
        });
        const double rms_m = std::sqrt(constant_velocity / static_cast<double>(count));
        const auto score = test::score_predictions<double>(motion, params, microseconds_from_seconds(kAhead_s));
        std::printf("%s: %.3f mm, constant velocity %.3f mm, stated / actual %.2f\n", tdm ? "TDM" : "FDM", 1e3 * score.rms_m(),
                    1e3 * rms_m, score.ratio());
        EXPECT_LT(score.rms_m(), 0.25 * rms_m);
        EXPECT_GT(score.ratio(), 0.8);
        EXPECT_LT(score.ratio(), 1.8);  // it is smoother than a hand
    }
}

/// One simultaneous column of 100 has a wrong coupling. The filter inflates its covariance; predictions stay honest afterwards.
TEST(Prediction, IsHonestAfterWrongColumns) {
    constexpr Microseconds kAhead{20'000};
    Score score;
    for (std::uint64_t seed = 1; seed <= 4; ++seed) {
        const auto motion = test::hand_like(seed);
        auto params = test::scaat_params<double>(false, motion.at(0).position_m);
        std::get<ScaatParams<double>>(params.method).predict_ahead = kAhead;
        auto filter = test::scaat_filter<double>(params);
        std::mt19937_64 random(seed + 77);
        std::uniform_real_distribution<double> uniform(0, 1);
        test::replay<double>(motion, {false, test::sigma_for_cost(0.2e-3), seed, 0, 10}, [&](Column<double> column) {
            if (uniform(random) < 0.01) {
                column.in_phase(0) += std::pow(10, -2 * uniform(random)) * column.in_phase.norm();
            }
            if (const auto e = filter.update(column)) {
                score.add(*e, motion, 0);
            }
        });
    }
    std::printf("wrong columns: %zu of %.0f valid predictions beyond 5 sigma, %zu invalid\n", score.beyond_5_sigma, score.count(),
                score.invalid);
    EXPECT_GT(score.count(), 8000);
    EXPECT_LE(static_cast<double>(score.beyond_5_sigma), 1e-3 * score.count());
}

/// A jump is no error of a prediction from which the filter learns.
TEST(Prediction, IsNotChangedByAJump) {
    sim::Pose after{{0.6, 0, 0}, Quat<double>::Identity()};
    after.position_m.y() += 0.2;
    const test::StepMotion motion({{0.6, 0, 0}, Quat<double>::Identity()}, after, 2);
    for (const bool tdm : {true, false}) {
        auto params = test::scaat_params<double>(tdm);
        std::get<ScaatParams<double>>(params.method).predict_ahead = Microseconds{50'000};
        auto filter = test::scaat_filter<double>(params);
        double most_m = 0;
        std::size_t invalid = 0;
        test::replay<double>(motion, {tdm, test::sigma_for_snr(60, 0.6), 5, 0, 3}, [&](const Column<double>& column) {
            const auto e = filter.update(column);
            if (e && to_seconds(column.midpoint) > 2.2) {
                invalid += e->valid() ? 0U : 1U;
                most_m = std::max({most_m, deviation_m(*e), (e->position_m - after.position_m).norm()});
            }
        });
        std::printf("%s: deviation and error at most %.1f mm\n", tdm ? "TDM" : "FDM", 1e3 * most_m);
        EXPECT_EQ(invalid, 0U);
        EXPECT_LT(most_m, 0.03);
    }
}

TEST(Still, NoiseIsHalfOfTheDirectSolversAtMost) {
    const sim::Pose pose{{0.3, 0.4, 0}, geometry::rotation_vector_to_quaternion<double>({0.3, -0.2, 0.6})};
    const sim::StillMotion motion(pose);
    for (const bool tdm : {true, false}) {
        const ReplayParams params{tdm, test::sigma_for_snr(60, 0.5), 5, 0, 10.5};
        const double direct = play_direct(motion, params, false).position().rms;
        const Score filtered = play_filter(motion, params);
        std::printf("%s: direct %.3f mm, filtered %.3f mm\n", tdm ? "tdm" : "fdm", 1e3 * direct, 1e3 * filtered.position().rms);
        EXPECT_LT(filtered.position().rms, 0.5 * direct);
        EXPECT_EQ(filtered.invalid, 0U);
        EXPECT_EQ(filtered.beyond_5_sigma, 0U);
    }
}

/// A jump of 10 cm: the first column after it is refused, the third restarts the filter. Three frames after the jump it has
/// settled.
TEST(Step, IsReachedWithinThreeFrames) {
    const sim::Pose before{{0.5, 0, 0}, geometry::rotation_vector_to_quaternion<double>({0.3, -0.2, 0.6})};
    sim::Pose after = before;
    after.position_m.y() += 0.1;
    const double sigma = test::sigma_for_snr(60, 0.5);
    const double direct = play_direct(sim::StillMotion(after), {true, sigma, 5, 0, 10.5}, false).position().rms;
    double squares = 0;
    constexpr int kRuns = 60;
    for (int run = 0; run < kRuns; ++run) {
        const double jump_s = 1.0 + run % 3 / test::kSlotsPerSecond;  // at each phase of the frame
        const test::StepMotion motion(before, after, jump_s - 1e-4);
        auto filter = test::scaat_filter<double>(test::scaat_params<double>(true));
        std::optional<PoseEstimate<double>> last;
        const double end_s = jump_s + 9.5 / test::kSlotsPerSecond;
        test::replay<double>(motion, {true, sigma, static_cast<std::uint64_t>(run + 1), 0, end_s},
                             [&](const Column<double>& column) {
                                 last = filter.update(column);
                                 const double t = to_seconds(column.midpoint);
                                 if (last && last->valid() && t > 0.1) {
                                     EXPECT_LT((last->position_m - motion.at(t).position_m).norm(), 0.02)
                                         << "valid, but more than 20 mm off; s after the jump: " << t - jump_s;
                                 }
                             });
        ASSERT_TRUE(last.has_value());
        EXPECT_TRUE(last->valid());
        EXPECT_EQ(filter.counters().reacquisitions, 1U);
        squares += (last->position_m - after.position_m).squaredNorm();
    }
    std::printf("after three frames: %.2f mm RMS over %d jumps\n", 1e3 * std::sqrt(squares / kRuns), kRuns);
    EXPECT_LT(std::sqrt(squares / kRuns), 1e-3 + direct);
}

/// No false reacquisition in ten minutes of hand motion with noise.
TEST(Step, CausesNoFalseReacquisition) {
    std::uint64_t reopened = 0;
    std::uint64_t opened = 0;
    std::uint64_t outliers = 0;
    std::uint64_t columns = 0;
    for (std::uint64_t seed = 1; seed <= 10; ++seed) {
        const auto motion = test::hand_like(seed);
        auto filter = test::scaat_filter<double>(test::scaat_params<double>(true));
        test::play<double>(motion, {true, test::sigma_for_cost(0.2e-3), seed, 0, 60}, filter);
        reopened += filter.counters().reacquisitions;
        opened += filter.counters().covariance_inflations;
        outliers += filter.counters().outliers;
        columns += filter.counters().accepted;
    }
    std::printf("%llu columns: %llu refused by the gate, %llu reacquisitions\n", static_cast<unsigned long long>(columns),
                static_cast<unsigned long long>(outliers), static_cast<unsigned long long>(reopened));
    EXPECT_EQ(reopened, 0U);
    EXPECT_EQ(opened, 0U);
    EXPECT_LT(outliers, 10U);
}

/// 15.7 m/s around a circle, 6.5 cm from frame to frame: simultaneous columns are linearised at their own direct pose.
TEST(Everywhere, SimultaneousColumnsFollowLargeMotionPerFrame) {
    const test::OrbitMotion motion(0.5, {0, 0, 1}, 5.0);
    auto filter = test::scaat_filter<double>(test::scaat_params<double>(false));
    std::size_t valid = 0;
    std::size_t poses = 0;
    test::replay<double>(motion, {false, 1e-6, 1, 0, 4}, [&](const Column<double>& column) {
        if (const auto e = filter.update(column)) {
            ++poses;
            valid += e->valid() ? 1U : 0U;
        }
    });
    EXPECT_GT(valid, poses * 9 / 10);
}

/// Sensors that already spin or pass by when the tracker is switched on: valid and right within 0.1 s.
TEST(Everywhere, AFastSensorIsAcquired) {
    constexpr double kUntilS = 0.4;
    std::mt19937 random(3);
    std::normal_distribution<double> number;
    const auto direction = [&] { return Vec3<double>(number(random), number(random), number(random)).normalized(); };
    for (const auto& motion_case : {std::pair{36.0, 0.0}, {70.0, 0.0}, {100.0, 0.0}, {0.0, 5.0}, {100.0, 5.0}}) {
        const double rate_rad_s = motion_case.first;
        const double speed_m_s = motion_case.second;
        std::uint64_t lost = 0;
        for (int n = 0; n < 20; ++n) {
            const Vec3<double> along = direction();
            const Vec3<double> aside = along.cross(direction()).normalized();
            const Vec3<double> axis = direction();
            const Quat<double> attitude = geometry::rotation_vector_to_quaternion<double>(number(random) * axis);
            const test::RampMotion motion({0.75 * along - 0.1 * speed_m_s * aside, attitude}, speed_m_s * aside,
                                          rate_rad_s * direction());
            auto filter = test::scaat_filter<double>(test::scaat_params<double>(true, along));
            const double sigma = test::sigma_for_cost(0.5e-3);
            double rotation_error = 1;
            test::replay<double>(motion, {true, sigma, static_cast<std::uint64_t>(n), 0, kUntilS}, [&](const Column<double>& c) {
                const auto e = filter.update(c);
                if (e && to_seconds(c.midpoint) > 0.1) {
                    rotation_error =
                        geometry::angle_between(e->q_source_sensor, motion.at(to_seconds(c.midpoint)).q_source_sensor);
                    EXPECT_LT(rotation_error, 0.05) << rate_rad_s << " rad/s, " << speed_m_s << " m/s, run " << n;
                }
            });
            EXPECT_LT(rotation_error, 0.05);
            lost += filter.counters().reacquisitions;
        }
        EXPECT_LE(lost, 20U) << rate_rad_s << " rad/s, " << speed_m_s << " m/s";
    }
}

/// No jump, invalid pose or NaN at poles of position and attitude and at the hemisphere boundary.
TEST(Everywhere, NoJumpNoFlagNoNaN) {
    const std::array<Vec3<double>, 4> axes{Vec3<double>{0, 1, 0}, Vec3<double>{1, 0, 0}, Vec3<double>{0, 0, 1},
                                           Vec3<double>{1, 1, 1}};
    for (const auto& axis : axes) {
        const test::OrbitMotion motion(0.5, axis, 1.0);
        for (const bool tdm : {true, false}) {
            const double sigma = test::sigma_for_snr(60, 0.5);
            auto filter = test::scaat_filter<double>(test::scaat_params<double>(tdm, motion.at(0).position_m));
            Vec3<double> before = motion.at(0).position_m;
            int poses = 0;
            int distorted = 0;  // a warning that noise alone gives once in 1,000
            test::replay<double>(motion, {tdm, sigma, 9, 0, 5}, [&](const Column<double>& column) {
                const auto e = filter.update(column);
                if (!e || poses++ < 10) {
                    return;
                }
                ASSERT_TRUE(e->position_m.allFinite() && e->q_source_sensor.coeffs().allFinite() && e->covariance.allFinite());
                EXPECT_TRUE(e->valid()) << e->flags.bits();
                distorted += e->flags.has(PoseFlag::distorted) ? 1 : 0;
                EXPECT_LT((e->position_m - motion.at(to_seconds(e->time)).position_m).norm(), 8e-3);
                EXPECT_LT((e->position_m - before).norm(), poses > 11 ? 0.025 : 1);
                before = e->position_m;
            });
            EXPECT_GT(poses, 1000);
            EXPECT_LT(distorted, poses / 250);
            EXPECT_EQ(filter.counters().reacquisitions, 0U);
        }
    }
}

TEST(PaperExampleIII, SimultaneousColumns) {
    sim::PaperRates rates;
    rates.azimuth_amplitude = 8 * 3.14159265358979323846;
    rates.elevation_amplitude = 1.5 * 3.14159265358979323846;
    const sim::PaperMotion motion(rates);
    const ReplayParams fdm{false, 0, 1, 0, 5};
    const ReplayParams tdm{true, 0, 1, 0, 5};
    const Score at_once = play_filter(motion, fdm);
    const Score in_turn = play_filter(motion, tdm);
    std::printf("FDM: max %.4f mm; TDM: RMS %.2f mm, max %.2f mm, deskewed direct RMS %.2f mm max %.2f mm, naive RMS %.1f mm\n",
                1e3 * at_once.position().max, 1e3 * in_turn.position().rms, 1e3 * in_turn.position().max,
                1e3 * play_direct(motion, tdm, true).position().rms, 1e3 * play_direct(motion, tdm, true).position().max,
                1e3 * play_direct(motion, tdm, false).position().rms);
    EXPECT_LT(at_once.position().max, 1e-4);
    EXPECT_EQ(at_once.invalid, 0U) << at_once.flags.bits();

    // In TDM the remaining error is close to the filter's error budget: accelerations between two columns of a coil.
    auto filter = test::scaat_filter<double>(test::scaat_params<double>(true, motion.at(0).position_m));
    std::vector<double> expected_m;
    test::replay<double>(motion, tdm, [&](const Column<double>& column) {
        const auto e = filter.update(column);
        if (e && e->predicted_error && to_seconds(e->time) > 0.5) {
            expected_m.push_back(e->predicted_error->total.position_m);
        }
    });
    const double expected = host::summarise(expected_m).rms;
    std::printf("TDM: %.3f mm RMS with a predicted error of %.3f mm, %zu of %.0f invalid\n", 1e3 * in_turn.position().rms,
                1e3 * expected, in_turn.invalid, in_turn.count());
    EXPECT_LT(in_turn.position().rms, 1.5 * expected);
    EXPECT_GT(in_turn.position().rms, 0.3 * expected);
}

}  // namespace
}  // namespace tricoil::tracking
