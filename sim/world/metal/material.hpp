// Metals by name: conductivity and permeability.
#pragma once

#include <complex>
#include <span>
#include <string_view>

namespace tricoil::sim {

/// Linear isotropic metal. The relative permeability of iron and steel falls with frequency; between two frequencies it is
/// interpolated over the logarithm of the frequency, outside it is constant.
struct Material {
    double conductivity_s_m = 3.77e7;
    double permeability_low = 1;   // relative, at kLow_hz and below
    double permeability_high = 1;  // relative, at kHigh_hz and above

    static constexpr double kLow_hz = 326;
    static constexpr double kHigh_hz = 10.5e3;

    [[nodiscard]] double permeability(double hz) const;
};

struct NamedMaterial {
    std::string_view name;
    std::string_view description;
    Material material;
};

/// Propagation constant inside a metal, k = sqrt(i w mu0 mu_r sigma), 1/m.
std::complex<double> propagation_constant(const Material& material, double hz);

/// The presets; sources in README.md.
std::span<const NamedMaterial> materials();

/// Limits of plausible values. Silver, the best conductor at room temperature, has 6.3e7 S/m.
constexpr double kMaxConductivity_s_m = 1e8;
constexpr double kMaxPermeability = 1e6;

}  // namespace tricoil::sim
