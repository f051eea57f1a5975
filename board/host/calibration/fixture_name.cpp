#include "board/host/calibration/fixture_name.hpp"

#include <array>
#include <cmath>
#include <regex>

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

Vec3<double> direction_of(const std::string& name) {
    for (const NamedDirection& direction : directions()) {
        if (name == direction.name) {
            return direction.axis;
        }
    }
    return Vec3<double>::Zero();
}

}  // namespace

std::optional<Mat3<double>> rotation_of_fixture(const std::string& name) {
    static const std::regex pattern("([XYZ])(right|left|out|in|up|down)([XYZ])(right|left|out|in|up|down)");
    std::smatch match;
    if (!std::regex_match(name, match, pattern)) {
        return std::nullopt;
    }
    const int first = match[1].str()[0] - 'X';
    const int second = match[3].str()[0] - 'X';
    const Vec3<double> a = direction_of(match[2]);
    const Vec3<double> b = direction_of(match[4]);
    if (first == second || std::abs(a.dot(b)) > 0.5) {
        return std::nullopt;
    }
    Mat3<double> rotation;
    rotation.col(first) = a;
    rotation.col(second) = b;
    const int third = 3 - first - second;
    const bool cyclic = (first + 1) % 3 == second;
    rotation.col(third) = cyclic ? a.cross(b) : b.cross(a);
    return rotation;
}

}  // namespace tricoil::host
