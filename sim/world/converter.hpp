// Analog input of one channel: offset, noise, and an ADC with resolution, range and saturation.
#pragma once

#include <cstdint>
#include <random>

namespace tricoil::sim {

struct ConverterParams {
    int bits = 24;
    double range_v = 2.5;                // codes span +- range_v
    double noise_v_per_sqrt_hz = 33e-9;  // white; 106 dB in 72 kHz, as in an ADS1274
    double offset_v = 0;
    double rail_v = 1e9;  // clipping level of the preamplifier
};

class Converter {
public:
    Converter(const ConverterParams& params, double sample_rate_hz);

    [[nodiscard]] double volts_per_code() const { return volts_per_code_; }
    [[nodiscard]] std::int32_t full_scale() const { return full_scale_; }
    [[nodiscard]] double noise_v() const { return noise_v_; }  // standard deviation per sample, without quantisation

    std::int32_t convert(double volts, std::mt19937_64& random);

private:
    ConverterParams params_;
    double volts_per_code_;
    double codes_per_volt_;
    std::int32_t full_scale_;
    double noise_v_;
    std::normal_distribution<double> normal_{0, 1};
};

}  // namespace tricoil::sim
