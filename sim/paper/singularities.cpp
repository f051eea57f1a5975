#include "sim/paper/singularities.hpp"

#include <algorithm>
#include <cmath>

#include "core/error_model/singularity.hpp"

namespace tricoil::paper {
namespace {

std::vector<double> passages(const std::vector<Update>& updates, double Update::*elevation) {
    std::vector<double> times;
    const DeviceTime start = updates.front().stamp;
    error_model::SingularityDetector<double> detector(updates.front().*elevation, start);
    for (const Update& update : updates) {
        if (const auto passage = detector.update(update.*elevation, update.stamp)) {
            times.push_back(to_seconds(*passage - start));
        }
    }
    return times;
}

std::vector<double> jumps(const std::vector<Update>& updates) {
    std::vector<double> times;
    double largest = 0;
    for (std::size_t n = 1; n < updates.size(); ++n) {
        const double change = std::abs(updates[n].measured.position.azimuth_rad - updates[n - 1].measured.position.azimuth_rad);
        if (change <= kJumpRad) {
            largest = 0;
        } else if (change > largest) {
            if (largest > 0) {
                times.pop_back();  // only the largest of consecutive jumps counts
            }
            times.push_back(updates[n].time_s);
            largest = change;
        }
    }
    return times;
}

/// Time between a passage and the update interval (jump - T, jump]; 0 for a passage within the interval.
double distance(double jump_s, double passage_s, double update_s) {
    const double after = passage_s - jump_s;              // positive: passage after the update
    const double before = jump_s - update_s - passage_s;  // positive: passage before the update
    return std::max({after, before, 0.0});
}

double nearest(double jump_s, const std::vector<double>& passages_s, double update_s) {
    double best = INFINITY;
    for (const double passage_s : passages_s) {
        best = std::min(best, distance(jump_s, passage_s, update_s));
    }
    return best;
}

}  // namespace

SingularityReport compare_singularities(const std::vector<Update>& updates, double update_s) {
    SingularityReport report;
    report.predicted_s = passages(updates, &Update::predicted_elevation_rad);
    report.passages_s = passages(updates, &Update::measured_elevation_rad);
    report.jumps_s = jumps(updates);
    for (const double jump_s : report.jumps_s) {
        const double off = nearest(jump_s, report.predicted_s, update_s);
        const bool hit = off <= update_s;
        report.hits += hit ? 1 : 0;
        report.missed += hit ? 0 : 1;
        report.worst_distance_s = hit ? std::max(report.worst_distance_s, off) : report.worst_distance_s;
    }
    report.false_alarms =
        static_cast<int>(std::count_if(report.predicted_s.begin(), report.predicted_s.end(), [&](double passage_s) {
            return std::none_of(report.jumps_s.begin(), report.jumps_s.end(),
                                [&](double jump_s) { return distance(jump_s, passage_s, update_s) <= update_s; });
        }));
    return report;
}

}  // namespace tricoil::paper
