#include "sim/world/converter.hpp"

#include <algorithm>
#include <cmath>

namespace tricoil::sim {

Converter::Converter(const ConverterParams& params, double sample_rate_hz)
    : params_(params),
      volts_per_code_(params.range_v / std::ldexp(1.0, params.bits - 1)),
      codes_per_volt_(1 / volts_per_code_),
      full_scale_(static_cast<std::int32_t>((std::int64_t{1} << (params.bits - 1)) - 1)),
      noise_v_(params.noise_v_per_sqrt_hz * std::sqrt(sample_rate_hz / 2)) {}

std::int32_t Converter::convert(double volts, std::mt19937_64& random) {
    const double amplified = std::clamp(volts + params_.offset_v, -params_.rail_v, params_.rail_v);
    const double noisy = noise_v_ > 0 ? amplified + noise_v_ * normal_(random) : amplified;
    const double code = std::nearbyint(noisy * codes_per_volt_);
    const double limit = full_scale_;
    return static_cast<std::int32_t>(std::clamp(code, -limit, limit));
}

}  // namespace tricoil::sim
