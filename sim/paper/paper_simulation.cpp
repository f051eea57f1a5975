#include "sim/paper/paper_simulation.hpp"

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

#include "core/error_model/cartesian_error.hpp"
#include "core/error_model/pole_free_loop.hpp"
#include "core/field/concentric_dipole.hpp"

namespace tricoil::paper {
namespace {

using error_model::Loop;
using AnglePose = solver::AnglePose<double>;
using VectorPose = solver::VectorPose<double>;

constexpr int kSubsteps = 10;            // (39): the true motion is integrated at T / 10
constexpr double kCouplingConstant = 1;  // errors do not depend on it
constexpr double kMaxUpdates = 2e6;      // about 540 MB of results

double nearest_turn(double angle, double reference) { return reference + geometry::wrap_turns(angle - reference); }

VectorPose to_vectors(const AnglePose& pose) {
    return {pose.position.range_m, geometry::direction(pose.position.azimuth_rad, pose.position.elevation_rad),
            geometry::attitude_matrix(pose.attitude)};
}

/// Euler steps of (39), (42).
void advance(AnglePose& pose, const Example& example, double time_s, double dt_s) {
    pose.position.range_m += example.range.at(time_s) * dt_s;
    pose.position.azimuth_rad += example.azimuth.at(time_s) * dt_s;
    pose.position.elevation_rad += example.elevation.at(time_s) * dt_s;
    const double turn = example.attitude.at(time_s) * dt_s;
    pose.attitude.azimuth_rad += turn;
    pose.attitude.elevation_rad += turn;
    pose.attitude.roll_rad += turn;
}

Mat3<double> signal_matrix(const AnglePose& pose) {
    return field::signal_matrix<double>(kCouplingConstant, geometry::to_cartesian(pose.position),
                                        geometry::attitude_matrix(pose.attitude));
}

/// The pose as angles, each within half a turn of the true one.
AnglePose angles_near(const VectorPose& vectors, const AnglePose& real) {
    AnglePose pose{geometry::to_spherical<double>(vectors.range_m * vectors.direction), geometry::to_euler(vectors.attitude)};
    // The true elevation may exceed 90 degrees. The same point then has the elevation pi - beta and the opposite azimuth.
    if (std::cos(real.position.elevation_rad) < 0) {
        pose.position.elevation_rad = std::numbers::pi - pose.position.elevation_rad;
        pose.position.azimuth_rad += std::numbers::pi;
    }
    if (std::cos(real.attitude.elevation_rad) < 0) {
        pose.attitude.elevation_rad = std::numbers::pi - pose.attitude.elevation_rad;
        pose.attitude.azimuth_rad += std::numbers::pi;
        pose.attitude.roll_rad += std::numbers::pi;
    }
    pose.position.azimuth_rad = nearest_turn(pose.position.azimuth_rad, real.position.azimuth_rad);
    pose.position.elevation_rad = nearest_turn(pose.position.elevation_rad, real.position.elevation_rad);
    pose.attitude.azimuth_rad = nearest_turn(pose.attitude.azimuth_rad, real.attitude.azimuth_rad);
    pose.attitude.elevation_rad = nearest_turn(pose.attitude.elevation_rad, real.attitude.elevation_rad);
    pose.attitude.roll_rad = nearest_turn(pose.attitude.roll_rad, real.attitude.roll_rad);
    return pose;
}

/// The simulated device: takes one signal matrix per update and keeps its own estimate.
class Device {
public:
    Device(const SimulationParams& params, const AnglePose& start)
        : params_(params), angles_(start), vectors_(to_vectors(start)) {}

    Status update(const Mat3<double>& x, const AnglePose& real_before) {
        if (params_.form == Form::vectors) {
            const auto next = solver::step_vectors(x, kCouplingConstant, vectors_, params_.passes);
            vectors_ = next.ok() ? *next : vectors_;
            return next.status();
        }
        return params_.loop == Loop::closed ? update_closed(x) : update_open(x, real_before);
    }

    /// The estimate as angles.
    [[nodiscard]] AnglePose angles(const AnglePose& real) const {
        return params_.form == Form::angles ? angles_ : angles_near(vectors_, real);
    }

    [[nodiscard]] VectorPose vectors() const { return params_.form == Form::vectors ? vectors_ : to_vectors(angles_); }

private:
    Status update_closed(const Mat3<double>& x) {
        const auto next = solver::step_angles(x, kCouplingConstant, angles_, params_.passes);
        angles_ = next.ok() ? *next : angles_;
        return next.status();
    }

