#include "sim/motion/simple_motions.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

namespace tricoil::sim {
namespace {

constexpr double kTurn_rad = 2 * std::numbers::pi;

/// Integral from 0 to t of offset + a sin(a t).
double integrated_rate(double a, double offset, double t) { return offset * t + 1 - std::cos(a * t); }

}  // namespace

LineMotion::LineMotion(const Pose& centre, const Vec3<double>& amplitude_m, double rate_hz)
    : centre_(centre), amplitude_m_(amplitude_m), rate_rad_s_(kTurn_rad * rate_hz) {}

Pose LineMotion::do_at(double time_s) const {
    return {centre_.position_m + amplitude_m_ * std::sin(rate_rad_s_ * time_s), centre_.q_source_sensor};
}

CircleMotion::CircleMotion(const Vec3<double>& centre_m, double radius_m, double rate_hz)
    : centre_m_(centre_m), radius_m_(radius_m), rate_rad_s_(kTurn_rad * rate_hz) {}

Pose CircleMotion::do_at(double time_s) const {
    const double angle = rate_rad_s_ * time_s;
    const Vec3<double> offset(std::cos(angle), std::sin(angle), 0);
    return {centre_m_ + radius_m_ * offset, geometry::rotation_vector_to_quaternion<double>({0, 0, angle})};
}

Pose PivotMotion::do_at(double time_s) const {
    const double angle = kTurn_rad * params_.rate_hz * time_s;
    const Vec3<double> share(std::sin(angle), std::sin(1.618 * angle), std::sin(0.618 * angle));
    const Quat<double> q = params_.q_mean * geometry::rotation_vector_to_quaternion<double>(params_.tilt_rad.cwiseProduct(share));
    return {params_.pivot_m - q * params_.tip_m, q};
}

GridMotion::GridMotion(const GridParams& params, std::uint64_t seed) : params_(params) {
    std::mt19937_64 random(seed);
    std::normal_distribution<double> normal;
    for (std::size_t n = 0; n < params.poses(); ++n) {
        const double w = normal(random);
        const double x = normal(random);
        const double y = normal(random);
        attitudes_.push_back(Quat<double>(w, x, y, normal(random)).normalized());
    }
}

Pose GridMotion::do_at(double time_s) const {
    const double last = static_cast<double>(attitudes_.size() - 1);
    const auto pose = static_cast<std::size_t>(std::clamp(std::floor(time_s / params_.rest_s), 0.0, last));
    auto node = static_cast<int>(pose / static_cast<std::size_t>(params_.attitudes));
    Vec3<double> steps;  // from the centre
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const int nodes = params_.nodes[axis];
        steps(static_cast<Index>(axis)) = node % nodes - 0.5 * (nodes - 1);
        node /= nodes;
    }
    return {params_.centre_m + params_.spacing_m.cwiseProduct(steps), attitudes_[pose]};
}

Pose PaperMotion::do_at(double time_s) const {
    const PaperRates& r = rates_;
    constexpr double kRangeRate = 10 * std::numbers::pi;
    const double range = r.start_range_m + 0.3 * time_s + 0.2 * (1 - std::cos(kRangeRate * time_s)) / kRangeRate;
    const double azimuth = integrated_rate(r.azimuth_amplitude, r.azimuth_offset, time_s);
    const double elevation = integrated_rate(r.elevation_amplitude, r.elevation_offset, time_s);
    const double turned = integrated_rate(r.attitude_amplitude, 0, time_s);
    const Mat3<double> o = geometry::attitude_matrix(geometry::Euler<double>{turned, turned, turned});
    return {geometry::to_cartesian(geometry::Spherical<double>{range, azimuth, elevation}), geometry::attitude_quaternion(o)};
}

HandMotion::HandMotion(const Vec3<double>& centre_m, std::uint64_t seed) : centre_m_(centre_m) {
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> unit(0, 1);
    const auto random_vector = [&] {
        // One after the other: the order of arguments depends on the compiler.
        const double z = unit(random), y = unit(random), x = unit(random);
        return Vec3<double>(x, y, z);
    };
    const auto fill = [&](std::array<Sine, kSines>& sines, double amplitude) {
        for (std::size_t n = 0; n < kSines; ++n) {
            // Rates are spread evenly over the band on a log scale; amplitudes fall with the rate, as in hand motion.
            const double rate_hz = 0.2 * std::pow(12.5, (static_cast<double>(n) + unit(random)) / kSines);
            const double share = amplitude / std::sqrt(1 + rate_hz * rate_hz);
            sines[n] = {share * (2 * random_vector() - Vec3<double>::Ones()), kTurn_rad * random_vector(), kTurn_rad * rate_hz};
        }
    };
    fill(position_, 0.18);  // m
    fill(rotation_, 0.9);   // rad
}

Pose HandMotion::do_at(double time_s) const {
    const auto sum = [time_s](const std::array<Sine, kSines>& sines) {
        Vec3<double> total = Vec3<double>::Zero();
        for (const Sine& sine : sines) {
            const auto value = [&](double phase_rad) { return std::sin(phase_rad + sine.rate_rad_s * time_s); };
            total += sine.amplitude.cwiseProduct(sine.phase_rad.unaryExpr(value));
        }
        return total;
    };
    return {centre_m_ + sum(position_), geometry::rotation_vector_to_quaternion<double>(sum(rotation_))};
}

}  // namespace tricoil::sim
