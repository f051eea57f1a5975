// The paper's examples, shortened for a power-on check: real forward model and solver, compared with the error model.
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "core/error_model/accumulated_error.hpp"
#include "core/error_model/singularity.hpp"
#include "core/field/concentric_dipole.hpp"
#include "core/signal/unit_phasor.hpp"
#include "core/solver/previous_measurement.hpp"

namespace tricoil::selfcheck {

/// rho, alpha and beta of (40), integrated: B t + 1 - cos(A t). Rates are in turns per second, so that processors without double
/// precision need no library function for the cosine.
struct ShortExample {
    double azimuth_a = 0;
    double elevation_a = 0;
    double elevation_b = 0;

    template <typename Scalar>
    [[nodiscard]] geometry::Spherical<Scalar> at(double time_s) const {
        constexpr double kRangeRate = 5;
        constexpr double kTurn = 2 * std::numbers::pi;
        const double range = 0.5 + 0.3 * time_s + 0.2 * versine(kRangeRate * time_s) / (kTurn * kRangeRate);
        return {static_cast<Scalar>(range), static_cast<Scalar>(versine(azimuth_a * time_s)),
                static_cast<Scalar>(kTurn * elevation_b * time_s + versine(elevation_a * time_s))};
    }

private:
    /// One minus the cosine of `turns`, which must not be negative.
    static double versine(double turns) { return 1 - signal::unit_phasor(turns - static_cast<int>(turns)).real(); }
};

constexpr double kExampleUpdate = 1.0 / 240;  // s
constexpr int kExampleUpdates = 120;

/// Largest errors, or differences of errors.
struct Worst {
    double range_m = 0;
    double azimuth_rad = 0;
    double elevation_rad = 0;

    template <typename Scalar>
    void include(Scalar range, Scalar azimuth, Scalar elevation) {
        range_m = std::max(range_m, std::abs(static_cast<double>(range)));
        azimuth_rad = std::max(azimuth_rad, std::abs(static_cast<double>(azimuth)));
        elevation_rad = std::max(elevation_rad, std::abs(static_cast<double>(elevation)));
    }
};

struct ExampleResult {
    bool ok = true;
    Worst error;                                  // of the solver
    Worst prediction;                             // predicted minus measured
    std::optional<DeviceTime> predicted_passage;  // first passage of beta - e_beta through a pole
    std::optional<DeviceTime> measured_passage;
};

template <typename Scalar>
Mat3<Scalar> signal_matrix_at(const geometry::Spherical<Scalar>& position) {
    return field::signal_matrix<Scalar>(Scalar(1), geometry::to_cartesian(position), Mat3<Scalar>::Identity());
}

/// One update of the angle form at fixed attitude: increments relative to `about`, added to `estimate` by (17).
template <typename Scalar>
bool update_angles(const Mat3<Scalar>& x, const geometry::Spherical<Scalar>& about, geometry::Spherical<Scalar>& estimate) {
    const Mat3<Scalar> p = geometry::line_of_sight_rotation(about.azimuth_rad, about.elevation_rad);
    const auto step = solver::tracking_increments<Scalar>(p * x * p.transpose(), Scalar(1));
    if (!step.ok()) {
        return false;
    }
    const auto next = solver::add_increments<Scalar>({estimate, {}}, *step);
    if (next.ok()) {
        estimate = next->position;
    }
    return next.ok();
}

template <typename Scalar>
ExampleResult run_example(const ShortExample& example, error_model::Loop loop) {
    ExampleResult result;
    geometry::Spherical<Scalar> before = example.at<Scalar>(0);
    geometry::Spherical<Scalar> estimate = before;
    error_model::AccumulatedError<Scalar> model(error_model::KappaForm::exact, loop, before);
    error_model::SingularityDetector<Scalar> predicted(before.elevation_rad, DeviceTime{});
    error_model::SingularityDetector<Scalar> measured(before.elevation_rad, DeviceTime{});
    for (int n = 1; n <= kExampleUpdates && result.ok; ++n) {
        const auto real = example.at<Scalar>(n * kExampleUpdate);
        result.ok = update_angles(signal_matrix_at(real), loop == error_model::Loop::open ? before : estimate, estimate);
        const auto& e = model.update(real);
        const Scalar range = real.range_m - estimate.range_m;
        const Scalar azimuth = real.azimuth_rad - estimate.azimuth_rad;
        const Scalar elevation = real.elevation_rad - estimate.elevation_rad;
        result.error.include(range, azimuth, elevation);
        result.prediction.include(e.range_m - range, e.azimuth_rad - azimuth, e.elevation_rad - elevation);
        const DeviceTime now{microseconds_from_seconds(n * kExampleUpdate)};
        const auto predicted_passage = predicted.update(model.measured_elevation_rad(), now);
        const auto measured_passage = measured.update(estimate.elevation_rad, now);
        result.predicted_passage = result.predicted_passage ? result.predicted_passage : predicted_passage;
        result.measured_passage = result.measured_passage ? result.measured_passage : measured_passage;
        before = real;
    }
    return result;
}

/// Largest position error (m) of the pole-free form in closed loop; infinite if it fails.
template <typename Scalar>
double pole_free_error(const ShortExample& example, int passes) {
    const auto start = example.at<Scalar>(0);
    solver::VectorPose<Scalar> estimate;
    estimate.range_m = start.range_m;
    estimate.direction = geometry::direction(start.azimuth_rad, start.elevation_rad);
    double worst = 0;
    for (int n = 1; n <= kExampleUpdates; ++n) {
        const auto real = example.at<Scalar>(n * kExampleUpdate);
        const auto next = solver::step_vectors<Scalar>(signal_matrix_at(real), Scalar(1), estimate, passes);
        if (!next.ok()) {
            return std::numeric_limits<double>::infinity();
        }
        estimate = *next;
        const Vec3<Scalar> error = geometry::to_cartesian(real) - estimate.range_m * estimate.direction;
        worst = std::max(worst, static_cast<double>(error.norm()));
    }
    return worst;
}

}  // namespace tricoil::selfcheck
