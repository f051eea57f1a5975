// One column of the signal matrix: output of the demodulator, input of the tracker.
#pragma once

#include <array>
#include <cstdint>

#include "core/base/time.hpp"
#include "core/linear/matrix.hpp"
#include "core/signal/column_flags.hpp"
#include "core/signal/excitation.hpp"

namespace tricoil {

/// Couplings of the three sensor coils to one source coil, relative to its reference current.
template <typename Scalar>
struct Column {
    std::uint8_t sensor = 0;
    Excitation state = Excitation::off;  // s1, s2 or s3: selects the column of X
    std::uint32_t state_sequence = 0;    // counts excitation states; equal for the three columns of an FDM block
    DeviceTime midpoint{};               // of the demodulation window
    Vec3<Scalar> in_phase = Vec3<Scalar>::Zero();
    Vec3<Scalar> quadrature = Vec3<Scalar>::Zero();  // metal; small for thick copper and aluminium
    Vec3<Scalar> sigma = Vec3<Scalar>::Zero();       // standard deviation per entry, never below the quantisation floor
    std::uint32_t sequence = 0;                      // of its block
    ColumnFlags flags;
};

/// Unit of MeasuredColumn::level: parts of full scale.
constexpr float kLevelsPerFullScale = 65536;

/// A column with its gain step and levels. Trackers ignore these.
template <typename Scalar>
struct MeasuredColumn : Column<Scalar> {
    std::uint8_t gain_step = 0;  // of the sensor amplifiers
    std::array<std::uint16_t, kSensorCoils>
        level{};  // amplitude at each sensor channel's converter. 0: unknown, FDM, or corrected
};

}  // namespace tricoil
