// The numbers that a calibration estimates, as one vector without redundancy, and what they mean. Templated: also for
// derivatives.
#pragma once

#include <array>
#include <string>

#include "core/field/general_dipole.hpp"

namespace tricoil::host {

/// Magnetic parameters: moments (6, symmetric, in units of C), sensitivities (5, symmetric with trace three), source offsets (6)
/// and sensor offsets (6, the third coil's is minus the sum), octupoles (3 and 3). Lengths in units of 0.1 m.
constexpr int kMagnetic = 29;
constexpr int kMoments = 0, kSensitivities = 6, kSourceOffsets = 11, kSensorOffsets = 17, kOctupoles = 23;
constexpr double kLengthUnit_m = 0.1;

template <typename T>
Mat3<T> symmetric_matrix(const T& xx, const T& yy, const T& zz, const T& xy, const T& xz, const T& yz) {
    Mat3<T> m;
    m << xx, xy, xz, xy, yy, yz, xz, yz, zz;
    return m;
}

template <typename T>
Mat3<T> offsets_with_zero_sum(const T* p) {
    Mat3<T> m;
    m.col(0) << p[0], p[1], p[2];
    m.col(1) << p[3], p[4], p[5];
    m.col(2) = -(m.col(0) + m.col(1));
    return T(kLengthUnit_m) * m;
}

/// The model for `p`; moments times `c`, the coupling constant of the start.
template <typename T>
field::GeneralDipole<T> model_of(const T* p, double c) {
    field::GeneralDipole<T> model;
    model.source_moment = T(c) * symmetric_matrix<T>(p[0], p[1], p[2], p[3], p[4], p[5]);
    const T* n = p + kSensitivities;
    model.sensor_sensitivity = symmetric_matrix<T>(n[0], n[1], T(3) - n[0] - n[1], n[2], n[3], n[4]);
    model.source_offset_m = offsets_with_zero_sum(p + kSourceOffsets);
    model.sensor_offset_m = offsets_with_zero_sum(p + kSensorOffsets);
    for (int i = 0; i < 3; ++i) {
        model.source_octupole_m2(i) = T(kLengthUnit_m * kLengthUnit_m) * p[kOctupoles + i];
        model.sensor_octupole_m2(i) = T(kLengthUnit_m * kLengthUnit_m) * p[kOctupoles + 3 + i];
    }
    return model;
}

/// Couplings alone: column_model without its Jacobian, for derivatives by other things.
template <typename T>
Mat3<T> couplings(const field::GeneralDipole<T>& model, const Vec3<T>& position_m, const Mat3<T>& o, bool finite) {
    Mat3<T> x;
    for (int i = 0; i < 3; ++i) {
        const Vec3<T> arm = o.transpose() * model.sensor_offset_m.col(i);
        const Vec3<T> n = o.transpose() * model.sensor_sensitivity.col(i);
        for (int j = 0; j < 3; ++j) {
            const Vec3<T> r = position_m + arm - model.source_offset_m.col(j);
            const Vec3<T> m = model.source_moment.col(j);
            x(i, j) = field::dipole_pair<T>(r, m, n).value;
            if (finite) {
                using std::sqrt;
                const T m_size = sqrt(m.squaredNorm());
                const T n_size = sqrt(n.squaredNorm());
                x(i, j) += model.source_octupole_m2(j) * m_size * field::octupole_pair<T>(r, m / m_size, n).value +
                           model.sensor_octupole_m2(i) * n_size * field::octupole_pair<T>(r, n / n_size, m).value;
            }
        }
    }
    return x;
}

}  // namespace tricoil::host
