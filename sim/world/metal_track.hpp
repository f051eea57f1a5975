// The field of metal at every ADC sample of a block, interpolated between a few evaluations.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "sim/motion/motion.hpp"
#include "sim/world/metal/metal_set.hpp"

namespace tricoil::sim {

struct MetalSource {
    Mat3<double> moments = Mat3<double>::Identity();  // one column per coil
    std::array<std::size_t, 3> tone_of_coil{};        // index of the coil's carrier in the set's frequencies
};

/// Field that metal adds at a place in the source frame; column j is that of coil j at its carrier. Times: see MetalSet::field().
ComplexMat3 metal_field(MetalSet& metal, const MetalSource& source, const Vec3<double>& place_m, double time_s,
                        double selection_s);

/// The same from the fields at all frequencies of the set, at one place and time.
ComplexMat3 metal_field(const std::vector<ComplexMat3>& fields, const MetalSource& source);

/// Parabolas of at most 4 ms: for 1 m/s at 50 mm from an object the error is below 3e-4 of the added field.
class MetalTrack {
public:
    /// One source per band of tones. Covers samples -1 to `samples` - 1 of the block that starts at `start_s`.
    MetalTrack(MetalSet& metal, const Motion& motion, std::span<const MetalSource> bands, double start_s, double sample_s,
               std::size_t samples);

    /// metal_field() of a band at sample n, -1 and later.
    [[nodiscard]] ComplexMat3 at(int n, std::size_t band = 0) const;

private:
    static constexpr double kMaxSpan_s = 4e-3;

    std::vector<std::vector<ComplexMat3>> knots_;  // per band: two per parabola, and a last one
    double knots_per_sample_ = 0;
};

}  // namespace tricoil::sim
