// Couplings without gains and coil angles.
#pragma once

#include "core/field/general_dipole.hpp"

namespace tricoil::host {

/// Couplings of ideal concentric triads with C = 1: removes gains and coil angles, N^-T X M^-1. Offsets are not removed.
inline Mat3<double> ideal_couplings(const field::GeneralDipole<double>& coils, const Mat3<double>& x) {
    return coils.sensor_sensitivity.transpose().inverse() * x * coils.source_moment.inverse();
}

}  // namespace tricoil::host
