#include "board/support/sim_input/scenario_file.hpp"

#include <algorithm>
#include <cmath>

#include "board/support/checked_table.hpp"
#include "board/support/errors.hpp"
#include "board/support/line_reader.hpp"
#include "board/support/nearest_name.hpp"
#include "board/support/sim_input/builtin.hpp"
#include "board/support/sim_input/fault_text.hpp"
#include "board/support/sim_input/metal_text.hpp"
#include "board/support/text_table.hpp"
#include "core/base/angle_units.hpp"
#include "sim/motion/simple_motions.hpp"

namespace tricoil::host {
namespace {

constexpr double kFarthest_m = 1000;
constexpr double kFastest_hz = 1000;

Vec3<double> read_place(CheckedTable& table, const std::string& key, const Vec3<double>& fallback) {
    const Vec3<double> place = table.vector(key, fallback);
    table.require(place.cwiseAbs().maxCoeff() <= kFarthest_m, key, "must lie within 1000 m");
    return place;
}

double read_length(CheckedTable& table, const std::string& key, double fallback) {
    const double length = table.positive(key, fallback);
    table.require(length <= kFarthest_m, key, "must be at most 1000 m");
    return length;
}

double read_rate(CheckedTable& table) {
    const double rate_hz = table.positive("rate_hz", 1);
    table.require(rate_hz <= kFastest_hz, "rate_hz", "must be at most 1000");
    return rate_hz;
}

Quat<double> read_euler(CheckedTable& table) {
    const Vec3<double> euler = kRadians * table.vector("euler_deg", {0, 0, 0});
    return geometry::attitude_quaternion(geometry::attitude_matrix(geometry::Euler<double>{euler.x(), euler.y(), euler.z()}));
}

sim::Pose read_pose(CheckedTable& table) {
    const Vec3<double> position = read_place(table, "position_m", {0.5, 0, 0});
    return {position, read_euler(table)};
}

sim::PivotParams read_pivot(CheckedTable& table) {
    sim::PivotParams pivot;
    pivot.pivot_m = read_place(table, "pivot_m", pivot.pivot_m);
    pivot.q_mean = read_euler(table);
    pivot.tip_m = read_place(table, "tip_m", pivot.tip_m);
    pivot.tilt_rad = kRadians * table.vector("tilt_deg", kDegrees * pivot.tilt_rad);
    pivot.rate_hz = read_rate(table);
    return pivot;
}

sim::GridParams read_grid(CheckedTable& table) {
    constexpr double kMostNodes = 100;
    sim::GridParams grid;
    grid.centre_m = read_place(table, "centre_m", grid.centre_m);
    grid.spacing_m = read_place(table, "spacing_m", grid.spacing_m);
    const Vec3<double> nodes = table.vector("nodes", {3, 3, 3});
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const double count = nodes(static_cast<Index>(axis));
        table.require(count >= 1 && count <= kMostNodes && count == std::floor(count), "nodes",
                      "must be three whole numbers, 1 to 100");
        grid.nodes[axis] = static_cast<int>(count);
    }
    grid.attitudes = std::max(1, static_cast<int>(table.whole("attitudes", 1, 100)));
    grid.rest_s = table.positive("rest_s", grid.rest_s);
    return grid;
}

sim::PaperRates read_rates(CheckedTable& table) {
    sim::PaperRates rates;
    rates.azimuth_amplitude = table.number("azimuth_amplitude_rad_s", 0);
    rates.azimuth_offset = table.number("azimuth_offset_rad_s", 0);
    rates.elevation_amplitude = table.number("elevation_amplitude_rad_s", 0);
    rates.elevation_offset = table.number("elevation_offset_rad_s", 0);
    rates.attitude_amplitude = table.number("attitude_amplitude_rad_s", 0);
    rates.start_range_m = read_length(table, "start_range_m", 0.5);
    return rates;
}

std::unique_ptr<sim::Motion> read_motion(CheckedTable table, std::uint64_t seed) {
    const std::string kind = table.choice("kind", {"still", "line", "circle", "pivot", "grid", "hand", "paper"});
    std::unique_ptr<sim::Motion> motion;
    if (kind == "still") {
        motion = std::make_unique<sim::StillMotion>(read_pose(table));
    } else if (kind == "line") {
        const sim::Pose centre = read_pose(table);
        motion = std::make_unique<sim::LineMotion>(centre, read_place(table, "amplitude_m", {0, 0.2, 0}), read_rate(table));
    } else if (kind == "circle") {
        const Vec3<double> centre = read_place(table, "centre_m", {0.5, 0, 0});
        motion = std::make_unique<sim::CircleMotion>(centre, read_length(table, "radius_m", 0.15), read_rate(table));
    } else if (kind == "pivot") {
        motion = std::make_unique<sim::PivotMotion>(read_pivot(table));
    } else if (kind == "grid") {
        motion = std::make_unique<sim::GridMotion>(read_grid(table), seed);
    } else if (kind == "hand") {
        motion = std::make_unique<sim::HandMotion>(read_place(table, "centre_m", {0.6, 0, 0}), seed);
    } else {
        motion = std::make_unique<sim::PaperMotion>(read_rates(table));
    }
    table.finish();
    return motion;
}

sim::WorldParams read_world(CheckedTable table, std::uint64_t seed) {
    sim::WorldParams world;
    world.seed = seed;
    world.coupling_constant_m3 = table.positive("coupling_constant_m3", world.coupling_constant_m3);
    world.coil_resistance_ohm = table.positive("coil_resistance_ohm", world.coil_resistance_ohm);
    world.coil_inductance_h = table.positive("coil_inductance_h", world.coil_inductance_h);
    world.mains_v = table.number("mains_v", world.mains_v);
    world.mains_hz = table.positive("mains_hz", world.mains_hz);
    world.source_matrix = table.matrix("source_matrix", world.source_matrix);
    world.sensor_matrix = table.matrix("sensor_matrix", world.sensor_matrix);
    world.pick_up = table.matrix("pick_up", world.pick_up);
    const double bits = table.number("converter_bits", world.converter.bits);
    world.converter.bits = bits >= 1 && bits <= 64 ? static_cast<int>(bits) : 0;
    world.converter.range_v = table.positive("converter_range_v", world.converter.range_v);
    world.converter.noise_v_per_sqrt_hz = table.number("noise_v_per_sqrt_hz", world.converter.noise_v_per_sqrt_hz);
    world.converter.offset_v = table.number("offset_v", world.converter.offset_v);
    world.converter.rail_v = table.positive("rail_v", world.converter.rail_v);
    table.finish();
    sim::check(world);
    return world;
}

sim::Fault read_metal_fault(CheckedTable& table) {
    sim::Fault fault;
    fault.kind = sim::FaultKind::metal;
    fault.metal = read_metal(table);
    fault.begin_s = table.number("begin_s", 0);
    fault.end_s = table.has("end_s") ? table.number("end_s", 0) : fault.end_s;
    table.require(fault.begin_s >= 0 && fault.end_s > fault.begin_s, "begin_s", "and 'end_s' must be times in order");
    table.finish();
    return fault;
}

sim::Scenario parse_scenario(const std::string& name, std::string_view text, std::uint64_t seed) {
    const toml::table document = parse_toml(name, text);
    CheckedTable table(name, "", document);
    sim::Scenario scenario;
    scenario.name = name;
    scenario.description = table.text("description", "");
    scenario.duration_s = table.positive("duration_s", scenario.duration_s);
    for (const std::string& fault : table.texts("faults")) {
        scenario.faults.push_back(parse_fault(fault));
    }
    for (CheckedTable& metal : table.children("metal")) {
        scenario.faults.push_back(read_metal_fault(metal));
    }
    scenario.motion = read_motion(table.child("motion"), seed);
    scenario.world = read_world(table.child("world"), seed);
    table.finish();
    return scenario;
}

std::string description_of(const BuiltinScenario& builtin) { return parse_scenario(builtin.name, builtin.text, 1).description; }

}  // namespace

std::vector<ScenarioName> builtin_scenarios() {
    std::vector<ScenarioName> names;
    for (const BuiltinScenario& builtin : kBuiltinScenarios) {
        names.push_back({builtin.name, description_of(builtin)});
    }
    return names;
}

sim::Scenario load_scenario(const std::string& name_or_path, std::uint64_t seed) {
    if (name_or_path.ends_with(".toml")) {
        return parse_scenario(name_or_path, read_text(name_or_path, kLongestToml), seed);
    }
    std::vector<std::string> names;
    for (const BuiltinScenario& builtin : kBuiltinScenarios) {
        names.emplace_back(builtin.name);
    }
    return parse_scenario(name_or_path, kBuiltinScenarios[index_of_name("scenario", name_or_path, names)].text, seed);
}

}  // namespace tricoil::host
