// Random cases of one metal object near a sensor, and the columns of such a case.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <numbers>
#include <string>

#include "sim/motion/simple_motions.hpp"
#include "sim/world/column_world.hpp"
#include "sim/world/metal/material.hpp"
#include "tests/support/random_poses.hpp"
#include "tests/support/simulated_columns.hpp"

namespace tricoil::test {

/// One metal object of 5 to 80 mm (diameter of a sphere, length of a rod or tube, side of a sheet) of any shape and material.
/// Sensor and object each rest, or move at up to 0.3 m/s. The centre of the object is always at least its size away from source
/// and sensor. Two of three objects exist only from kMetalBegin_s to kMetalEnd_s.
struct MetalCase {
    static constexpr double kDuration_s = 1.5;
    static constexpr double kMetalBegin_s = 0.3;
    static constexpr double kMetalEnd_s = 0.9;
    static constexpr double kSpeed_m_s = 0.3;
    static constexpr std::array<const char*, 4> kShapes{"sphere", "rod", "tube", "sheet"};

    std::unique_ptr<sim::Motion> motion;
    sim::Fault metal;
    std::size_t shape = 0;     // in kShapes
    std::size_t material = 0;  // in sim::materials()
    bool sensor_moves = false;
    bool metal_moves = false;
};

namespace metal_case {

/// Uniform in the logarithm.
inline double of_order(double low, double high, RandomPoses& random) { return low * std::pow(high / low, random.uniform(0, 1)); }

inline sim::MetalShape shape_of(std::size_t kind, double size_m, RandomPoses& random) {
    const double diameter_m = size_m / random.uniform(4, 20);
    const double ratio = random.uniform(0, 1);
    switch (kind) {
        case 0:
            return sim::Sphere{size_m / 2};
        case 1:
            return sim::Cylinder{diameter_m, size_m, 0};
        case 2:
            return sim::Cylinder{diameter_m, size_m, diameter_m * (0.05 + 0.25 * ratio)};
        default:
            return sim::Sheet{size_m, size_m * (0.5 + 0.5 * ratio), size_m * of_order(0.005, 0.05, random)};
    }
}

/// A place near source, sensor or the line between them: `size_m` to 0.4 m from it, uniform in the logarithm.
inline Vec3<double> place(const Vec3<double>& sensor_m, double size_m, RandomPoses& random) {
    const double on_line = std::clamp(random.uniform(-0.5, 1.5), 0.0, 1.0);
    const double distance_m = of_order(size_m, 0.4, random);
    return on_line * sensor_m + distance_m * random.direction();
}

inline bool keeps_distance(const sim::MetalObject& object, const sim::Motion& motion, double size_m) {
    constexpr double kStep_s = 0.01;
    for (double t = 0; t <= MetalCase::kDuration_s; t += kStep_s) {
        const Vec3<double> centre_m = object.at(t).position_m;
        if (centre_m.norm() < size_m || (centre_m - motion.at(t).position_m).norm() < size_m) {
            return false;
        }
    }
    return true;
}

}  // namespace metal_case

/// Case `seed`; equal seeds give equal cases.
inline MetalCase random_metal_case(std::uint64_t seed) {
    RandomPoses random(seed);
    const auto materials = sim::materials();
    MetalCase result;
    result.shape = seed % MetalCase::kShapes.size();
    result.material = static_cast<std::size_t>(random.uniform(0, 1) * static_cast<double>(materials.size()));
    result.sensor_moves = seed / 4 % 2 == 1;
    result.metal_moves = seed / 8 % 2 == 1;
    constexpr double kAmplitude_m = 0.06;
    const double reach_m = result.sensor_moves ? kAmplitude_m : 0;
    const double range_m = random.uniform(0.3 + reach_m, 0.9 - reach_m);
    sim::Pose centre;
    centre.position_m = range_m * random.direction();
    centre.q_source_sensor = random.attitude();
    const double rate_hz = MetalCase::kSpeed_m_s / (2 * std::numbers::pi * kAmplitude_m);
    result.motion = std::make_unique<sim::LineMotion>(centre, reach_m * random.direction(), rate_hz);
    const double size_m = random.uniform(0.005, 0.08);
    sim::MetalObject object;
    object.shape = metal_case::shape_of(result.shape, size_m, random);
    object.material = materials[result.material].material;
    object.pose.q_source_sensor = random.attitude();
    object.speed_m_s = result.metal_moves ? MetalCase::kSpeed_m_s : 0;
    do {
        object.pose.position_m = metal_case::place(centre.position_m, size_m, random);
        const double way_m = random.uniform(0.05, 0.2);
        object.far_m = object.pose.position_m + way_m * random.direction();
    } while (!metal_case::keeps_distance(object, *result.motion, size_m));
    result.metal.kind = sim::FaultKind::metal;
    result.metal.metal = object;
    if (seed % 3 != 0) {
        result.metal.begin_s = MetalCase::kMetalBegin_s;
        result.metal.end_s = MetalCase::kMetalEnd_s;
    }
    return result;
}

/// Columns of a scenario from sim::ColumnWorld, without samples.
inline SimulatedColumns columns_of(sim::Scenario&& scenario, const signal::AcquisitionParams& acquisition) {
    SimulatedColumns run;
    run.scenario = std::move(scenario);
    run.plan = *signal::plan_acquisition(acquisition);
    sim::CoilWorld world(run.scenario.world, *run.scenario.motion, run.scenario.faults);
    world.configure(run.plan);
    sim::ColumnWorld columns(world, run.scenario.faults);
    const auto blocks = static_cast<std::uint32_t>(run.scenario.duration_s / run.plan.block_s());
    for (std::uint32_t n = 0; n < blocks; ++n) {
        const double start_s = n * run.plan.block_s();
        const Excitation state = run.plan.is_tdm() ? single_coil(static_cast<int>(n % kSourceCoils)) : Excitation::all;
        signal::Columns<double> block;
        const DeviceTime start{microseconds_from_seconds(start_s)};
        if (columns.simulate({state, start_s, start, n}, block) && (run.plan.is_tdm() || n > 0)) {  // an FDM block settles
            run.columns.insert(run.columns.end(), block.begin(), block.end());
        }
    }
    return run;
}

inline sim::Scenario scenario_of(MetalCase&& metal_case, std::uint64_t seed) {
    sim::Scenario scenario;
    scenario.duration_s = MetalCase::kDuration_s;
    scenario.motion = std::move(metal_case.motion);
    scenario.faults = {metal_case.metal};
    scenario.world.seed = seed;
    return scenario;
}

inline SimulatedColumns columns_of(MetalCase&& metal_case, const signal::AcquisitionParams& acquisition, std::uint64_t seed) {
    return columns_of(scenario_of(std::move(metal_case), seed), acquisition);
}

}  // namespace tricoil::test
