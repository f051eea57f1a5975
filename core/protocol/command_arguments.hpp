// Contents of the 32-bit command arguments that pack more than one number. For hello see negotiation.hpp.
#pragma once

#include <cmath>
#include <cstdint>

#include "core/linear/matrix.hpp"
#include "core/signal/acquisition_plan.hpp"

namespace tricoil::protocol {

/// Acquisition mode of a device, and whether it sends poses or columns.
struct ModeRequest {
    /// Selects a rate of the device within 1 % of it; 0: the first rate of the multiplexing.
    std::uint32_t frame_rate_millihertz = 0;
    signal::Multiplexing multiplexing = signal::Multiplexing::tdm;
    bool columns = false;  // send columns instead of poses
};
constexpr std::uint32_t kModeRateMask = (1U << 28U) - 1;
constexpr std::uint32_t kModeFdmBit = 1U << 28U;
constexpr std::uint32_t kModeColumnsBit = 1U << 29U;
constexpr std::uint32_t kModeDualBandBit = 1U << 30U;

constexpr std::uint32_t mode_argument(const ModeRequest& mode) {
    using signal::Multiplexing;
    return (mode.frame_rate_millihertz & kModeRateMask) | (mode.multiplexing == Multiplexing::fdm ? kModeFdmBit : 0U) |
           (mode.multiplexing == Multiplexing::dual_band ? kModeDualBandBit : 0U) | (mode.columns ? kModeColumnsBit : 0U);
}

/// False if undefined bits, or both bits of the multiplexing, are set.
constexpr bool mode_of_argument(std::uint32_t argument, ModeRequest& mode) {
    using signal::Multiplexing;
    const Multiplexing one_band = (argument & kModeFdmBit) != 0 ? Multiplexing::fdm : Multiplexing::tdm;
    mode = {argument & kModeRateMask, (argument & kModeDualBandBit) != 0 ? Multiplexing::dual_band : one_band,
            (argument & kModeColumnsBit) != 0};
    return argument == mode_argument(mode);
}

/// Direction to the sensor's half space, source frame: three signed bytes, sensor index in the top byte. Zero: unknown.
struct HemisphereRequest {
    std::uint8_t sensor = 0;
    Vec3<float> towards = Vec3<float>::Zero();
};

/// Direction in steps of 1/127 of its largest component. Zero if it is not finite.
inline std::uint32_t hemisphere_argument(const HemisphereRequest& request) {
    const float largest = request.towards.cwiseAbs().maxCoeff();
    const bool is_direction = request.towards.allFinite() && largest > 0;
    std::uint32_t argument = static_cast<std::uint32_t>(request.sensor) << 24U;
    for (Index i = 0; i < 3 && is_direction; ++i) {
        const auto part = static_cast<std::int8_t>(std::lround(127 * request.towards(i) / largest));
        argument |= static_cast<std::uint32_t>(static_cast<std::uint8_t>(part)) << static_cast<unsigned>(8 * i);
    }
    return argument;
}

inline HemisphereRequest hemisphere_of_argument(std::uint32_t argument) {
    const auto part = [&](unsigned i) { return static_cast<float>(static_cast<std::int8_t>(argument >> (8 * i))); };
    return {static_cast<std::uint8_t>(argument >> 24U), {part(0), part(1), part(2)}};
}

}  // namespace tricoil::protocol
