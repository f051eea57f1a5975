// Errors of past predictions. They correct the next predictions and scale the deviations that these state.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <utility>

#include "core/tracking/scaat/propagate.hpp"

namespace tricoil::tracking::scaat {

/// Past errors of position or attitude, with exponential forgetting. A least-squares fit explains them by rate and acceleration.
/// What remains, over the growth of the variance, gives the ratio. The prior is worth kPrior predictions without an error to
/// correct, at this rate and acceleration. Slower motion changes little: errors at rest do not tell how a hand will start to
/// move.
template <typename Scalar>
struct PastErrors {
    static constexpr Scalar kPrior = 4;
    static constexpr Scalar kPriorCorrelation_s = Scalar(0.004);  // time for which the acceleration of the prior stays
    static constexpr Scalar kLeastRatio = Scalar(0.05);           // a quiet motion may end at any time
    static constexpr Scalar kOutlying = 25;                       // limit of squares, as a multiple of their expectation

    Scalar horizon_s;
    Scalar rate;
    Scalar acceleration;
    Scalar squares = 0;
    Scalar growth = 0;
    Mat3<Scalar> products = Mat3<Scalar>::Zero();  // of rate, acceleration times half the horizon, error over the horizon
    Scalar by_rate = 0;
    Scalar by_acceleration = 0;

    Vec3<Scalar> correction(const Vec3<Scalar>& v, const Vec3<Scalar>& a) const {
        return horizon_s * (by_rate * v + by_acceleration * (horizon_s / 2) * a);
    }
    Scalar ratio() const {
        const Scalar prior = kPrior * kPriorCorrelation_s * acceleration * acceleration * horizon_s * horizon_s * horizon_s;
        return std::max((squares + prior) / (growth + prior), kLeastRatio);
    }
    /// error: true minus predicted displacement. grown: growth of the variance. kept: factor on the weight of older errors.
    void add(const Vec3<Scalar>& error, const Vec3<Scalar>& v, const Vec3<Scalar>& a, Scalar grown, Scalar kept) {
        const Vec3<Scalar> remaining = error - correction(v, a);
        const Scalar share = std::min(Scalar(1), kOutlying * ratio() * grown / remaining.squaredNorm());
        squares = kept * squares + share * remaining.squaredNorm();
        growth = kept * growth + grown;
        Mat3<Scalar> terms;
        terms.col(0) = v;
        terms.col(1) = (horizon_s / 2) * a;
        terms.col(2) = (error - (1 - share) * remaining) / horizon_s;
        products = kept * products + terms.transpose() * terms;
        const Scalar vv = products(0, 0) + kPrior * rate * rate;
        const Scalar aa = products(1, 1) + kPrior * (horizon_s * horizon_s / 4) * acceleration * acceleration;
        const Scalar determinant = vv * aa - products(0, 1) * products(0, 1);  // positive because of the prior
        by_rate = (aa * products(0, 2) - products(0, 1) * products(1, 2)) / determinant;
        by_acceleration = (vv * products(1, 2) - products(0, 1) * products(0, 2)) / determinant;
    }
};

/// Compares predictions over a fixed time with the later states of the filter. The variance of their difference is that by which
/// a prediction is more uncertain than the state from which it was made.
template <typename Scalar>
class Horizon {
public:
    explicit Horizon(Microseconds ahead)
        : ahead_(ahead),  // rates and accelerations of a slow hand
          errors_{{{seconds_as<Scalar>(ahead), Scalar(0.5), 5}, {seconds_as<Scalar>(ahead), 3, 30}}} {}

    /// For a state that does not continue the last one: discards the predictions that were not compared yet.
    void restart() { waiting_ = 0; }

