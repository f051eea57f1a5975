// Conversion between wire messages and tracker types.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/protocol/messages.hpp"
#include "core/protocol/schema.hpp"
#include "core/protocol/wire_error.hpp"
#include "core/signal/column.hpp"
#include "core/signal/gain_step.hpp"
#include "core/tracking/pose_estimate.hpp"

namespace tricoil::protocol {

static_assert(static_cast<int>(tracking::PoseFlag::columns_missing) == 13, "the schema lists the pose flags by number");
static_assert(static_cast<int>(ColumnFlag::overrun) == 6 && static_cast<int>(ColumnFlag::low_band) == 10,
              "the schema lists the column flags by number");

/// Wire-only flag. The receiver must refuse such a column.
constexpr std::uint16_t kTransitionFlag = 1U << 7U;
constexpr std::uint16_t kUnusedFlag = 1U << 11U;
constexpr int kGainStepBit = 12;  // first bit of the gain step in the flags of a column

/// Scaled and rounded to the nearest wire number. Clamps values out of range; NaN becomes 0.
template <typename Raw, typename Scalar>
Raw to_wire(Scalar value, Scalar per_unit, double low, double high) {
    const double scaled = static_cast<double>(value * per_unit);
    if (!(scaled > low)) {
        return std::isnan(scaled) ? Raw{0} : static_cast<Raw>(low);
    }
    return scaled >= high ? static_cast<Raw>(high) : static_cast<Raw>(std::lround(scaled));
}

/// Wire numbers per unit.
constexpr double kPositionPerMetre = 1e7;
constexpr double kQuaternionPerUnit = 8e6;
constexpr double kDeviationPerUnit = 1e7;
constexpr double kDistortionPerMetre = 1e5;

template <typename Scalar>
PoseMessage to_message(const tracking::PoseEstimate<Scalar>& e) {
    PoseMessage m;
    m.sequence = e.sequence;
    m.time_us = std::max<std::int64_t>(to_us(e.time), 0);
    m.sensor = e.sensor;
    m.tracker_state = static_cast<std::uint8_t>(e.state);
    tracking::PoseFlags flags = e.flags;
    const bool finite = e.position_m.allFinite() && e.q_source_sensor.coeffs().allFinite();
    flags.set_if(!finite && !flags.has_any(tracking::kNoPosition), tracking::PoseFlag::not_converged);
    m.flags = static_cast<std::uint16_t>(flags.bits());
    if (finite) {
        const Quat<Scalar>& q = e.q_source_sensor;
        const std::array<Scalar, 4> wxyz{q.w(), q.x(), q.y(), q.z()};
        for (std::size_t i = 0; i < 3; ++i) {
            m.position[i] = to_wire<std::int32_t>(e.position_m[static_cast<Index>(i)], Scalar(kPositionPerMetre), -1e9, 1e9);
        }
        for (std::size_t i = 0; i < 4; ++i) {
            m.quaternion[i] = to_wire<std::int32_t>(wxyz[i], Scalar(kQuaternionPerUnit), -8e6, 8e6);
        }
    }
    for (std::size_t i = 0; i < 6; ++i) {
        const auto k = static_cast<Index>(i);
        const Scalar variance = finite ? std::max(e.covariance(k, k), Scalar(0)) : std::numeric_limits<Scalar>::max();
        m.deviation[i] = to_wire<std::uint32_t>(std::sqrt(variance), Scalar(kDeviationPerUnit), 0, highest(WireType::u24));
    }
    m.distortion = to_wire<std::uint16_t>(e.distortion_m, Scalar(kDistortionPerMetre), 0, highest(WireType::u16));
    m.snr_cdb = to_wire<std::int16_t>(e.snr_db, Scalar(100), lowest(WireType::i16), highest(WireType::i16));
    return m;
}

/// impossible: the quaternion is not a unit quaternion. The covariance has only variances; couplings and prediction stay empty.
template <typename Scalar>
[[nodiscard]] WireError from_message(const PoseMessage& m, tracking::PoseEstimate<Scalar>& e) {
    e = {};
    e.sensor = m.sensor;
    e.sequence = m.sequence;
    e.time = device_time_us(m.time_us);
    e.state = static_cast<tracking::TrackerState>(m.tracker_state);
    e.flags = tracking::PoseFlags::of_bits(m.flags, tracking::kAllPoseFlags);
    for (std::size_t i = 0; i < 3; ++i) {
        e.position_m[static_cast<Index>(i)] = static_cast<Scalar>(m.position[i] / kPositionPerMetre);
    }
    std::array<Scalar, 4> q{};
    for (std::size_t i = 0; i < 4; ++i) {
        q[i] = static_cast<Scalar>(m.quaternion[i] / kQuaternionPerUnit);
    }
    e.q_source_sensor = Quat<Scalar>(q[0], q[1], q[2], q[3]);
    for (std::size_t i = 0; i < 6; ++i) {
        const auto deviation = static_cast<Scalar>(m.deviation[i] / kDeviationPerUnit);
        e.covariance(static_cast<Index>(i), static_cast<Index>(i)) = deviation * deviation;
    }
    e.distortion_m = static_cast<Scalar>(m.distortion / kDistortionPerMetre);
    e.snr_db = Scalar(m.snr_cdb) / 100;
    const bool is_none = std::all_of(m.deviation.begin(), m.deviation.end(),
                                     [](std::uint32_t deviation) { return deviation == highest(WireType::u24); });
    is_none && !e.valid() ? clear_position(e) : clear_unknown_position(e);
    constexpr Scalar kLengthTolerance = Scalar(1e-5);  // of the squared length: rounding of four numbers
    return std::abs(e.q_source_sensor.squaredNorm() - 1) < kLengthTolerance ? WireError::none : WireError::impossible;
}

/// A column that is not finite is sent with zero couplings and the flag `no_reference`. Standard deviations are clamped to the
/// field's range.
template <typename Scalar>
ColumnMessage to_message(const MeasuredColumn<Scalar>& c, std::uint32_t message_sequence, bool transition = false) {
    ColumnMessage m;
    m.sequence = message_sequence;
    m.time_us = std::max<std::int64_t>(to_us(c.midpoint), 0);
    m.sensor = c.sensor;
    m.state = static_cast<std::uint8_t>(coil_index(c.state) + 1);
    ColumnFlags flags = c.flags;
    const bool finite = c.in_phase.allFinite() && c.quadrature.allFinite() && c.sigma.allFinite();
    flags.set_if(!finite, ColumnFlag::no_reference);
    m.flags = static_cast<std::uint16_t>(flags.bits() | (transition ? kTransitionFlag : 0U) |
                                         static_cast<unsigned>(c.gain_step) << kGainStepBit);
    m.level = c.level;
    m.state_sequence = c.state_sequence;
    for (std::size_t i = 0; finite && i < 3; ++i) {
        const auto k = static_cast<Index>(i);
        m.in_phase[i] = std::clamp(static_cast<float>(c.in_phase[k]), -1e6F, 1e6F);
        m.quadrature[i] = std::clamp(static_cast<float>(c.quadrature[k]), -1e6F, 1e6F);
        m.sigma[i] = std::clamp(static_cast<float>(c.sigma[k]), 1e-11F, 1e6F);
    }
    return m;
}

/// transition: the excitation state changed within the window; the column must not be used.
template <typename Scalar>
[[nodiscard]] WireError from_message(const ColumnMessage& m, MeasuredColumn<Scalar>& c) {
    c = {};
    if ((m.flags & kTransitionFlag) != 0) {
        return WireError::transition;
    }
    if (m.flags >> kGainStepBit >= static_cast<int>(signal::kMaxGainSteps) || (m.flags & kUnusedFlag) != 0) {
        return WireError::impossible;
    }
    c.sensor = m.sensor;
    c.state = single_coil(m.state - 1);
    c.state_sequence = m.state_sequence;
    c.sequence = m.sequence;
    c.midpoint = device_time_us(m.time_us);
    c.gain_step = static_cast<std::uint8_t>(m.flags >> kGainStepBit);
    c.level = m.level;
    c.flags = ColumnFlags::of_bits(m.flags, kAllColumnFlags);
    for (std::size_t i = 0; i < 3; ++i) {
        const auto k = static_cast<Index>(i);
        c.in_phase[k] = static_cast<Scalar>(m.in_phase[i]);
        c.quadrature[k] = static_cast<Scalar>(m.quadrature[i]);
        c.sigma[k] = static_cast<Scalar>(m.sigma[i]);
    }
    return WireError::none;
}

}  // namespace tricoil::protocol
