// A metal object: shape, material and path.
#pragma once

#include <optional>
#include <string>
#include <variant>

#include "sim/motion/motion.hpp"
#include "sim/world/metal/material.hpp"

namespace tricoil::sim {

struct Sphere {
    double radius_m = 0.05;
};

/// A round rod, or a tube, along the z axis.
struct Cylinder {
    double diameter_m = 0.01;  // outer
    double length_m = 0.1;
    double wall_m = 0;  // 0: solid
};

/// A rectangular sheet; its normal is the z axis.
struct Sheet {
    double width_m = 0.3;   // along x
    double height_m = 0.3;  // along y
    double thickness_m = 1e-3;
};

/// In the frame of the object: its centre is the origin.
using MetalShape = std::variant<Sphere, Cylinder, Sheet>;

/// Moves smoothly between its place at time 0 and `far_m`: the displacement is (1 - cos(w t)) / 2 of the way. Turns at a constant
/// rate.
struct MetalObject {
    MetalShape shape;
    Material material;
    Pose pose;                                       // at time 0, in the source frame; v_source = q v_object
    Vec3<double> far_m = Vec3<double>::Zero();       // used if the speed is not 0
    double speed_m_s = 0;                            // maximum speed on the way
    Vec3<double> turn_rad_s = Vec3<double>::Zero();  // in the source frame

    [[nodiscard]] Pose at(double time_s) const;
    [[nodiscard]] bool is_at_rest() const { return speed_m_s == 0 && turn_rad_s.isZero(0); }
};

/// Shortest time in which the object can pass a point; infinite at rest.
double passing_s(const MetalObject& object);

/// "sphere", "rod", "tube" or "sheet"
std::string shape_name(const MetalShape& shape);

/// True if the point (object frame, m) lies inside the shape.
bool contains(const MetalShape& shape, const Vec3<double>& point_m);

/// The point itself, or a point on the surface if the point is inside the shape.
Vec3<double> outside(const MetalShape& shape, const Vec3<double>& point_m);

/// True if a point of the source frame lies inside the object at a time.
bool contains_at(const MetalObject& object, const Vec3<double>& point_m, double time_s);

/// An invalid value: its key in scenario files, and the requirement.
struct InvalidValue {
    const char* key;
    const char* requirement;
};

/// The first invalid value of an object; none if all are valid.
std::optional<InvalidValue> find_invalid(const MetalObject& object);

}  // namespace tricoil::sim
