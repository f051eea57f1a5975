#include "sim/virtual_board/coils/eddy_response.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>

#include "sim/world/metal/sphere.hpp"

namespace tricoil::virtual_board {
namespace {

using Complex = std::complex<double>;

/// Polarisability of a sphere at each tone, in units of a^3 / 2, times the identity.
std::vector<sim::ComplexMat3> responses(const sim::Material& material, double radius_m) {
    std::vector<sim::ComplexMat3> fields;
    for (const double hz : EddyResponse::tones_hz()) {
        const Complex share = sim::sphere_polarisability({radius_m}, material, hz) / (std::pow(radius_m, 3) / 2);
        fields.push_back(share * sim::ComplexMat3::Identity());
    }
    return fields;
}

/// Complex response to cos(w t): projection of its derivative over ten periods, after ten periods of settling.
Complex driven(const EddyResponse::Terms& terms, double hz) {
    const double w = 2 * M_PI * hz;
    const double step_s = 1 / (200 * hz);
    LoopCurrents loops;
    Complex sum = 0;
    for (int n = 1; n <= 4000; ++n) {
        const double t = n * step_s;
        loops.advance(step_s, -w * std::sin(w * (t - step_s)), -w * std::sin(w * t), std::cos(w * t));
        double value = 0;
        for (std::size_t p = 0; p < EddyResponse::kTerms; ++p) {
            value += terms[p](0, 0) * loops.derivatives()[p];
        }
        sum += n > 2000 ? value * std::polar(1.0, -w * t) / 1000.0 : 0.0;
    }
    return sum / Complex(0, w);
}

TEST(EddyResponse, SineWavesKeepTheirAmplitudeAndPhase) {
    const EddyResponse response;
    for (const sim::NamedMaterial& metal : sim::materials()) {
        for (const double radius_m : {0.002, 0.01, 0.04}) {
            const auto fields = responses(metal.material, radius_m);
            const auto terms = response.fit(fields);
            double largest = 0;
            for (const sim::ComplexMat3& field : fields) {
                largest = std::max(largest, std::abs(field(0, 0)));
            }
            for (const double hz : {326.0, 1000.0, 7680.0, 9600.0, 13450.0}) {
                const Complex expected = sim::sphere_polarisability({radius_m}, metal.material, hz) / (std::pow(radius_m, 3) / 2);
                EXPECT_LT(std::abs(driven(terms, hz) - expected), 0.02 * largest) << metal.name << " " << radius_m << " " << hz;
            }
        }
    }
}

TEST(EddyResponse, AStepDecays) {
    const EddyResponse response;
    const auto terms = response.fit(responses(sim::materials()[0].material, 0.002));
    LoopCurrents loops;
    const double step_s = 1e-6;
    loops.advance(step_s, 1 / step_s, 1 / step_s, 1);
    for (int n = 0; n < 100'000; ++n) {
        loops.advance(step_s, 0, 0, 1);
    }
    double rest = 0;
    for (std::size_t p = 1; p < EddyResponse::kTerms; ++p) {
        rest += std::abs(terms[p](0, 0) * loops.currents()[p]);
    }
    EXPECT_LT(rest, 1e-6);
}

}  // namespace
}  // namespace tricoil::virtual_board
