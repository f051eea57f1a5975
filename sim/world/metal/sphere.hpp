// Conducting, permeable sphere in the field of point dipoles: exact series.
#pragma once

#include <array>
#include <complex>
#include <vector>

#include "sim/world/metal/body.hpp"

namespace tricoil::sim {

/// Response of a sphere to the multipole of order n >= 1: the scalar potential r^n becomes r^n + A a^(2n+1) r^(-n-1). z = k a.
std::complex<double> sphere_coefficient(int n, std::complex<double> z, double permeability);

/// Magnetic polarisability over 4 pi, m^3: moment = 4 pi alpha H. -a^3/2 for a perfect conductor (Wait 1951).
std::complex<double> sphere_polarisability(const Sphere& sphere, const Material& material, double hz);

class SphereBody final : public MetalBody {
public:
    SphereBody(const Sphere& sphere, const Material& material) : sphere_(sphere), material_(material) {}

private:
    static constexpr int kOrders = 40;

    void do_tune(const std::vector<double>& frequencies_hz) override;
    void do_place_source(const Vec3<double>& source_m) override { source_m_ = source_m; }
    void do_add_field(const Vec3<double>& sensor_m, std::span<ComplexMat3> fields) const override;

    Sphere sphere_;
    Material material_;
    Vec3<double> source_m_ = Vec3<double>::Zero();
    std::vector<std::array<std::complex<double>, kOrders>> coefficients_;  // of orders 1 to kOrders, per frequency
};

}  // namespace tricoil::sim