    /// is_confirmed: of the present state; only then it tells the errors. inflations: of the covariance so far.
    void compare(const Motion<Scalar>& now, bool is_confirmed, std::uint64_t inflations) {
        forget_before(inflations, now.time);
        constexpr Scalar kMemory_s = Scalar(0.5);
        constexpr Scalar kForget_s = 2;
        for (; waiting_ > 0 && past_[first_].motion.time <= now.time; --waiting_) {
            const auto& [then, grown, interval_s] = past_[std::exchange(first_, (first_ + 1) % past_.size())];
            if (!is_confirmed) {
                continue;
            }
            const Scalar back_s = seconds_as<Scalar>(then.time - now.time);
            const Scalar kept = interval_s > kForget_s ? Scalar(0) : 1 / (1 + std::max(interval_s / kMemory_s, Scalar(0)));
            const Quat<Scalar> turn = geometry::rotation_vector_to_quaternion<Scalar>(
                displacement<Scalar>(now.rate_rad_s, now.angular_acceleration_rad_s2, back_s));
            const Quat<Scalar> q_error = turn * now.q_source_sensor * then.q_source_sensor.conjugate();
            const Vec3<Scalar> moved = displacement<Scalar>(now.velocity_m_s, now.acceleration_m_s2, back_s);
            errors_[0].add(now.position_m + moved - then.position_m, then.velocity_m_s, then.acceleration_m_s2, grown[0], kept);
            errors_[1].add(geometry::quaternion_to_rotation_vector<Scalar>(q_error), then.rate_rad_s,
                           then.angular_acceleration_rad_s2, grown[1], kept);
        }
    }

    /// Corrects a prediction and its pose covariance. before: covariance of the state from which it was made. factor: on the
    /// covariance in the report. keep: compare() will use it.
    void correct(State<Scalar>& later, const Mat12<Scalar>& before, Scalar factor, bool keep) {
        std::array<Scalar, 2> grown{};
        for (std::size_t n = 0; n < 2; ++n) {
            const int at = 3 * static_cast<int>(n);
            const Scalar all = later.covariance.template block<3, 3>(at, at).trace();
            const Scalar growth = std::max(all - before.template block<3, 3>(at, at).trace(), Scalar(0));
            const Scalar scale = std::sqrt(1 + (errors_[n].ratio() - 1) * growth / all);
            for (int i = 0; i < 18; ++i) {
                later.covariance(at + i / 6, i % 6) *= scale;
                later.covariance(i % 6, at + i / 6) *= scale;
            }
            grown[n] = factor * growth;
        }
        if (keep && learns_ && waiting_ < past_.size() && (waiting_ == 0 || later.time - newest_ >= ahead_ / past_.size())) {
            past_[(first_ + waiting_++) % past_.size()] = {later, grown, seconds_as<Scalar>(later.time - newest_)};
            newest_ = later.time;
        }
        later.position_m += errors_[0].correction(later.velocity_m_s, later.acceleration_m_s2);
        later.q_source_sensor = geometry::rotation_vector_to_quaternion<Scalar>(
                                    errors_[1].correction(later.rate_rad_s, later.angular_acceleration_rad_s2)) *
                                later.q_source_sensor;
        later.q_source_sensor.normalize();
    }

private:
    struct Past {
        Motion<Scalar> motion;  // before its correction
        std::array<Scalar, 2> growth{};
        Scalar interval_s = 0;  // since the one before
    };
    /// An inflation for a wrong column leaves wrong rates and a large process noise. Of the predictions from there the deviations
    /// are far larger than the errors; their ratio and their fit made later deviations up to four times too small. All past
    /// errors are therefore forgotten, and new ones used when the process noise has fallen again.
    void forget_before(std::uint64_t inflations, DeviceTime now) {
        constexpr Microseconds kSettling{1'000'000};
        if (std::exchange(inflations_, inflations) != inflations) {
            restart();
            for (PastErrors<Scalar>& errors : errors_) {
                errors = {errors.horizon_s, errors.rate, errors.acceleration};
            }
            inflated_ = now;
        }
        learns_ = !inflated_ || now < *inflated_ || now - *inflated_ >= kSettling;
    }

    Microseconds ahead_;
    std::array<PastErrors<Scalar>, 2> errors_;  // position, attitude
    std::array<Past, 8> past_{};
    std::size_t first_ = 0;
    std::size_t waiting_ = 0;
    DeviceTime newest_{};
    std::uint64_t inflations_ = 0;
    std::optional<DeviceTime> inflated_;
    bool learns_ = true;  // from the present state
};

template <>
class Horizon<float> {  // images do not predict
public:
    explicit Horizon(Microseconds /*ahead*/) {}
    void restart() {}
    void compare(auto&&...) {}
    void correct(auto&&...) {}
};

}  // namespace tricoil::tracking::scaat
