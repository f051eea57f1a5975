// Metal near the coils: response by frequency, error of the pose by distance, error and distortion figure.
#include <fmt/format.h>

#include <cmath>
#include <iterator>
#include <random>

#include "board/host/figures/figures.hpp"
#include "board/support/whole_file.hpp"
#include "core/solver/direct.hpp"
#include "core/tracking/judge/misfit.hpp"
#include "sim/world/metal/metal_set.hpp"
#include "sim/world/metal/sphere.hpp"

namespace tricoil::host {
namespace {

constexpr double kCarrier_hz = 10e3;
constexpr double kRadius_m = 0.02;
const Vec3<double> kSensor_m(0.5, 0, 0);

struct MetalError {
    double error_m;       // of the position of the direct solution
    double distortion_m;  // as the trackers report it, without noise
};

MetalError error_beside(const sim::Material& material, const Vec3<double>& place_m) {
    sim::MetalObject sphere{sim::Sphere{kRadius_m}, material, {place_m, Quat<double>::Identity()}};
    sim::MetalSet metal;
    metal.add(sphere, 0, 1);
    metal.tune({kCarrier_hz});
    const Mat3<double> field = sim::unit_dipole_field(kSensor_m) + metal.field(kSensor_m, 0, 0)[0].real();
    const auto solution = solver::solve_direct<double>(0.5 * field, 1);  // coupling constant 1 m^3: (6) with unit moments
    const double hidden = tracking::kHiddenShare * std::sqrt(solution->misfit_squared / 3);
    return {(solution->position_towards(kSensor_m) - kSensor_m).norm(),
            tracking::likely_distortion(solution->strength, solution->range_m, hidden)};
}

std::string header(const char* first, const std::vector<const char*>& values) {
    std::string text = first;
    for (const sim::NamedMaterial& metal : sim::materials()) {
        for (const char* value : values) {
            fmt::format_to(std::back_inserter(text), ",{}_{}", metal.name, value);
        }
    }
    return text + "\n";
}

/// Moment of the sphere by frequency, in units in which a perfect conductor of its size has -1.
void write_response(const std::filesystem::path& file) {
    std::string text = header("frequency_hz", {"in_phase", "quadrature"});
    for (double hz = 100; hz < 1.01e5; hz *= std::pow(10, 0.05)) {
        fmt::format_to(std::back_inserter(text), "{:.6g}", hz);
        for (const sim::NamedMaterial& metal : sim::materials()) {
            const auto share = 2.0 * sim::sphere_polarisability({kRadius_m}, metal.material, hz) / std::pow(kRadius_m, 3);
            fmt::format_to(std::back_inserter(text), ",{:.6g},{:.6g}", share.real(), share.imag());
        }
        text += "\n";
    }
    write_whole_file(file, text);
}

void write_distance(const std::filesystem::path& file, const InterruptGuard& guard) {
    std::string text = header("distance_m", {"error_mm"});
    for (double distance_m = 0.04; distance_m < 0.401; distance_m += 0.01) {
        guard.check();
        fmt::format_to(std::back_inserter(text), "{:.3f}", distance_m);
        const Vec3<double> place_m(0.5 * kSensor_m.x(), 0.8 * distance_m, 0.6 * distance_m);
        for (const sim::NamedMaterial& metal : sim::materials()) {
            fmt::format_to(std::back_inserter(text), ",{:.6g}", 1e3 * error_beside(metal.material, place_m).error_m);
        }
        text += "\n";
    }
    write_whole_file(file, text);
}

void write_distortion(const std::filesystem::path& file, const InterruptGuard& guard) {
    std::string text = "distortion_mm,error_mm\n";
    std::mt19937_64 random(1);
    std::uniform_real_distribution<double> uniform(-0.5, 0.5);
    for (int n = 0; n < 240;) {
        guard.check();
        const Vec3<double> place_m = 0.5 * kSensor_m + Vec3<double>(uniform(random), uniform(random), uniform(random));
        if (std::min(place_m.norm(), (place_m - kSensor_m).norm()) < 3 * kRadius_m) {
            continue;
        }
        const MetalError metal = error_beside(sim::materials()[n % sim::materials().size()].material, place_m);
        fmt::format_to(std::back_inserter(text), "{:.6g},{:.6g}\n", 1e3 * metal.distortion_m, 1e3 * metal.error_m);
        ++n;
    }
    write_whole_file(file, text);
}

}  // namespace

void write_metal_figure(const std::filesystem::path& folder, const InterruptGuard& guard) {
    write_response(folder / "metal_response.csv");
    write_distance(folder / "metal_distance.csv", guard);
    write_distortion(folder / "metal_distortion.csv", guard);
}

}  // namespace tricoil::host
