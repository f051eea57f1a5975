#include "board/pose_text/output_format.hpp"

#include <fmt/format.h>

#include <array>

#include "board/support/errors.hpp"
#include "board/support/nearest_name.hpp"

namespace tricoil::host {
namespace {

Vec3<double> point(const std::vector<double>& numbers, std::size_t first, const char* option) {
    const Vec3<double> p(numbers[first], numbers[first + 1], numbers[first + 2]);
    refuse_if(!p.allFinite(), "{}: must be finite numbers", option);
    return p;
}

geometry::AxisOrder axis_order(const std::string& name) {
    const std::size_t n = index_of_name("--euler", name, {"zyx", "xyz", "yzx", "zxy", "yxz", "xzy"});
    constexpr std::array<geometry::AxisOrder, 6> kOrders{{{2, 1, 0}, {0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {1, 0, 2}, {0, 2, 1}}};
    return kOrders[n];
}

}  // namespace

OutputFormat make_output_format(const OutputOptions& options) {
    OutputFormat format;
    format.units.unit = options.unit;
    format.units.units_per_m = kUnitsPerMetre[index_of_name("--units", options.unit, kLengthUnits)];
    format.tips = ToolTips(options.tips);
    if (!options.align_points.empty()) {
        const Status status =
            tracking::align(format.frame, point(options.align_points, 0, "--align"), point(options.align_points, 3, "--align"),
                            point(options.align_points, 6, "--align"));
        refuse_if(!status.ok(), "--align: {}", status.message());
    }
    if (!options.euler.empty()) {
        format.units.euler = axis_order(options.euler);
        format.units.euler_name = options.euler;
    }
    return format;
}

}  // namespace tricoil::host
