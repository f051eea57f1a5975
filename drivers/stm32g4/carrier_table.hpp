// A whole number of carrier cycles as DAC codes.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <numeric>
#include <span>

namespace tricoil::stm32g4 {

constexpr std::uint16_t kDacMiddle = 2048;

/// Shortest period of a carrier that is updated at a fixed rate: `cycles` whole cycles in `updates` values.
struct CarrierPeriod {
    int updates = 0;
    int cycles = 0;
};

constexpr CarrierPeriod shortest_period(int updates, int cycles) {
    const int common = std::gcd(updates, cycles);
    return common == 0 ? CarrierPeriod{} : CarrierPeriod{updates / common, cycles / common};
}

/// Fills the first period.updates values of `table`, starting at phase zero.
inline void write_carrier(CarrierPeriod period, float amplitude_codes, std::span<std::uint16_t> table) {
    const float step = 2 * std::numbers::pi_v<float> / static_cast<float>(period.updates);
    for (int n = 0; n < period.updates; ++n) {
        const int turn = static_cast<int>(std::int64_t{n} * period.cycles % period.updates);
        const float code = amplitude_codes * std::sin(step * static_cast<float>(turn));
        table[static_cast<std::size_t>(n)] = static_cast<std::uint16_t>(kDacMiddle + std::lround(code));
    }
}

}  // namespace tricoil::stm32g4