    /// Section 3.1: R is formed from the true previous pose, while (17) and (18) use only the measured angles.
    Status update_open(const Mat3<double>& x, const AnglePose& real_before) {
        const auto p = geometry::line_of_sight_rotation(real_before.position.azimuth_rad, real_before.position.elevation_rad);
        const Mat3<double> w = p * geometry::attitude_matrix(real_before.attitude).transpose() * x * p.transpose();
        const auto step = solver::tracking_increments(w, kCouplingConstant);
        if (!step.ok()) {
            return step.status();
        }
        const auto next = solver::add_increments(angles_, *step);
        angles_ = next.ok() ? *next : angles_;
        return next.status();
    }

    SimulationParams params_;
    AnglePose angles_;
    VectorPose vectors_;
};

/// Component by component: the pose for an error, or the error of a pose.
template <typename Difference, typename Measured>
Difference minus(const AnglePose& real, const Measured& measured) {
    const auto& [rp, ra] = real;
    const auto& [mp, ma] = measured;
    return {{rp.range_m - mp.range_m, rp.azimuth_rad - mp.azimuth_rad, rp.elevation_rad - mp.elevation_rad},
            {ra.azimuth_rad - ma.azimuth_rad, ra.elevation_rad - ma.elevation_rad, ra.roll_rad - ma.roll_rad}};
}

/// Chained exact one-step errors: each step starts from the errors of the previous step, not from the simulated device.
error_model::PoseAngleError<double> exact_error(const AnglePose& real, const Update& last, Loop loop) {
    const AnglePose estimate = minus<AnglePose>(last.real, last.exact);
    const auto error = error_model::exact_step_error(real, loop == Loop::open ? last.real : estimate, estimate);
    return error.ok() ? *error : last.exact;
}

void compare(const Device& device, Update& update) {
    const AnglePose measured = device.angles(update.real);
    update.measured = minus<error_model::PoseAngleError<double>>(update.real, measured);
    update.measured_elevation_rad = measured.position.elevation_rad;
    const VectorPose real = to_vectors(update.real);
    const VectorPose estimate = device.vectors();
    update.position_error_m = real.range_m * real.direction - estimate.range_m * estimate.direction;
    update.rotation_error_rad =
        geometry::angle_between(geometry::attitude_quaternion(real.attitude), geometry::attitude_quaternion(estimate.attitude));
}

/// The error model's prediction for the same motion, from true positions only.
class Prediction {
public:
    Prediction(const SimulationParams& params, const geometry::Spherical<double>& start)
        : params_(params),
          angles_(params.kappa, params.azimuth_kappa.value_or(params.kappa), params.loop, start),
          vectors_(params.passes, geometry::to_cartesian(start)) {}

