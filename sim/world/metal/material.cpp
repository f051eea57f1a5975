#include "sim/world/metal/material.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace tricoil::sim {
namespace {

// Values and sources: README.md, table of materials.
constexpr std::array<NamedMaterial, 6> kMaterials{{
    {"copper", "annealed copper", {5.96e7, 1, 1}},
    {"aluminium", "6061 aluminium", {3.77e7, 1, 1}},
    {"titanium", "titanium alloy Ti-6Al-4V", {5.85e5, 1, 1}},
    {"304", "304 stainless steel, annealed", {1.39e6, 1.02, 1.02}},
    {"416", "416 stainless steel", {1.75e6, 800, 500}},
    {"steel", "low-carbon steel", {6.29e6, 240, 180}},
}};

}  // namespace

double Material::permeability(double hz) const {
    const double share = std::log(hz / kLow_hz) / std::log(kHigh_hz / kLow_hz);
    return std::lerp(permeability_low, permeability_high, std::clamp(share, 0.0, 1.0));
}

std::complex<double> propagation_constant(const Material& material, double hz) {
    constexpr double kMu0 = 4e-7 * std::numbers::pi;
    return std::sqrt(
        std::complex<double>(0, 2 * std::numbers::pi * hz * kMu0 * material.permeability(hz) * material.conductivity_s_m));
}

std::span<const NamedMaterial> materials() { return kMaterials; }

}  // namespace tricoil::sim
