#include "sim/world/metal/object.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/geometry/rotations.hpp"

namespace tricoil::sim {
namespace {

constexpr double kMinSize_m = 1e-4;
constexpr double kMaxSize_m = 10;
constexpr double kMinThickness_m = 1e-6;
constexpr double kMaxPlace_m = 1000;
constexpr double kMaxSpeed_m_s = 100;
constexpr double kMaxTurn_rad_s = 1000;
constexpr const char* kSizeRequirement = "must be from 0.1 mm to 10 m";

using Invalid = std::optional<InvalidValue>;

bool is_size(double value_m) { return value_m >= kMinSize_m && value_m <= kMaxSize_m; }

Invalid find_invalid_size(const Sphere& s) {
    return is_size(s.radius_m) ? std::nullopt : Invalid({"radius_m", kSizeRequirement});
}

Invalid find_invalid_size(const Cylinder& c) {
    if (!is_size(c.diameter_m)) {
        return {{"diameter_m", kSizeRequirement}};
    }
    if (!is_size(c.length_m)) {
        return {{"length_m", kSizeRequirement}};
    }
    if (c.length_m < 4 * c.diameter_m) {  // the model leaves out the end faces, which matter for shorter objects
        return {{"length_m", "must be at least four diameters"}};
    }
    if (c.wall_m != 0 && !(c.wall_m >= kMinThickness_m && 2 * c.wall_m < c.diameter_m)) {
        return {{"wall_m", "must be at least 1 micrometre and less than half the diameter"}};
    }
    return std::nullopt;
}

Invalid find_invalid_size(const Sheet& s) {
    if (!is_size(s.width_m)) {
        return {{"width_m", kSizeRequirement}};
    }
    if (!is_size(s.height_m)) {
        return {{"height_m", kSizeRequirement}};
    }
    const auto [shorter, longer] = std::minmax(s.width_m, s.height_m);
    if (longer > 10 * shorter) {
        return {{"width_m", "and 'height_m' must not differ by more than a factor of 10"}};
    }
    if (!(s.thickness_m >= kMinThickness_m && 5 * s.thickness_m <= shorter)) {
        return {{"thickness_m", "must be at least 1 micrometre and at most a fifth of width and height"}};
    }
    return std::nullopt;
}

Invalid find_invalid_value(const Material& m) {
    if (!(m.conductivity_s_m > 0 && m.conductivity_s_m <= kMaxConductivity_s_m)) {
        return {{"conductivity_s_m", "must be positive, at most 1e8 S/m (copper: 5.96e7)"}};
    }
    const auto is_permeability = [](double value) { return value >= 1 && value <= kMaxPermeability; };
    if (!is_permeability(m.permeability_low) || !is_permeability(m.permeability_high)) {
        return {{"relative_permeability", "must be 1 to 1e6"}};
    }
    return std::nullopt;
}

bool is_place(const Vec3<double>& place_m) { return place_m.cwiseAbs().maxCoeff() <= kMaxPlace_m; }

Invalid find_invalid_path(const MetalObject& o) {
    if (!is_place(o.pose.position_m)) {
        return {{"position_m", "must lie within 1000 m"}};
    }
    if (!is_place(o.far_m)) {
        return {{"to_m", "must lie within 1000 m"}};
    }
    if (!(o.speed_m_s >= 0 && o.speed_m_s <= kMaxSpeed_m_s)) {
        return {{"speed_m_s", "must be 0 to 100"}};
    }
    if (!(o.turn_rad_s.norm() <= kMaxTurn_rad_s)) {
        return {{"turn_rad_s", "must be at most 1000 rad/s"}};
    }
    return std::nullopt;
}

bool is_inside(const Sphere& s, const Vec3<double>& p) { return p.norm() < s.radius_m; }

/// The bore of a tube counts as inside.
bool is_inside(const Cylinder& c, const Vec3<double>& p) {
    return p.head<2>().norm() < c.diameter_m / 2 && std::abs(p.z()) <= c.length_m / 2;
}

bool is_inside(const Sheet& s, const Vec3<double>& p) {
    return std::abs(p.x()) < s.width_m / 2 && std::abs(p.y()) < s.height_m / 2 && std::abs(p.z()) < s.thickness_m / 2;
}

/// Moves a point inside the shape to the surface, away from the centre, axis or middle plane.
Vec3<double> pushed_out(const Sphere& s, const Vec3<double>& p) {
    return p.norm() > 0 ? Vec3<double>(s.radius_m * p.normalized()) : Vec3<double>(s.radius_m, 0, 0);
}

Vec3<double> pushed_out(const Cylinder& c, const Vec3<double>& p) {
    const double distance = p.head<2>().norm();
    const double scale = distance > 0 ? c.diameter_m / (2 * distance) : 0;
    return distance > 0 ? Vec3<double>(scale * p.x(), scale * p.y(), p.z()) : Vec3<double>(c.diameter_m / 2, 0, p.z());
}

Vec3<double> pushed_out(const Sheet& s, const Vec3<double>& p) { return {p.x(), p.y(), std::copysign(s.thickness_m / 2, p.z())}; }

double smallest_m(const Sphere& s) { return 2 * s.radius_m; }
double smallest_m(const Cylinder& c) { return c.diameter_m; }
double smallest_m(const Sheet& s) { return s.thickness_m; }

double reach_m(const Sphere& s) { return s.radius_m; }
double reach_m(const Cylinder& c) { return std::hypot(c.length_m, c.diameter_m) / 2; }
double reach_m(const Sheet& s) { return std::hypot(s.width_m, s.height_m) / 2; }

std::string name_of(const Sphere& /*unused*/) { return "sphere"; }
std::string name_of(const Cylinder& c) { return c.wall_m > 0 ? "tube" : "rod"; }
std::string name_of(const Sheet& /*unused*/) { return "sheet"; }

}  // namespace

Pose MetalObject::at(double time_s) const {
    Pose now = pose;
    const Vec3<double> way = far_m - pose.position_m;
    if (speed_m_s > 0 && way.norm() > 0) {
        const double phase = 2 * speed_m_s * time_s / way.norm();
        now.position_m += (1 - std::cos(phase)) / 2 * way;
    }
    if (!turn_rad_s.isZero(0)) {
        now.q_source_sensor = geometry::rotation_vector_to_quaternion<double>(turn_rad_s * time_s) * pose.q_source_sensor;
    }
    return now;
}

double passing_s(const MetalObject& object) {
    const auto passing = [&](const auto& s) {
        const double speed_m_s = object.speed_m_s + object.turn_rad_s.norm() * reach_m(s);
        return speed_m_s > 0 ? smallest_m(s) / speed_m_s : std::numeric_limits<double>::infinity();
    };
    return std::visit(passing, object.shape);
}

std::string shape_name(const MetalShape& shape) {
    return std::visit([](const auto& s) { return name_of(s); }, shape);
}

bool contains(const MetalShape& shape, const Vec3<double>& point_m) {
    return std::visit([&](const auto& s) { return is_inside(s, point_m); }, shape);
}

Vec3<double> outside(const MetalShape& shape, const Vec3<double>& point_m) {
    return contains(shape, point_m) ? std::visit([&](const auto& s) { return pushed_out(s, point_m); }, shape) : point_m;
}

bool contains_at(const MetalObject& object, const Vec3<double>& point_m, double time_s) {
    const Pose pose = object.at(time_s);
    return contains(object.shape, pose.q_source_sensor.conjugate() * (point_m - pose.position_m));
}

std::optional<InvalidValue> find_invalid(const MetalObject& object) {
    Invalid invalid = std::visit([](const auto& s) { return find_invalid_size(s); }, object.shape);
    if (!invalid) {
        invalid = find_invalid_value(object.material);
    }
    return invalid ? invalid : find_invalid_path(object);
}

}  // namespace tricoil::sim