    void update(Update& update) {
        const auto& real = update.real.position;
        if (!has_prediction(params_)) {
            constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
            update.predicted = {kNone, kNone, kNone};
            update.predicted_position_error_m.setConstant(kNone);
            update.predicted_elevation_rad = kNone;
            return;
        }
        if (params_.form == Form::angles) {
            update.predicted = angles_.update(real);
        } else {
            vectors_.update(geometry::to_cartesian(real));
            const VectorPose estimate{vectors_.measured_range_m(), vectors_.measured_direction(),
                                      geometry::attitude_matrix(update.real.attitude)};
            const auto measured = angles_near(estimate, update.real).position;
            update.predicted = {real.range_m - measured.range_m, real.azimuth_rad - measured.azimuth_rad,
                                real.elevation_rad - measured.elevation_rad};
        }
        const auto& e = update.predicted;
        update.predicted_position_error_m =
            error_model::cartesian_error<double>(real, {e.range_m, e.azimuth_rad, e.elevation_rad});
        update.predicted_elevation_rad = real.elevation_rad - e.elevation_rad;
    }

private:
    SimulationParams params_;
    error_model::AccumulatedError<double> angles_;
    error_model::PoleFreeLoop<double> vectors_;
};

void check_rate(const char* what, const Rate& rate, double largest) {
    const double size = std::abs(rate.offset) + std::abs(rate.amplitude);
    if (!std::isfinite(size) || size > largest || !std::isfinite(rate.frequency_rad_s)) {
        throw std::invalid_argument(
            fmt::format("{} must be finite, offset plus amplitude at most {}; got offset {} and amplitude {}", what, largest,
                        rate.offset, rate.amplitude));
    }
}

}  // namespace

void check(const Example& example, const SimulationParams& params) {
    if (!(params.update_s >= 1e-5 && params.update_s <= 1)) {
        throw std::invalid_argument(fmt::format("update time must be 0.00001 to 1 s; got {}", params.update_s));
    }
    if (!(params.duration_s >= params.update_s) || !(params.duration_s / params.update_s <= kMaxUpdates)) {
        throw std::invalid_argument(fmt::format("duration must be 1 to {:.0f} update times; got {} s with an update time of {} s",
                                                kMaxUpdates, params.duration_s, params.update_s));
    }
    check_rate("azimuth rate (rad/s)", example.azimuth, 1e3);
    check_rate("elevation rate (rad/s)", example.elevation, 1e3);
    check_rate("attitude rate (rad/s)", example.attitude, 1e3);
    check_rate("range rate (m/s)", example.range, 1e2);
    if (!(example.start.range_m >= kMinStartRange && example.start.range_m <= kMaxStartRange)) {
        throw std::invalid_argument(
            fmt::format("start range must be {} to {} m; got {}", kMinStartRange, kMaxStartRange, example.start.range_m));
    }
    if (params.form == Form::vectors && params.loop == Loop::open) {
        throw std::invalid_argument(
            "the pole-free form has no open loop, because the paper's open loop adds angles; use --loop closed");
    }
    if (params.form == Form::vectors && params.kappa != error_model::KappaForm::exact) {
        throw std::invalid_argument(
            "the paper's kappa and kappa = 2 apply to angles only; use --kappa exact with the pole-free form");
    }
    if (params.passes < 1 || params.passes > 10 || (params.passes > 1 && params.loop == Loop::open)) {
        throw std::invalid_argument(fmt::format("passes must be 1 to 10, or 1 in open loop; got {}", params.passes));
    }
}

std::vector<Update> simulate(const Example& example, const SimulationParams& params,
                             const std::function<void(const Update&)>& each_update) {
    check(example, params);
    const auto count = static_cast<std::size_t>(std::llround(params.duration_s / params.update_s));
    const double dt_s = params.update_s / kSubsteps;
    AnglePose real{example.start, {}};
    Device device(params, real);
    Prediction model(params, example.start);
    std::vector<Update> updates;
    updates.reserve(count + 1);
    Update first;
    first.real = real;
    first.stamp = params.start;
    updates.push_back(first);
    for (std::size_t n = 1; n <= count; ++n) {
        const AnglePose before = real;
        for (std::size_t sub = 0; sub < kSubsteps; ++sub) {
            advance(real, example, static_cast<double>((n - 1) * kSubsteps + sub) * dt_s, dt_s);
        }
        if (!(real.position.range_m > 0)) {
            throw std::invalid_argument(
                fmt::format("the sensor reaches the source after {:.3f} s; raise the start range or the range rate",
                            static_cast<double>(n) * params.update_s));
        }
        Update update;
        update.time_s = static_cast<double>(n) * params.update_s;
        update.stamp = params.start + microseconds_from_seconds(update.time_s);
        update.real = real;
        const Status status = device.update(signal_matrix(real), before);
        if (!status.ok()) {
            throw std::invalid_argument(
                fmt::format("at {:.4f} s: {}; lower the rates or the update time", update.time_s, status.message()));
        }
        compare(device, update);
        if (has_exact_chain(params)) {
            update.exact = exact_error(real, updates.back(), params.loop);
        }
        model.update(update);
        // (24) takes the true rate at the start of the update, as in (30).
        const double rate = example.azimuth.at(update.time_s - params.update_s);
        const double turn = real.position.azimuth_rad - before.position.azimuth_rad;
        const Update& last = updates.back();
        const double measured = turn - (update.measured.position.azimuth_rad - last.measured.position.azimuth_rad);
        const double predicted = turn - (update.predicted.azimuth_rad - last.predicted.azimuth_rad);
        update.measured_azimuth_rate_error_rad_s = rate - measured / params.update_s;
        update.predicted_azimuth_rate_error_rad_s = rate - predicted / params.update_s;
        updates.push_back(update);
        if (each_update) {
            each_update(update);
        }
    }
    return updates;
}

}  // namespace tricoil::paper
