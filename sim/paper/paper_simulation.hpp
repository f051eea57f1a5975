// Simulation of the paper's sections 3.3 and 4 with the real forward model and solver, in open and closed loop.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "core/base/time.hpp"
#include "core/error_model/accumulated_error.hpp"
#include "core/error_model/exact_step.hpp"
#include "core/solver/previous_measurement.hpp"
#include "sim/paper/paper_example.hpp"

namespace tricoil::paper {

/// Representation of the estimate between two updates.
enum class Form { angles, vectors };

struct SimulationParams {
    error_model::Loop loop = error_model::Loop::open;
    error_model::KappaForm kappa = error_model::KappaForm::exact;  // of the prediction
    std::optional<error_model::KappaForm> azimuth_kappa = {};      // for the azimuth, if different
    Form form = Form::angles;                                      // vectors: closed loop only
    int passes = 1;                                                // of the step, per sample
    double update_s = 1.0 / 240;                                   // T
    double duration_s = 10;
    DeviceTime start{};  // device time of the first update
};

/// One update. Errors are true minus measured; angles are continuous (whole turns are kept).
struct Update {
    double time_s = 0;  // since the start
    DeviceTime stamp{};
    solver::AnglePose<double> real;
    error_model::PoseAngleError<double> measured;     // of the simulated device
    error_model::LineOfSightError<double> predicted;  // by the error model, from the true motion; NaN without has_prediction()
    Vec3<double> predicted_position_error_m = Vec3<double>::Zero();
    error_model::PoseAngleError<double> exact;  // by chained exact one-step expressions, with orientation, if has_exact_chain()
    Vec3<double> position_error_m = Vec3<double>::Zero();
    double rotation_error_rad = 0;
    double measured_elevation_rad = 0;
    double predicted_elevation_rad = 0;            // beta - e_beta of the model
    double measured_azimuth_rate_error_rad_s = 0;  // e_alpha' of (24), over the last update
    double predicted_azimuth_rate_error_rad_s = 0;
};

/// The exact one-step expressions hold for the angle form with one pass; only then Update::exact is set.
constexpr bool has_exact_chain(const SimulationParams& params) { return params.form == Form::angles && params.passes == 1; }

/// The angle form's prediction, (19)-(37), holds for one pass; the pole-free form's holds for any number of passes. Both assume a
/// known attitude.
constexpr bool has_prediction(const SimulationParams& params) { return params.form == Form::vectors || params.passes == 1; }

/// Limits of the start range, m. Values outside are treated as input errors.
constexpr double kMinStartRange = 1e-3;
constexpr double kMaxStartRange = 1e3;

/// Throws std::invalid_argument if a parameter is invalid, if the sensor reaches the source, or if the rates are too high for the
/// update time (steps beyond 54.7 degrees). each_update: called after each update; it may throw to end the simulation; may be
/// empty.
std::vector<Update> simulate(const Example& example, const SimulationParams& params,
                             const std::function<void(const Update&)>& each_update = {});

/// Throws std::invalid_argument, naming the parameter, for a value out of range and for an unsupported combination.
void check(const Example& example, const SimulationParams& params);

}  // namespace tricoil::paper
