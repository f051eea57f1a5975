#include "sim/world/metal_track.hpp"

#include <algorithm>
#include <cmath>

namespace tricoil::sim {

ComplexMat3 metal_field(MetalSet& metal, const MetalSource& source, const Vec3<double>& place_m, double time_s,
                        double selection_s) {
    return metal_field(metal.field(place_m, time_s, selection_s), source);
}

ComplexMat3 metal_field(const std::vector<ComplexMat3>& fields, const MetalSource& source) {
    ComplexMat3 field;
    for (std::size_t j = 0; j < source.tone_of_coil.size(); ++j) {
        const auto column = static_cast<Eigen::Index>(j);
        field.col(column) = fields[source.tone_of_coil[j]] * source.moments.col(column).cast<std::complex<double>>();
    }
    return field;
}

MetalTrack::MetalTrack(MetalSet& metal, const Motion& motion, std::span<const MetalSource> bands, double start_s, double sample_s,
                       std::size_t samples)
    : knots_(bands.size()) {
    const double first_s = start_s - sample_s;
    const double length_s = static_cast<double>(samples) * sample_s;
    const int spans = std::max(1, static_cast<int>(std::ceil(length_s / kMaxSpan_s)));
    const double knot_s = length_s / (2 * spans);
    knots_per_sample_ = sample_s / knot_s;
    for (int i = 0; i <= 2 * spans; ++i) {
        const double time_s = first_s + i * knot_s;
        const std::vector<ComplexMat3> fields = metal.field(motion.at(time_s).position_m, time_s, start_s);
        for (std::size_t band = 0; band < bands.size(); ++band) {
            knots_[band].push_back(metal_field(fields, bands[band]));
        }
    }
}

ComplexMat3 MetalTrack::at(int n, std::size_t band) const {
    const std::vector<ComplexMat3>& knots = knots_[band];
    const double place = (n + 1) * knots_per_sample_;
    const std::size_t last = knots.size() - 3;
    const std::size_t base = std::min(last, 2 * static_cast<std::size_t>(place / 2));
    const double t = place - static_cast<double>(base) - 1;  // -1 to 1
    return t * (t - 1) / 2 * knots[base] + (1 - t * t) * knots[base + 1] + t * (t + 1) / 2 * knots[base + 2];
}

}  // namespace tricoil::sim
