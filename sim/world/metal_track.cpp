#include "sim/world/metal_track.hpp"

#include <algorithm>
#include <cmath>

#include "core/linear/eigen.hpp"

namespace tricoil::sim {

CurrentColumns metal_field(MetalSet& metal, const MetalSource& source, const Vec3<double>& place_m, double time_s,
                           double selection_s) {
    const std::vector<ComplexMat3> fields = metal.field(place_m, time_s, selection_s);
    CurrentColumns field(3, static_cast<Index>(source.currents));
    for (std::size_t n = 0; n < source.currents; ++n) {
        const auto coil = static_cast<Index>(n % kSourceCoils);
        field.col(static_cast<Index>(n)) =
            eigen(fields[source.frequencies[n]] * source.moments.col(coil).cast<std::complex<double>>());
    }
    return field;
}

MetalTrack::MetalTrack(MetalSet& metal, const Motion& motion, const MetalSource& source, double start_s, double sample_s,
                       std::size_t samples) {
    const double first_s = start_s - sample_s;
    const double length_s = static_cast<double>(samples) * sample_s;
    const int spans = std::max(1, static_cast<int>(std::ceil(length_s / kMaxSpan_s)));
    const double knot_s = length_s / (2 * spans);
    knots_per_sample_ = sample_s / knot_s;
    for (int i = 0; i <= 2 * spans; ++i) {
        const double time_s = first_s + i * knot_s;
        knots_.push_back(metal_field(metal, source, motion.at(time_s).position_m, time_s, start_s));
    }
}

CurrentColumns MetalTrack::at(int n) const {
    const double place = (n + 1) * knots_per_sample_;
    const std::size_t last = knots_.size() - 3;
    const std::size_t base = std::min(last, 2 * static_cast<std::size_t>(place / 2));
    const double t = place - static_cast<double>(base) - 1;  // -1 to 1
    return t * (t - 1) / 2 * knots_[base] + (1 - t * t) * knots_[base + 1] + t * (t + 1) / 2 * knots_[base + 2];
}

}  // namespace tricoil::sim
