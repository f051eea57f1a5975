#include "sim/world/metal/body.hpp"

#include <cmath>

#include "sim/world/metal/cylinder.hpp"
#include "sim/world/metal/sheet.hpp"
#include "sim/world/metal/sphere.hpp"

namespace tricoil::sim {
namespace {

std::unique_ptr<MetalBody> make(const Sphere& sphere, const Material& material) {
    return std::make_unique<SphereBody>(sphere, material);
}

std::unique_ptr<MetalBody> make(const Cylinder& cylinder, const Material& material) {
    return std::make_unique<CylinderBody>(cylinder, material);
}

std::unique_ptr<MetalBody> make(const Sheet& sheet, const Material& material) {
    return std::make_unique<SheetBody>(sheet, material);
}

}  // namespace

Mat3<double> unit_dipole_field(const Vec3<double>& r) {
    const double squared = r.squaredNorm();
    return (3 / squared * r * r.transpose() - Mat3<double>::Identity()) / (squared * std::sqrt(squared));
}

std::unique_ptr<MetalBody> make_body(const MetalShape& shape, const Material& material) {
    return std::visit([&](const auto& s) { return make(s, material); }, shape);
}

}  // namespace tricoil::sim
