// Interface between filter and field model, and its implementation for the concentric dipole.
#pragma once

#include <cmath>
#include <concepts>

#include "core/base/status.hpp"
#include "core/field/concentric_dipole.hpp"
#include "core/solver/direct.hpp"

namespace tricoil::tracking::scaat {

/// Pose for a start of the filter, with diagnostics of the signal matrix.
template <typename Scalar>
struct StartPose {
    Vec3<Scalar> position_m;
    Mat3<Scalar> attitude;      // O: source components to sensor components
    Scalar strength;            // k, coupling units: coupling strength at this pose
    Scalar misfit_squared;      // coupling units squared, 3 degrees of freedom
    bool right_handed;          // false: a coil is reversed or two are swapped
    bool hemisphere_from_data;  // the couplings determine the sign of the position (only with coil offsets)
};

/// Requirements on a measurement model:
///   column(p, O, j)  coupling column j (0-2) at a pose with its Jacobian by position (1/m) and small rotation (1/rad), source
///                    frame;
///   start(X)         pose of three columns taken as simultaneous, without prior knowledge; errors as solve_direct;
///   near(X, p, q)    the same, near the pose (p, q);
///   kEven            true if X is the same at -p, so that a state has a mirror image.
template <typename Model, typename Scalar>
concept MeasurementModel = requires(const Model& model, const Vec3<Scalar>& p, const Mat3<Scalar>& m, int j) {
    { model.column(p, m, j) } -> std::same_as<field::ColumnModel<Scalar>>;
    { model.start(m) } -> std::same_as<Result<StartPose<Scalar>>>;
    { model.near(m, p, Quat<Scalar>()) } -> std::same_as<Result<StartPose<Scalar>>>;
    { Model::kEven } -> std::convertible_to<bool>;
};

/// Concentric triads, (6). X is even in the position, at rest and in motion. No trajectory determines the hemisphere, so start()
/// does not resolve it.
template <typename Scalar>
struct ConcentricMeasurement {
    static constexpr bool kEven = true;
    Scalar coupling_constant = 1;  // C, coupling units times m^3

    [[nodiscard]] field::ColumnModel<Scalar> column(const Vec3<Scalar>& position_m, const Mat3<Scalar>& o, int j) const {
        return field::column_model(coupling_constant, position_m, o, j);
    }

    [[nodiscard]] Result<StartPose<Scalar>> start(const Mat3<Scalar>& x) const {
        const auto direct = solver::solve_direct(x, coupling_constant);
        if (!direct.ok()) {
            return direct.status();
        }
        return StartPose<Scalar>{direct->range_m * direct->direction,
                                 direct->attitude,
                                 direct->strength,
                                 direct->misfit_squared,
                                 direct->right_handed,
                                 false};
    }

    /// The direct solution does not need the given pose. The pose only determines the sign of the position.
    [[nodiscard]] Result<StartPose<Scalar>> near(const Mat3<Scalar>& x, const Vec3<Scalar>& position_m,
                                                 const Quat<Scalar>& /*q*/) const {
        auto pose = start(x);
        if (!pose.ok() || pose->position_m.dot(position_m) >= 0) {
            return pose;
        }
        StartPose<Scalar> mirrored = *pose;
        mirrored.position_m = -mirrored.position_m;
        return mirrored;
    }
};

}  // namespace tricoil::tracking::scaat
