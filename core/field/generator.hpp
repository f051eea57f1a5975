// Field generator: up to 16 source coils, each with its own position, moment and size; and one sensor coil in its field.
#pragma once

#include "core/base/static_vector.hpp"
#include "core/field/general_dipole.hpp"

namespace tricoil::field {

constexpr std::size_t kMaxGeneratorCoils = 16;

template <typename Scalar>
struct GeneratorCoil {
    Vec3<Scalar> position_m = Vec3<Scalar>::Zero();  // generator frame
    Vec3<Scalar> moment = Vec3<Scalar>::Zero();      // generator frame, coupling units times m^3
    Scalar octupole_m2 = 0;                          // lambda of GeneralDipole
};

template <typename Scalar>
using Generator = StaticVector<GeneratorCoil<Scalar>, kMaxGeneratorCoils>;

/// c = n.B(p): coupling of a source coil to a point-like sensor coil with sensitivity n (gain times axis) at p, with its
/// gradients. by_sensitivity is B. position_m: generator frame, not at the source coil.
template <typename Scalar>
PairCoupling<Scalar> coil_coupling(const GeneratorCoil<Scalar>& coil, const Vec3<Scalar>& position_m,
                                   const Vec3<Scalar>& sensitivity) {
    const Vec3<Scalar> r = position_m - coil.position_m;
    PairCoupling<Scalar> x = dipole_pair<Scalar>(r, coil.moment, sensitivity);
    if (coil.octupole_m2 != Scalar(0)) {
        x += octupole_correction<Scalar>(r, coil.moment, sensitivity, coil.octupole_m2, Scalar(0));
    }
    return x;
}

}  // namespace tricoil::field
