#include "board/host/calibration/fixture_name.hpp"

#include <array>
#include <cmath>
#include <string_view>

#include "core/linear/quaternion.hpp"

namespace tricoil::host {
namespace {

struct NamedDirection {
    const char* name;
    Vec3<double> axis;
};

const std::array<NamedDirection, 6>& directions() {
    static const std::array<NamedDirection, 6> all{{{"right", {1, 0, 0}},
                                                    {"left", {-1, 0, 0}},
                                                    {"out", {0, 1, 0}},
                                                    {"in", {0, -1, 0}},
                                                    {"up", {0, 0, 1}},
                                                    {"down", {0, 0, -1}}}};
    return all;
}

struct NamedAxis {
    int axis = 0;
    Vec3<double> direction;
};

/// Removes an axis and its direction from the front of the text: "Zin".
std::optional<NamedAxis> take_axis(std::string_view& text) {
    for (const NamedDirection& one : directions()) {
        if (!text.empty() && text[0] >= 'X' && text[0] <= 'Z' && text.substr(1).starts_with(one.name)) {
            const int axis = text[0] - 'X';
            text.remove_prefix(1 + std::string_view(one.name).size());
            return NamedAxis{axis, one.axis};
        }
    }
    return std::nullopt;
}

}  // namespace

std::optional<Mat3<double>> rotation_of_fixture(const std::string& name) {
    std::string_view text = name;
    const auto one = take_axis(text);
    const auto other = take_axis(text);
    if (!one || !other || !text.empty() || one->axis == other->axis || std::abs(one->direction.dot(other->direction)) > 0.5) {
        return std::nullopt;
    }
    const auto [first, a] = *one;
    const auto [second, b] = *other;
    Mat3<double> rotation;
    rotation.col(first) = a;
    rotation.col(second) = b;
    const int third = 3 - first - second;
    const bool cyclic = (first + 1) % 3 == second;
    rotation.col(third) = cyclic ? a.cross(b) : b.cross(a);
    return rotation;
}

}  // namespace tricoil::host
