// A whole number of cycles of one carrier, or of two carriers at the same time, as DAC codes.
#pragma once

#include <complex>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <numeric>
#include <span>

#include "core/signal/complex_division.hpp"

namespace tricoil::stm32g4 {

constexpr std::uint16_t kDacMiddle = 2048;

/// Shortest common period of a high and a low carrier that are updated at a fixed rate: whole cycles in `updates` values.
struct CarrierPeriod {
    int updates = 0;
    int cycles = 0;
    int low_cycles = 0;  // 0: no low carrier
};

/// `cycles` and `low_cycles`: in `updates` values.
constexpr CarrierPeriod shortest_period(int updates, int cycles, int low_cycles = 0) {
    const int common = std::gcd(std::gcd(updates, cycles), low_cycles);
    return common == 0 ? CarrierPeriod{} : CarrierPeriod{updates / common, cycles / common, low_cycles / common};
}

/// Sine from phase zero, by recurrence. Every 32 values it starts from an exact value. A sine of each value would take longer
/// than a block.
class SineWave {
public:
    /// `cycles` whole cycles in `values` values.
    SineWave(int cycles, int values) : cycles_(cycles), values_(values), step_(phasor(1)) {}

    float next() {
        constexpr int kExactEvery = 32;
        phasor_ = n_ % kExactEvery == 0 ? phasor(n_) : signal::multiply(phasor_, step_);
        ++n_;
        return phasor_.imag();
    }

private:
    [[nodiscard]] std::complex<float> phasor(int n) const {
        const float turn = static_cast<float>(n * cycles_ % values_) / static_cast<float>(values_);
        return std::polar(1.0F, 2 * std::numbers::pi_v<float> * turn);
    }

    int cycles_;
    int values_;
    int n_ = 0;
    std::complex<float> step_;
    std::complex<float> phasor_;
};

/// Fills the first period.updates values of `table` with the sum of both sines, which start at phase zero.
inline void write_carriers(const CarrierPeriod& period, float amplitude_codes, float low_amplitude_codes,
                           std::span<std::uint16_t> table) {
    if (period.updates == 0) {
        return;
    }
    SineWave high(period.cycles, period.updates);
    SineWave low(period.low_cycles, period.updates);
    for (std::uint16_t& value : table.first(static_cast<std::size_t>(period.updates))) {
        const float low_code = period.low_cycles == 0 ? 0 : low_amplitude_codes * low.next();
        constexpr float kHalf = 0.5F;  // the conversion truncates
        value = static_cast<std::uint16_t>(kDacMiddle + kHalf + low_code + amplitude_codes * high.next());
    }
}

}  // namespace tricoil::stm32g4
