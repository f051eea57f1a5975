#include "sim/world/metal/object.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "core/geometry/rotations.hpp"

namespace tricoil::sim {
namespace {

void demand(bool ok, const char* what) {
    if (!ok) {
        throw std::invalid_argument(what);
    }
}

bool is_size(double value_m) { return value_m > 0 && value_m <= kGreatestMetalSize_m; }

void check_size(const Sphere& s) { demand(is_size(s.radius_m), "the radius must be positive, at most 10 m"); }

void check_size(const Cylinder& c) {
    demand(is_size(c.diameter_m) && is_size(c.length_m), "diameter and length must be positive, at most 10 m");
    demand(c.length_m >= c.diameter_m, "the length must be at least the diameter");
    demand(c.wall_m >= 0 && c.wall_m <= c.diameter_m / 2, "the wall must be at most half the diameter");
}

void check_size(const Sheet& s) {
    demand(is_size(s.width_m) && is_size(s.height_m), "width and height must be positive, at most 10 m");
    demand(s.thickness_m > 0 && 5 * s.thickness_m <= std::min(s.width_m, s.height_m),
           "the thickness must be positive, at most a fifth of width and height");
    demand(std::max(s.width_m, s.height_m) <= 10 * std::min(s.width_m, s.height_m),
           "the sides must not differ by more than a factor of 10");
}

bool is_inside(const Sphere& s, const Vec3<double>& p) { return p.norm() < s.radius_m; }

/// The bore of a tube counts as inside.
bool is_inside(const Cylinder& c, const Vec3<double>& p) {
    return p.head<2>().norm() < c.diameter_m / 2 && std::abs(p.z()) < c.length_m / 2;
}

bool is_inside(const Sheet& s, const Vec3<double>& p) {
    return std::abs(p.x()) < s.width_m / 2 && std::abs(p.y()) < s.height_m / 2 && std::abs(p.z()) < s.thickness_m / 2;
}

/// A point inside, pushed to the surface away from the centre or axis.
Vec3<double> pushed_out(const Sphere& s, const Vec3<double>& p) {
    return p.norm() > 0 ? Vec3<double>(s.radius_m * p.normalized()) : Vec3<double>(s.radius_m, 0, 0);
}

Vec3<double> pushed_out(const Cylinder& c, const Vec3<double>& p) {
    const double distance = p.head<2>().norm();
    const double scale = distance > 0 ? c.diameter_m / (2 * distance) : 0;
    return distance > 0 ? Vec3<double>(scale * p.x(), scale * p.y(), p.z()) : Vec3<double>(c.diameter_m / 2, 0, p.z());
}

Vec3<double> pushed_out(const Sheet& s, const Vec3<double>& p) { return {p.x(), p.y(), std::copysign(s.thickness_m / 2, p.z())}; }

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

void check(const MetalObject& object) {
    std::visit([](const auto& s) { check_size(s); }, object.shape);
    check(object.material);
    demand(object.pose.position_m.allFinite() && object.far_m.allFinite(), "positions must be finite");
    demand(object.speed_m_s >= 0 && object.speed_m_s <= kGreatestMetalSpeed_m_s, "the speed must be 0 to 100 m/s");
    demand(object.turn_rad_s.allFinite(), "the turning rate must be finite");
}

}  // namespace tricoil::sim
