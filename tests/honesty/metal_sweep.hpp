// Sweep over metal objects: one table of poses per mode and tracker.
#pragma once

#include <algorithm>
#include <array>
#include <string>
#include <vector>

#include "tests/honesty/replay_columns.hpp"
#include "tests/support/metal_case.hpp"

namespace tricoil::test {

constexpr std::array kSweepModes{signal::Multiplexing::tdm, signal::Multiplexing::fdm, signal::Multiplexing::dual_band};

/// Result of the sweep of one mode.
struct MetalSweep {
    struct Tracker {
        Method method = Method::direct;
        PoseRow all;
        std::array<PoseRow, MetalCase::kShapes.size()> by_shape;
        std::array<PoseRow, 4> by_motion;  // bit 0: the sensor moves; bit 1: the metal moves
        std::uint64_t worst_seed = 0;
        double worst_m = 0;
    };
    std::vector<Tracker> trackers;    // the last one: the filter, or the tracker for two bands
    std::vector<std::uint64_t> late;  // seeds: 0.5 s after the metal has gone, a pose of the last one is invalid or 5 mm wrong
};

inline bool is_late(const SimulatedColumns& run, Method method) {
    constexpr double kBack_s = 0.5;
    constexpr double kBack_m = 5e-3;
    const PoseRow after = replay_columns(run, method, {}, MetalCase::kMetalEnd_s + kBack_s);
    return after.valid < after.poses || after.max_m() > kBack_m;
}

/// Cases `first_seed` to `first_seed + cases - 1`.
inline MetalSweep sweep_metal(signal::Multiplexing mode, std::uint64_t first_seed, std::uint64_t cases) {
    const std::vector<Method> methods = mode == signal::Multiplexing::dual_band ? std::vector{Method::direct, Method::dual_band}
                                                                                : std::vector(kMethods.begin(), kMethods.end());
    MetalSweep sweep;
    for (const Method method : methods) {
        sweep.trackers.emplace_back().method = method;
    }
    for (std::uint64_t seed = first_seed; seed < first_seed + cases; ++seed) {
        MetalCase metal_case = random_metal_case(seed);
        const std::size_t shape = metal_case.shape;
        const std::size_t motion = (metal_case.sensor_moves ? 1U : 0U) + (metal_case.metal_moves ? 2U : 0U);
        const bool goes = metal_case.metal.end_s < MetalCase::kDuration_s;
        const SimulatedColumns run = columns_of(std::move(metal_case), signal::default_acquisition(mode, 240), seed);
        for (MetalSweep::Tracker& tracker : sweep.trackers) {
            const PoseRow row = replay_columns(run, tracker.method);
            tracker.all.add(row);
            tracker.by_shape[shape].add(row);
            tracker.by_motion[motion].add(row);
            if (row.max_m() > tracker.worst_m) {
                tracker.worst_m = row.max_m();
                tracker.worst_seed = seed;
            }
        }
        if (goes && is_late(run, methods.back())) {
            sweep.late.push_back(seed);
        }
    }
    return sweep;
}

inline void print(const MetalSweep& sweep, const char* mode) {
    constexpr std::array kMotions{"all at rest", "sensor moves", "metal moves", "both move"};
    PoseRow::print_header();
    for (const MetalSweep::Tracker& tracker : sweep.trackers) {
        const std::string name = std::string(mode) + " " + name_of(tracker.method);
        tracker.all.print(name);
        for (std::size_t s = 0; s < MetalCase::kShapes.size(); ++s) {
            tracker.by_shape[s].print("  " + name + ", " + MetalCase::kShapes[s]);
        }
        for (std::size_t m = 0; m < kMotions.size(); ++m) {
            tracker.by_motion[m].print("  " + name + ", " + kMotions[m]);
        }
        std::printf("  largest error: seed %llu\n", static_cast<unsigned long long>(tracker.worst_seed));
    }
    std::printf("%s: %zu cases in which the last tracker is late after the metal has gone\n", mode, sweep.late.size());
}

}  // namespace tricoil::test
