// What the filter needs of a field model, and the concentric dipole that offers it.
#pragma once

#include <cmath>
#include <concepts>

#include "core/base/status.hpp"
#include "core/field/concentric_dipole.hpp"
#include "core/solver/direct.hpp"

namespace tricoil::tracking::scaat {

/// A pose to start from, with what the signal matrix said about itself.
template <typename Scalar>
struct StartPose {
    Vec3<Scalar> position_m;
    Mat3<Scalar> attitude;      // O: source components to sensor components
    Scalar strength;            // k, coupling units: the size of the couplings at this pose
    Scalar misfit_squared;      // coupling units squared: what no pose explains, 3 degrees of freedom
    bool right_handed;          // false: a coil is reversed or two are swapped
    bool hemisphere_from_data;  // the model itself tells the sign of the position (coil offsets do, concentric coils cannot)
};

/// The one interface between the filter and field/:
///   column(p, O, j)  coupling column j (0-2) at a pose with its Jacobian by position (1/m) and small rotation (1/rad), source
///   frame; start(X)         a pose from three columns taken as simultaneous, with nothing known before; errors as solve_direct;
///   near(X, p, q)    the same beside the pose (p, q);
///   kEven            whether X is the same at -p, so that a motion may be mirrored.
template <typename Model, typename Scalar>
concept MeasurementModel = requires(const Model& model, const Vec3<Scalar>& p, const Mat3<Scalar>& m, int j) {
    { model.column(p, m, j) } -> std::same_as<field::ColumnModel<Scalar>>;
    { model.start(m) } -> std::same_as<Result<StartPose<Scalar>>>;
    { model.near(m, p, Quat<Scalar>()) } -> std::same_as<Result<StartPose<Scalar>>>;
    { Model::kEven } -> std::convertible_to<bool>;
};

/// Concentric triads, (6). X is even in the position's direction, at rest and in motion alike: no trajectory resolves the
/// hemisphere, so start() leaves it open.
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

    /// The direct solution needs no neighbour; only its sign does.
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
