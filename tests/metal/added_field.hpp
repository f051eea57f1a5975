// The field that one metal object adds, for tests.
#pragma once

#include <vector>

#include "core/linear/eigen.hpp"
#include "sim/world/metal/body.hpp"

namespace tricoil::sim {

/// Field at the sensor (object frame, m) at one frequency; one column per dipole at the source.
inline ComplexMat3 added_field(const MetalShape& shape, const Material& material, double hz, const Vec3<double>& source_m,
                               const Vec3<double>& sensor_m) {
    const auto body = make_body(shape, material);
    body->tune({hz});
    body->place_source(source_m);
    std::vector<ComplexMat3> fields{ComplexMat3::Zero()};
    body->add_field(sensor_m, fields);
    return fields[0];
}

/// Moment over 4 pi per field along an axis (m^3), from a source and a sensor on that axis at a far distance.
inline std::complex<double> far_polarisability(const MetalShape& shape, const Material& material, double hz,
                                               const Vec3<double>& axis, double far_m) {
    const ComplexMat3 field = added_field(shape, material, hz, -far_m * axis, far_m * axis);
    const std::complex<double> added =
        (axis.cast<std::complex<double>>().transpose() * field * axis.cast<std::complex<double>>())(0);
    const double gradient = 2 / (far_m * far_m * far_m);
    return added / (gradient * gradient);
}

}  // namespace tricoil::sim
