#include "sim/world/metal/metal_set.hpp"

#include <algorithm>
#include <stdexcept>

#include <fmt/format.h>

namespace tricoil::sim {

void MetalSet::add(const MetalObject& object, double begin_s, double end_s) {
    if (const auto invalid = find_invalid(object)) {
        throw std::invalid_argument(fmt::format("metal: '{}' {}", invalid->key, invalid->requirement));
    }
    objects_.push_back({object, begin_s, end_s, make_body(object.shape, object.material), false});
}

void MetalSet::tune(const std::vector<double>& frequencies_hz) {
    frequencies_ = frequencies_hz.size();
    for (Entry& entry : objects_) {
        entry.body->tune(frequencies_hz);
        entry.is_placed = false;
    }
}

bool MetalSet::acts_at(double time_s) const {
    return std::any_of(objects_.begin(), objects_.end(), [&](const Entry& e) { return time_s >= e.begin_s && time_s < e.end_s; });
}

std::vector<ComplexMat3> MetalSet::field(const Vec3<double>& place_m, double time_s, double selection_s) {
    std::vector<ComplexMat3> sum(frequencies_, ComplexMat3::Zero());
    std::vector<ComplexMat3> own(frequencies_);
    for (Entry& entry : objects_) {
        if (selection_s < entry.begin_s || selection_s >= entry.end_s) {
            continue;
        }
        const Pose pose = entry.object.at(time_s);
        const Mat3<double> turn = pose.q_source_sensor.toRotationMatrix();
        if (!entry.is_placed || !entry.object.is_at_rest()) {
            entry.body->place_source(outside(entry.object.shape, -turn.transpose() * pose.position_m));
            entry.is_placed = true;
        }
        std::fill(own.begin(), own.end(), ComplexMat3::Zero());
        entry.body->add_field(outside(entry.object.shape, turn.transpose() * (place_m - pose.position_m)), own);
        for (std::size_t k = 0; k < frequencies_; ++k) {
            sum[k] += turn.cast<std::complex<double>>() * own[k] * turn.transpose().cast<std::complex<double>>();
        }
    }
    return sum;
}

}  // namespace tricoil::sim
