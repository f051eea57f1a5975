// Metal at rest relative to the source: a few virtual dipoles that the source coils induce.
#pragma once

#include <cstddef>

#include "core/base/static_vector.hpp"
#include "core/linear/matrix.hpp"

namespace tricoil::field {

/// A dipole at rest in the source frame. Each source coil induces its own moment.
template <typename Scalar>
struct InducedDipole {
    Vec3<Scalar> position_m = Vec3<Scalar>::Zero();
    Mat3<Scalar> moment = Mat3<Scalar>::Zero();  // column j: while source coil j is excited; coupling units times m^3

    template <typename Other>
    [[nodiscard]] InducedDipole<Other> cast() const {
        return {position_m.template cast<Other>(), moment.template cast<Other>()};
    }
};

/// Four describe a table below the workspace to a few parts in a thousand of its effect (board/host/calibration).
constexpr std::size_t kMaxInducedDipoles = 4;

template <typename Scalar>
using InducedDipoles = StaticVector<InducedDipole<Scalar>, kMaxInducedDipoles>;

template <typename Other, typename Scalar>
InducedDipoles<Other> cast_dipoles(const InducedDipoles<Scalar>& dipoles) {
    InducedDipoles<Other> result;
    for (const InducedDipole<Scalar>& dipole : dipoles) {
        (void)result.push_back(dipole.template cast<Other>());
    }
    return result;
}

}  // namespace tricoil::field
